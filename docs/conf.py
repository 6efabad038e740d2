"""Sphinx: ``make docs``."""

from flybystab import __version__

project = "flybystab"
author = "The flybystab developers"
copyright = "the flybystab developers, GPL-3.0-or-later"
release = __version__
extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "myst_nb", "sphinx-mathjax-offline"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
# Notebooks are run when they change; an error in a cell fails the build.
nb_execution_mode = "cache"
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_merge_streams = True
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["custom.css"]
html_title = f"flybystab {release}"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_custom_sections = [("Attributes", "params_style")]  # keeps "a, b : type" together
napoleon_use_rtype = False
suppress_warnings = ["ref.python"]
