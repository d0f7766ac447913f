"""Output error: the same least squares by SciPy, with finite differences through our replay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from interleaving import interleaved
from scipy.optimize import least_squares

import hydrodamp as hd
from hydrodamp.identification.gauss_newton import (
    Iterate,
    initial_candidates,
    make_objective,
    minimise,
)

pytestmark = pytest.mark.usefixtures("one_core")


@pytest.mark.parametrize(("key", "target"), [("fossen", None), ("gertler-hagen", 10.0)])
def test_against_scipy(benchmark, ledger, key, target):
    """Four runs of 60 s in windows of 8 s, from the weak form, at least as near in the end.

    Finite differences replay once a coefficient: few coefficients leave little to gain.
    """
    campaign, model = hd.reenact(seed=0, duration=60.0), hd.catalog[key]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    search = make_objective(problem, model)
    # SciPy holds first velocities where they are, so they are in no doubt here either.
    windows = replace(search.windows(8.0), doubt=np.full(6, 1e-9))
    first = initial_candidates(search, model)[-1]
    start = search.wider(Iterate(first, (), strength=1e-4), windows)
    spread = search.spread(first, windows)

    def errors(coefficients: np.ndarray) -> np.ndarray:
        return (windows.errors(coefficients) / spread).ravel()

    def ours() -> np.ndarray:
        return minimise(search, start, rest=1e-2).coefficients

    def other() -> np.ndarray:
        return least_squares(errors, first, x_scale=search.unit, ftol=1e-2, max_nfev=12).x

    fast, slow = interleaved(benchmark, ours, other, rounds=2, other_rounds=1)

    near, nearer = (np.log(search.spread(end(), windows)).mean() for end in (other, ours))
    assert nearer < near + 0.01
    ledger.faster(
        f"output error, {key}: least_squares with finite differences", fast, slow, target=target
    )
