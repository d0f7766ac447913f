"""The weak form: against least squares and against PySINDy's weak form."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from interleaving import interleaved
from workload import PAPER, VEHICLE, log, problem, truth

import hydrodamp as hd
from hydrodamp.identification.least_squares import WeakForm
from hydrodamp.identification.regression import accumulate
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.kernels.core import coriolis

pytestmark = pytest.mark.usefixtures("one_core")
SUPPORT = 1.6
LINEAR = hd.catalog["linear"]


def test_samples_through_the_triangle(benchmark, ledger):
    """The support asked for, then chosen from the log."""
    n = 1_000_000
    prepared = problem(n, PAPER)
    asked = WeakRegression(SUPPORT, windows=())
    fast, slow = interleaved(
        benchmark,
        lambda: asked.rows(prepared).triangle(),
        lambda: accumulate(prepared, hd.FiniteDifference()),
        rounds=3,
    )
    rates = n / fast / 1e6, n / slow / 1e6
    ledger.reaches("weak triangle, 85 terms: least squares", *rates, unit="M samples/s")


def test_choosing_the_support(benchmark, ledger):
    n = 1_000_000
    prepared = problem(n, PAPER)
    asked = WeakRegression(SUPPORT, windows=())
    chosen, given = interleaved(
        benchmark,
        lambda: WeakRegression().rows(prepared).triangle(),
        lambda: asked.rows(prepared).triangle(),
        rounds=3,
    )
    ledger.within("weak triangle, support and windows chosen: both given", chosen, given)


def test_pysindy(benchmark, ledger):
    """Six linear terms a row, the same support and as many test functions, noise of 0.01.

    PySINDy differentiates nothing either. It takes one equation dx/dt = Theta(x) c, so
    what is known is given to it as six more states whose weak features are subtracted.
    """
    pysindy = pytest.importorskip("pysindy", reason="PySINDy is not installed")
    n = 5_000
    clean = log(n, damping="linear")
    noise = 0.01 * np.random.default_rng(3).standard_normal((n, 6))
    record = hd.Log.from_arrays(
        clean.time, clean.velocity + noise, attitude=clean.attitude, wrench=clean.wrench
    )
    prepared, mass = hd.prepare(VEHICLE, record, LINEAR), VEHICLE.mass_matrix
    method = WeakForm(WeakRegression(SUPPORT, windows=()))
    n_functions = method.equations.rows(prepared).n
    expected = truth(LINEAR).matrix
    found: list[np.ndarray] = []

    def by_pysindy() -> None:
        np.random.seed(0)  # it draws the places of its test functions from here
        known = coriolis(mass, record.velocity) + record.wrench
        known += VEHICLE.restoring_wrench(record.down)
        library = pysindy.WeakPDELibrary(
            function_library=pysindy.PolynomialLibrary(degree=1, include_bias=False),
            spatiotemporal_grid=record.time,
            K=n_functions,
            H_xt=[SUPPORT / 2],
            p=2,
        )
        states = np.hstack([record.velocity, known])
        trajectory = pysindy.AxesArray(states, {"ax_time": 0, "ax_coord": 1})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of its own axes, which it labels too many of
            library.fit([trajectory])
        features = np.asarray(library.transform([trajectory])[0])
        slopes = np.asarray(library.convert_u_dot_integral(trajectory))
        target = slopes[:, :6] @ mass - features[:, 6:12]
        found[:] = [np.linalg.lstsq(features[:, :6], target, rcond=None)[0].T]

    fast, slow = interleaved(
        benchmark, lambda: method.identify(prepared, LINEAR), by_pysindy, rounds=3, other_rounds=1
    )
    ours = method.identify(prepared, LINEAR).damping.matrix
    ledger.faster(f"weak form, 36 coefficients, {n} samples: PySINDy", fast, slow)
    size = np.linalg.norm(expected)
    errors = [np.linalg.norm(matrix - expected) / size for matrix in (ours, found[0])]
    ledger.within("the same: error of the coefficients", *errors, unit="share")
