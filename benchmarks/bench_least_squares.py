"""Least squares: against the literal form, per second, and in memory."""

from __future__ import annotations

import os
import tracemalloc

import numpy as np
import pytest
from interleaving import interleaved
from workload import PAPER, log, problem

import hydrodamp as hd
from hydrodamp.identification.regression import accumulate, damping_wrench

METHOD = hd.LeastSquares(hd.RecordedAcceleration())
GIGABYTE = 2.0**30
pytestmark = pytest.mark.usefixtures("one_core")


def literal(prepared: hd.Problem, model: hd.DampingModel) -> np.ndarray:
    """Equations 10 to 14: Kronecker product, masking, one least-squares problem."""
    wrench = damping_wrench(prepared, prepared.log.acceleration)
    regressor = prepared.regressor()[:, prepared.equations.n_known :]
    mask = np.zeros((6, regressor.shape[1]), dtype=bool)
    for axis, terms in enumerate(model.terms):
        mask[axis, [prepared.equations.basis.index(term) for term in terms]] = True
    stacked = np.kron(np.eye(6), regressor)[:, mask.ravel()]
    return np.linalg.lstsq(stacked, wrench.T.ravel(), rcond=None)[0]


def free_memory() -> float:
    """Return the memory left [GB], infinite where it cannot be asked for."""
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / GIGABYTE
    except (AttributeError, ValueError, OSError):
        return np.inf


def test_all_eight_models(benchmark, ledger):
    """1e5 samples; the literal form needs 10 GB, else 1e4 samples are extrapolated."""
    n = 100_000
    fewer = n if free_memory() > 12.0 else n // 10
    ours, other = problem(n, PAPER), problem(fewer, PAPER)
    found: dict[str, np.ndarray] = {}

    def by_the_letter() -> None:
        found.update({model.key: literal(other, model) for model in PAPER})

    fast, slow = interleaved(
        benchmark, lambda: METHOD.identify_all(ours, PAPER), by_the_letter, rounds=7, other_rounds=1
    )

    for fit in METHOD.identify_all(other, PAPER):
        expected = found[fit.model.key]
        size = np.abs(expected).max()
        np.testing.assert_allclose(fit.damping.coefficients, expected, atol=1e-7 * size)
    told = "" if fewer == n else f" (literal: {n // fewer} x its time at {fewer:.0e})"
    what = f"eight models, 1e5 samples: literal Kronecker form{told}"
    ledger.faster(what, fast, slow * (n // fewer), target=100.0)


def test_samples_through_the_triangle(benchmark, ledger):
    n = 1_000_000
    prepared = problem(n, PAPER)

    def numpy_alone() -> np.ndarray:
        part = slice(0, n // 10)
        columns = prepared.regressor(0, n // 10)[:, prepared.equations.n_known :]
        return np.linalg.qr(np.hstack([columns, prepared.inputs.wrench[part]]), mode="r")

    fast, slow = interleaved(
        benchmark, lambda: accumulate(prepared, METHOD.derivative), numpy_alone
    )

    ledger.reaches(
        "triangle of 85 terms, 1e6 samples: the rate asked for",
        n / fast / 1e6,
        0.5,
        unit="M samples/s",
        target=1.0,
    )
    rates = n / fast / 1e6, n / 10 / slow / 1e6
    ledger.reaches("the same: numpy.linalg.qr, 1e5 rows at once", *rates, unit="M samples/s")


def test_memory_of_the_triangle(benchmark, ledger):
    """Peak beyond the inputs, with twice the samples."""
    peaks = {}
    accumulate(problem(1_000, PAPER), METHOD.derivative)  # what is imported is no growth
    for n in (1_000_000, 2_000_000):
        prepared = problem(n, PAPER)
        tracemalloc.start()
        if n == 1_000_000:
            accumulate(prepared, METHOD.derivative)
        else:
            benchmark.pedantic(accumulate, (prepared, METHOD.derivative), rounds=1)
        peaks[n] = tracemalloc.get_traced_memory()[1] / 1e6
        tracemalloc.stop()
        log.cache_clear()
    ledger.within(
        "triangle, peak beyond the inputs: 2e6 samples (ours), 1e6 (other)",
        peaks[2_000_000],
        peaks[1_000_000],
        unit="MB",
        target=1.1,
    )


def test_another_model_from_the_triangle(benchmark, ledger):
    """Without the data: all eight from a stored triangle, against passing over the data."""
    prepared = problem(100_000, PAPER)
    triangle = accumulate(prepared, METHOD.derivative)
    fast, slow = interleaved(
        benchmark,
        lambda: [METHOD.solve(triangle, prepared, model) for model in PAPER],
        lambda: METHOD.identify_all(prepared, PAPER),
    )
    ledger.faster("eight models from a stored triangle: from 1e5 samples", fast, slow)
