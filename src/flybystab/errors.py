"""Named errors. Each message gives the offending value and what is expected.

Every error derives from :class:`FlybystabError`; those caused by an argument are also ``ValueError``
(or ``KeyError`` and so on), so that general handlers catch them too.
"""

from __future__ import annotations

#: Characters of a value that a message shows in full.
LONGEST = 400


class FlybystabError(Exception):
    """Base class of the errors of the package."""


class FlybystabWarning(UserWarning):
    """A problem that does not affect the result, such as a damaged journal whose losses are recomputed."""


class InvalidInput(FlybystabError, ValueError):
    """An argument is outside its domain.

    Attributes
    ----------
    name : str
        The argument.
    value : object
        The value given.
    expected : str
        Description of the values expected.
    """

    def __init__(self, name: str, value: object, expected: str) -> None:
        self.name, self.value, self.expected = name, value, expected
        text = str(value)
        if len(text) > LONGEST:  # such as a long array
            text = f"{text[: LONGEST // 2]} ... {text[-LONGEST // 4 :]}"
        super().__init__(f"{name} = {text}: expected {expected}")


class UnitMismatch(InvalidInput):
    """A quantity has the wrong physical dimension, or a bare number was given where a unit is needed."""


class UnsettledBody(InvalidInput):
    """The body was flowing, dispersed, partly unbound or on the ground at the end of its last encounter.

    No rigid ellipsoid represents it. ``body.with_(state="rigid")`` assumes that it has come to rest in its shape.
    """


class UnknownName(FlybystabError, KeyError):
    """A name (asteroid, planet, yield surface, TOML key) is not known; near matches are offered.

    Attributes
    ----------
    kind, name : str
        Kind of the name, such as "planet".
    suggestions : list of str
        Near matches, best first.
    """

    def __init__(self, kind: str, name: str, suggestions: list[str], known: str = "") -> None:
        self.kind, self.name, self.suggestions = kind, name, list(suggestions)
        hint = f"; did you mean {', '.join(suggestions)}?" if suggestions else ""
        self.message = f"unknown {kind} {name!r}{hint}{' ' + known if known else ''}"
        super().__init__(self.message)

    def __str__(self) -> str:  # KeyError would print the repr
        return self.message


class NotModelled(FlybystabError, NotImplementedError):
    """The request is outside the model; the message gives the limits of the model."""


class OutOfSpan(FlybystabError, ValueError):
    """A date lies outside the time span of the ephemeris (or of a table)."""

    def __init__(self, what: str, value: str, start: str, stop: str, remedy: str = "") -> None:
        self.what, self.value, self.start, self.stop = what, value, start, stop
        super().__init__(
            f"{value} is outside the span of {what}: {start} to {stop}{'. ' + remedy if remedy else ''}"
        )


class WrongUsage(FlybystabError, ValueError):
    """An invalid command line: exit status 2."""


class NoEncounter(FlybystabError, LookupError):
    """The orbit has no close approach to the planet near the requested time."""


class Impact(FlybystabError, ValueError):
    """The asteroid hits the Sun, a planet or the Moon before the requested time: no state exists there."""


class InaccurateOrbit(UserWarning):
    """The numerical error of a propagated state, measured by a second integration, is large."""


class NotConverged(FlybystabError, ArithmeticError):
    """A numerical method did not converge; the message gives the place and the state."""


class MissingExtra(FlybystabError, ImportError):
    """The request needs an optional package that is not installed."""

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        self.package, self.extra = package, extra
        super().__init__(f"{purpose} needs the package {package}: pip install 'flybystab[{extra}]'")


class NothingComputed(FlybystabError, RuntimeError):
    """Every row of a table failed; the message gives the most frequent reason, the table all of them."""


class WorkersLost(FlybystabError, RuntimeError):
    """Worker processes ended unexpectedly; finished results are kept."""


class OutputFailed(FlybystabError, OSError):
    """A result file could not be written during a run; the message names the results that are kept, and their files."""
