"""Measures of a point of the workspace over the configurations that reach it."""

from typing import Final

import numpy as np

from ftqp.core.checks import FloatArray

MEASURES: Final = ("R100", "Ravg", "Rsens", "F100", "Favg", "Fsens", "C100", "Cavg")
"""Names of the measures."""
WHOLE: Final = 1.0 - 1e-12
"""A share from here on is all."""


def measures_of(R: FloatArray, F: FloatArray) -> dict[str, FloatArray]:
    """The measures in percent, each (n + 1,); NaN where no configuration says it.

    100: the share of configurations with all of the length. avg: the mean. sens: the largest minus the
    smallest. C = R F is the share of the whole line on which a failure leaves the goal within reach and ends
    there. Source: goel2005, section 4, and docs/theory/after-a-failure.md, "Lines and measures".
    """
    shares = {"R": R, "F": F, "C": R * np.where(np.isnan(F), 0.0, F)}
    found: dict[str, FloatArray] = {}
    for letter, share in shares.items():
        said = ~np.isnan(share)
        count = said.sum(axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            found[f"{letter}100"] = 100.0 * ((share >= WHOLE) & said).sum(axis=0) / count
            found[f"{letter}avg"] = 100.0 * np.where(said, share, 0.0).sum(axis=0) / count
        if letter == "C":
            continue
        largest = np.where(said, share, -np.inf).max(axis=0, initial=-np.inf)
        smallest = np.where(said, share, np.inf).min(axis=0, initial=np.inf)
        found[f"{letter}sens"] = np.where(count > 0, 100.0 * (largest - smallest), np.nan)
    return found
