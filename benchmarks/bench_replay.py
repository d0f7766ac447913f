"""Open-loop replay: against scipy.integrate.solve_ivp, and by attitude."""

from __future__ import annotations

import by_hand
import numpy as np
import pytest
from interleaving import interleaved
from scipy.integrate import solve_ivp
from workload import FULL, VEHICLE, log, truth

import hydrodamp as hd
from hydrodamp.simulation.replay import replay

pytestmark = pytest.mark.usefixtures("one_core")


OPTIONS = {
    "default steps": {},
    "steps up to a sample": {"max_step": 0.1},
    "equal accuracy": {"rtol": 1e-6, "atol": 1e-8},
}
"""Left to itself RK45 steps over samples of the input and errs by centimetres a second: there the
ratio has no target, which asks for errors of one size."""


@pytest.mark.parametrize("how", OPTIONS)
def test_against_solve_ivp(benchmark, ledger, how):
    """The same plant of 85 terms at 10 Hz, wrench and attitude interpolated."""
    few = 500
    damping = truth()
    long, short = (hd.prepare(VEHICLE, log(n), FULL) for n in (100_000, few))
    inputs = short.inputs
    table = short.matrix(damping)[short.equations.n_known :].T
    rate = by_hand.right_hand_side(VEHICLE, inputs, table)
    span = (inputs.time[0], inputs.time[-1])

    def by_scipy() -> np.ndarray:
        found = solve_ivp(rate, span, inputs.velocity[0], t_eval=inputs.time, **OPTIONS[how])
        return found.y.T

    fast, slow = interleaved(benchmark, lambda: replay(long, damping), by_scipy)

    exact = replay(short, damping, max_step=0.002).velocity
    off = [np.abs(v - exact).max() for v in (replay(short, damping).velocity, by_scipy())]
    what = f"replay: solve_ivp, {how} (errors {off[0]:.0e}, {off[1]:.0e})"
    per_sample = fast / long.n_samples * 1e6, slow / few * 1e6
    target = 300.0 if off[1] < 10.0 * off[0] else None
    ledger.faster(what, *per_sample, unit="us/sample", target=target)


def test_simulated_attitude(benchmark, ledger):
    """What integrating the attitude as well costs."""
    damping = truth()
    prepared = hd.prepare(VEHICLE, log(50_000), FULL)
    both, one = interleaved(
        benchmark,
        lambda: replay(prepared, damping, "simulated"),
        lambda: replay(prepared, damping, "measured"),
    )
    scale = 1e6 / prepared.n_samples
    ledger.within("replay, attitude simulated: measured", both * scale, one * scale,
                  unit="us/sample")  # fmt: skip
