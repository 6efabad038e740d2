"""Samples of a screening that are continued with grains where the ellipsoid model ends.

Each such sample is one pile, whose seed is the number of the sample; it is one unit of work and one record of the
journal. The scatter between piles is thus part of the distribution over the samples.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flybystab.encounter.attitude import periapsis_axes
from flybystab.errors import FlybystabError
from flybystab.flybys.escalation import ESCALATED
from flybystab.flybys.grains_flyby import grains_flyby
from flybystab.screening.clones import Clones
from flybystab.screening.draws import Attitudes
from flybystab.screening.encounters import CloseApproach
from flybystab.screening.sample_verdicts import SampleVerdicts
from flybystab.screening.settings import Settings

#: Number of the catalogue body among the samples.
CATALOGUE_BODY = -1


@dataclass(frozen=True)
class GrainSample:
    """A sample that needs grains.

    Attributes
    ----------
    approach : CloseApproach
    clones : Clones or None
        Set where each sample has its own orbit.
    number : int
        Of the sample; :data:`CATALOGUE_BODY` for that body.
    attitudes : Attitudes
        Of this sample, with its body.
    verdict : str
        Of the ellipsoid; kept where the grains give none.
    """

    approach: CloseApproach
    clones: Clones | None
    number: int
    attitudes: Attitudes
    verdict: str

    def judged(self, settings: Settings) -> SampleVerdicts:
        """Verdict of one pile of grains, or the reason why there is none."""
        approach = self.approach
        error, verdict, largest = "", self.verdict, np.nan
        try:
            if self.clones is not None and self.number != CATALOGUE_BODY:
                (approach,) = self.clones.close_approaches(self.number, self.number + 1)
            encounter = approach.meet()
            turn = periapsis_axes(encounter) @ self.attitudes.matrix(0)
            with warnings.catch_warnings():  # a small number of grains is warned of with the settings
                warnings.simplefilter("ignore", UserWarning)
                outcome = grains_flyby(
                    self.attitudes.draws.body(0, settings.material),
                    encounter,
                    encounter.periapsis_axes.T @ turn,
                    grains=settings.grains,
                    seeds=[self.number - CATALOGUE_BODY],
                    threads=1,
                    keep=False,
                )
            verdict, largest = str(outcome.verdict), outcome.largest_fraction
        except FlybystabError as problem:
            error = f"no grains: {type(problem).__name__}: {problem}"
        nan = np.full(1, np.nan)
        return SampleVerdicts(
            [verdict], nan, nan.copy(), np.ones(1, dtype=bool), [error], nan.copy(),
            grains=np.ones(1, dtype=bool), largest=np.full(1, largest),
        )  # fmt: skip


def needing_grains(first: int, verdicts: Sequence[str]) -> dict[int, str]:
    """Numbers and verdicts of the samples from `first` on that the ellipsoid cannot follow to the end."""
    return {first + k: str(v) for k, v in enumerate(verdicts) if v in ESCALATED}
