"""Recursive least squares: the C core against a NumPy loop."""

from __future__ import annotations

import numpy as np
import pytest
from interleaving import interleaved
from workload import VEHICLE, log

import hydrodamp as hd
import oracle
from hydrodamp.identification.recursive import RecursiveLeastSquares
from hydrodamp.kernels import core

MODEL = hd.catalog["mcfarland-whitcomb"]
SAMPLES, FEW = 50_000, 2_000
pytestmark = pytest.mark.usefixtures("one_core")


def problem(n: int) -> hd.Problem:
    return hd.prepare(VEHICLE, log(n), MODEL)


def recursion(n: int, way):
    """Return a run of recursive least squares as a call of no arguments."""
    prepared = problem(n)
    adaptation = RecursiveLeastSquares(block=1.0).bind(problem(SAMPLES), MODEL)
    settings, start = adaptation.settings, adaptation.settings.initial_estimate(adaptation.start)
    arguments = (settings, start, prepared.inputs, prepared.segments)
    return lambda: way.recur(*arguments)


def test_against_numpy(benchmark, ledger):
    what = "recursive least squares, 216 coefficients: NumPy loop"
    fast, slow = interleaved(benchmark, recursion(SAMPLES, core), recursion(FEW, oracle), rounds=3)
    found, expected = (recursion(FEW, way)() for way in (core, oracle))
    np.testing.assert_allclose(found.coefficients, expected.coefficients, rtol=1e-5, atol=1e-6)
    ledger.faster(what, fast / SAMPLES * 1e6, slow / FEW * 1e6, unit="us/sample", target=10)


def test_one_step_online(benchmark, ledger):
    """One step a call, as on board, against the batch."""
    prepared = problem(10_000)
    method = RecursiveLeastSquares(block=1.0)
    samples = [prepared.inputs.sample(k) for k in range(prepared.n_samples)]
    initial = method.init(prepared, MODEL, samples[0])

    def online() -> None:
        state = initial
        for sample in samples[1:]:
            state = method.step(state, sample)

    ours, other = interleaved(benchmark, online, recursion(10_000, core))

    scale = 1e6 / prepared.n_samples
    what = "recursive least squares, one step called from Python: a step of the batch"
    ledger.within(what, ours * scale, other * scale, unit="us/sample")
