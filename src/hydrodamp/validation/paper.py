"""Table I as printed, and how like it a comparison is ordered."""

from __future__ import annotations

from dataclasses import dataclass

from hydrodamp.identification.methods import METHODS
from hydrodamp.validation.compare import Comparison


@dataclass(frozen=True)
class Printed:
    """One line of the paper's Table I."""

    n_coefficients: int
    ls: float
    ai: float


#: Root mean square velocity error values for different models.
TABLE_I = {
    "mcfarland-whitcomb": Printed(216, 0.40, 0.54),
    "pitch-yaw": Printed(100, 1.74, 2.00),
    "gertler-hagen": Printed(88, 0.39, 0.55),
    "linear": Printed(36, 0.50, 0.74),
    "coe": Printed(33, 1.29, 2.29),
    "prestero": Printed(30, 1.79, 2.31),
    "uncoupled": Printed(24, 2.15, 1.98),
    "fossen": Printed(12, 2.24, 2.08),
}

#: Which printed column a method stands beside.
PRINTED_COLUMN = {key: entry.printed for key, entry in METHODS.items() if entry.printed}


def beside_paper(comparison: Comparison) -> bool:
    """Tell whether Table I may stand beside a comparison."""
    return "truth" in comparison.provenance and any(key in TABLE_I for key in comparison.models)


def rank_correlation(comparison: Comparison, method: str) -> float | None:
    """Return how like Table I a method orders the models.

    Parameters
    ----------
    comparison : Comparison
        Rows of the method; a diverged row ranks last.
    method : str
        Key of a method that Table I has a column for.

    Returns
    -------
    rho : float or None
        Spearman's rank correlation over the models both have; None where
        there are fewer than three or all are tied.
    """
    column = PRINTED_COLUMN.get(method)
    pairs = [
        (row.rms, getattr(TABLE_I[row.model], column))
        for row in comparison.rows
        if column and row.method == method and row.model in TABLE_I
    ]
    ours = [float("inf") if rms is None else rms for rms, _ in pairs]
    if len(pairs) < 3 or len(set(ours)) < 2:
        return None
    from scipy.stats import rankdata

    first, second = rankdata(ours), rankdata([printed for _, printed in pairs])
    first, second = first - first.mean(), second - second.mean()
    return float(first @ second / (first @ first * (second @ second)) ** 0.5)
