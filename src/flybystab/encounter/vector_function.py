"""The path of an encounter as a vector function of skyfield."""

from __future__ import annotations

from skyfield.timelib import Time
from skyfield.vectorlib import VectorFunction

from flybystab.constants import DAY
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.orbit.vector_function import shaped, whole_and_fraction
from flybystab.typing import Array


class EncounterVector(VectorFunction):
    """Asteroid relative to the planet encountered, ICRF; nan before the start and after the end of the encounter.

    ``file["earth"] + EncounterVector(encounter)`` is a target for ``observe``.

    Parameters
    ----------
    encounter : Encounter
        On a real orbit (frame ``"ICRF"``).

    Raises
    ------
    InvalidInput
        A scripted encounter, which has no date.
    """

    def __init__(self, encounter: Encounter) -> None:
        if encounter.time is None or encounter.frame != "ICRF":
            raise InvalidInput("encounter", encounter, "an encounter on a real orbit, with a date")
        self.center = encounter.planet.target
        self.target = f"asteroid at {encounter.planet.name}"
        self._encounter = encounter

    @property
    def target_name(self) -> str:
        """Description of the target."""
        return str(self.target)

    def _at(self, t: Time) -> tuple[Array, Array, None, None]:
        assert self._encounter.time is not None
        whole, fraction = whole_and_fraction(t)
        zero = self._encounter.time.tdb
        return shaped(self._encounter.track.states(((whole - zero.jd1) + (fraction - zero.jd2)) * DAY), t)


__all__ = ["EncounterVector"]
