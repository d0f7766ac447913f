"""Output error: the same least squares by SciPy, with finite differences through our replay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from interleaving import interleaved
from scipy.optimize import least_squares

import hydrodamp as hd
from hydrodamp.identification.gauss_newton import Iterate, minimise
from hydrodamp.identification.initial_iterate import initial_candidates, make_objective

pytestmark = pytest.mark.usefixtures("one_core")


@pytest.mark.parametrize(("key", "target"), [("fossen", None), ("gertler-hagen", 10.0)])
def test_against_scipy(benchmark, ledger, key, target):
    """Four runs of 60 s in windows of 8 s, from the weak form, at least as near in the end.

    Finite differences replay once a coefficient: few coefficients leave little to gain.
    """
    campaign, model = hd.reenact(seed=0, duration=60.0), hd.catalog[key]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    objective = make_objective(problem, model)
    # SciPy does not estimate initial states, so they are fixed here, too.
    windows = replace(objective.windows(8.0), initial_state_std=np.full(6, 1e-9))
    first = initial_candidates(objective, model)[-1]
    start = objective.add_length(Iterate(first, (), prior_strength=1e-4), windows)
    residual_std = objective.residual_std(first, windows)

    def residuals(coefficients: np.ndarray) -> np.ndarray:
        return (windows.residuals(coefficients) / residual_std).ravel()

    def ours() -> np.ndarray:
        return minimise(objective, start, tolerance=1e-2).coefficients

    def scipy() -> np.ndarray:
        return least_squares(residuals, first, x_scale=objective.scale, ftol=1e-2, max_nfev=12).x

    fast, slow = interleaved(benchmark, ours, scipy, rounds=2, other_rounds=1)

    scipy_cost, cost = (
        np.log(objective.residual_std(solve(), windows)).mean() for solve in (scipy, ours)
    )
    assert cost < scipy_cost + 0.01
    ledger.faster(
        f"output error, {key}: least_squares with finite differences", fast, slow, target=target
    )
