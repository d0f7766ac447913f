"""Output error: the same least squares by SciPy, with finite differences through our replay."""

from __future__ import annotations

import numpy as np
import pytest
from interleaving import interleaved
from scipy.optimize import least_squares

import hydrodamp as hd
from hydrodamp.identification.search import Place, descend, searching, spread_of, starts

pytestmark = pytest.mark.usefixtures("one_core")


@pytest.mark.parametrize("key", ["fossen", "prestero", "gertler-hagen"])
def test_against_scipy(benchmark, ledger, key):
    """Four runs of 60 s in windows of 8 s, from the weak form, to the same relative gain."""
    campaign, model = hd.reenact(seed=0, duration=60.0), hd.catalog[key]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    search = searching(problem, model)
    windows, first = search.windows(8.0), starts(problem, model)[0]
    spread = spread_of(search, windows.errors(first))

    def errors(coefficients: np.ndarray) -> np.ndarray:
        return (windows.errors(coefficients) / spread).ravel()

    def ours() -> float:
        end = descend(search, windows, Place(first, spread, strength=1e-4), rounds=12)
        return float(np.sum(errors(end.coefficients) ** 2))

    def other() -> float:
        found = least_squares(errors, first, x_scale=search.unit, ftol=1e-2, max_nfev=12)
        return 2.0 * float(found.cost)

    fast, slow = interleaved(benchmark, ours, other, rounds=2, other_rounds=1)

    assert ours() < 1.05 * other()
    ledger.faster(f"output error, {key}: least_squares with finite differences", fast, slow)
