"""Progress lines."""

import io

import pytest

from flybystab.screening.progress import Progress, ProgressBar

STATE = Progress(30, 120, 10, 55, {"INTACT": 50, "RESHAPED": 5}, 4.0)


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_rate_and_time_left_count_this_run_only():
    assert STATE.rate == pytest.approx(5.0)
    assert STATE.remaining == pytest.approx(18.0)


def test_a_terminal_gets_a_bar():
    out = Terminal()
    bar = ProgressBar(out)
    bar(STATE)
    bar(Progress(120, 120, 10, 80, {"INTACT": 80}, 20.0))
    text = out.getvalue()
    assert text.count("\r") == 2
    assert "[#####" in text
    assert "30/120" in text
    assert text.endswith("\n")


def test_a_log_gets_one_line_at_the_end():
    out = io.StringIO()
    bar = ProgressBar(out)
    for n in range(1, 121):
        bar(Progress(n, 120, 0, n, {"INTACT": n}, 1.0))
    assert out.getvalue().count("\n") == 1
    assert "120/120 asteroids" in out.getvalue()
    assert "120 INTACT" in out.getvalue()
