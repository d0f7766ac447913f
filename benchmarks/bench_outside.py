"""Other tools where they can do the same job, checked to give the same answer."""

from __future__ import annotations

import marine_loop
import numpy as np
import pytest
from interleaving import interleaved
from workload import FULL, VEHICLE, log, truth

import hydrodamp as hd
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.kernels.core import coriolis
from hydrodamp.simulation.replay import replay

pytestmark = pytest.mark.usefixtures("one_core")


def library(names: list[str]):
    """Return the terms as functions of u v w p q r and eta, as PySINDy takes them."""
    from pysindy import CustomLibrary

    return CustomLibrary(
        library_functions=[_function(name) for name in names],
        function_names=[lambda *_, name=name: name for name in names],
    )


def _function(name: str):
    """Return one term by hand: products of velocities, absolute values and (eta-1)."""
    term = hd.Term.parse(name)
    values = {
        **{axis: lambda x, k=k: x[k] for k, axis in enumerate(VELOCITIES)},
        **{f"|{axis}|": lambda x, k=k: np.abs(x[k]) for k, axis in enumerate(VELOCITIES)},
        "V": lambda x: np.hypot(x[1], x[2]),
        "V_v": lambda x: np.sign(x[1]) * np.hypot(x[1], x[2]),
        "V_w": lambda x: np.sign(x[2]) * np.hypot(x[1], x[2]),
        "(eta-1)": lambda x: x[6] - 1.0,
    }
    factors = [values[factor] for factor in term.factors]

    def value(u, v, w, p, q, r, eta):
        x = (u, v, w, p, q, r, eta)
        product = factors[0](x)
        for factor in factors[1:]:
            product = product * factor(x)
        return product

    return value


def test_pysindy(benchmark, ledger):
    """All 85 terms on six axes from velocities alone, both by finite differences."""
    pysindy = pytest.importorskip("pysindy", reason="PySINDy is not installed")
    record = log(50_000)
    prepared = hd.prepare(VEHICLE, record, FULL)
    method = hd.LeastSquares(hd.FiniteDifference())
    mass, ratio = VEHICLE.mass_matrix, record.propulsion_ratio[:, None]
    names = [str(term) for term in prepared.equations.basis]
    found: list[np.ndarray] = []

    def by_pysindy() -> None:
        slopes = pysindy.FiniteDifference()(record.velocity, record.time)
        known = coriolis(mass, record.velocity) + record.wrench
        known += VEHICLE.restoring_wrench(record.down)
        model = pysindy.SINDy(
            optimizer=pysindy.STLSQ(threshold=0.0, alpha=0.0), feature_library=library(names)
        )
        damped = slopes - np.linalg.solve(mass, known.T).T
        model.fit(record.velocity, t=record.time, x_dot=damped, u=ratio)
        found[:] = [mass @ model.coefficients()]

    fast, slow = interleaved(
        benchmark, lambda: method.identify(prepared, FULL), by_pysindy, rounds=3
    )

    ours = method.identify(prepared, FULL).damping.matrix
    np.testing.assert_allclose(found[0], ours, atol=1e-3 * np.abs(ours).max())
    ledger.faster("least squares, 85 terms x 6 axes, 5e4 samples: PySINDy", fast, slow)


def test_marine_simulator_loop(benchmark, ledger):
    """Fossen's 12 coefficients, attitude integrated, 50 Hz: Euler in Python, RK4 in ours."""
    model, step, few = hd.catalog["fossen"], 0.02, 3_000
    damping = truth(model)
    long, short = (
        hd.prepare(VEHICLE, log(n, step=step, damping="fossen"), model) for n in (100_000, few)
    )

    def by_loop() -> np.ndarray:
        return marine_loop.simulate(VEHICLE, damping, short.log)

    fast, slow = interleaved(benchmark, lambda: replay(long, damping, "simulated"), by_loop)

    ours = replay(short, damping, "simulated").velocity
    assert np.abs(by_loop() - ours)[: few // 6].max() < 0.1
    per_sample = 1e6 / long.n_samples, 1e6 / few
    what = "replay, 12 terms, attitude integrated: Euler loop of a marine simulator"
    ledger.faster(what, fast * per_sample[0], slow * per_sample[1], unit="us/sample")
