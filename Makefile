# Two commands for a fresh machine (Python 3.11+ and a C compiler): `make demo` and `make test`.
# Both install into .venv once and work offline from then on.
PYTHON ?= python3
PY = .venv/bin/python

.PHONY: demo test check docs dist minimum clean

.venv/bin/python:
	$(PYTHON) -m venv .venv

# Reinstalled only when pyproject.toml changes; the sources are used in place.
.venv/.demo: pyproject.toml | .venv/bin/python
	$(PY) -m pip install --quiet --disable-pip-version-check -e .
	touch $@

.venv/.test: pyproject.toml | .venv/bin/python
	$(PY) -m pip install --quiet --disable-pip-version-check -e ".[dev,jpl]"
	touch $@ .venv/.demo

demo: .venv/.demo
	mkdir -p out
	$(PY) -m flybystab flyby Apophis --output out/apophis.png

test: .venv/.test
	$(PY) -m pytest -n 2

check: .venv/.test
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	.venv/bin/lint-imports
	.venv/bin/codespell src tests docs examples benchmarks scripts *.md data/README.md

.venv/.docs: pyproject.toml | .venv/bin/python
	$(PY) -m pip install --quiet --disable-pip-version-check -e ".[docs]"
	touch $@

docs: .venv/.docs
	$(PY) -m sphinx -E -W --keep-going -b html -q docs out/docs

# Wheel and sdist, installed in clean environments and tried outside the repository. The wheel is built in a tree with
# a file of an earlier build, which must not reach it.
dist: .venv/.test
	rm -rf dist build
	mkdir -p build/lib/flybystab && touch build/lib/flybystab/left_over.py
	$(PY) -m build --sdist --wheel --outdir dist . > /dev/null
	rm -rf build
	$(PY) scripts/smoke_test.py dist

# Declared minimum versions, in an environment of their own.
minimum:
	$(PYTHON) scripts/minimum_versions.py

clean:
	rm -rf .venv out build dist src/*.egg-info
