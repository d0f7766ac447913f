"""The headline ratios at reduced size, each against a third of its target, in a minute at most.

A ratio that falls below that has lost more than noise takes. ``python benchmarks/smoke.py``
prints a line a ratio, and exits with 1 where one is missed.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

for _pool in ("OPENBLAS", "OMP", "MKL", "VECLIB_MAXIMUM"):
    os.environ[f"{_pool}_NUM_THREADS"] = "1"  # read once, when NumPy is first imported
sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

import bench_least_squares  # noqa: E402
import bench_recursive  # noqa: E402
import by_hand  # noqa: E402
from scipy.integrate import solve_ivp  # noqa: E402
from workload import FULL, PAPER, VEHICLE, log, problem, truth  # noqa: E402

import hydrodamp as hd  # noqa: E402
import oracle  # noqa: E402
from hydrodamp.kernels import core  # noqa: E402
from hydrodamp.simulation.replay import replay  # noqa: E402

Call = Callable[[], object]


def ratio(ours: Call, other: Call, share: float = 1.0, rounds: int = 3) -> float:
    """Return how often ours goes into the other's CPU time, both in turn; ``share`` of its work.

    The least of each: what else the machine does only adds.
    """
    times: tuple[list[float], list[float]] = ([], [])
    ours()
    for _ in range(rounds):
        for call, taken in zip((ours, other), times, strict=True):
            start = time.process_time()
            call()
            taken.append(time.process_time() - start)
    return min(times[1]) / min(times[0]) / share


def adaptive_identifier() -> float:
    """The full basis over a record, against NumPy sample by sample."""
    n, few = 40_000, 400
    prepared = problem(n)
    bound = hd.AdaptiveIdentifier(a=20.0, gamma=20.0).bind(prepared, FULL)
    start, inputs = bound.table, prepared.inputs
    table = start[prepared.equations.n_known :].T
    return ratio(
        lambda: core.adapt(bound.settings, start, inputs, prepared.segments),
        lambda: by_hand.identify(VEHICLE, inputs, 20.0, 20.0, table, few),
        few / n,
    )


def recursive_least_squares() -> float:
    """216 coefficients over a record, against the NumPy loop."""
    n, few = 10_000, 500
    return ratio(
        bench_recursive.recursion(n, core), bench_recursive.recursion(few, oracle), few / n
    )


def open_loop_replay() -> float:
    """85 terms at 10 Hz, against solve_ivp in steps of a sample with NumPy's right-hand side."""
    n, few, damping = 20_000, 500, truth()
    long, short = (hd.prepare(VEHICLE, log(size), FULL) for size in (n, few))
    table = short.matrix(damping)[short.equations.n_known :].T
    rate, inputs = by_hand.right_hand_side(VEHICLE, short.inputs, table), short.inputs
    span = inputs.time[0], inputs.time[-1]
    return ratio(
        lambda: replay(long, damping),
        lambda: solve_ivp(rate, span, inputs.velocity[0], t_eval=inputs.time, max_step=0.1),
        few / n,
    )


def least_squares() -> float:
    """Eight models with their intervals, against the literal Kronecker form."""
    n, few, method = 100_000, 10_000, bench_least_squares.METHOD
    long, short = problem(n, PAPER), problem(few, PAPER)
    return ratio(
        lambda: method.identify_all(long, PAPER),
        lambda: [bench_least_squares.literal(short, model) for model in PAPER],
        few / n,
        rounds=1,
    )


def online_step(method: hd.AdaptiveIdentifier | hd.RecursiveLeastSquares, model) -> float:
    """One step a call from Python, in calls of a Python function that does nothing."""
    prepared = hd.prepare(VEHICLE, log(4_000), model)
    samples = [prepared.inputs.sample(k) for k in range(prepared.n_samples)]
    first = method.init(prepared, model, samples[0])

    def online() -> None:
        state = first
        for sample in samples[1:]:
            state = method.step(state, sample)

    def nothing(state: object, sample: object) -> object:
        return state

    def idle() -> None:
        for _ in range(100):
            for sample in samples[1:]:
                nothing(None, sample)

    return 100.0 / ratio(online, idle, rounds=15)


LEAST = {
    "least squares, eight models: literal Kronecker form": (least_squares, 100.0),
    "adaptive identifier: NumPy, sample by sample": (adaptive_identifier, 250.0),
    "recursive least squares, 216 coefficients: NumPy loop": (recursive_least_squares, 10.0),
    "replay: solve_ivp, steps of a sample": (open_loop_replay, 300.0),
}
"""How many times faster at least."""

MOST = {
    "online step, adaptive identifier: an empty call": (
        lambda: online_step(hd.AdaptiveIdentifier(), FULL),
        75.0,
    ),
    "online step, recursive least squares: an empty call": (
        # Few coefficients: the call decides; the C core with 216 has its row above.
        lambda: online_step(hd.RecursiveLeastSquares(block=1.0), hd.catalog["prestero"]),
        100.0,
    ),
}
"""How many times as long at most: 3 and 4 us, where an empty call takes 0.04 us."""


def main() -> int:
    """Print every ratio; 1 where one is missed by more than a factor of three."""
    missed = 0
    for what, (measure, target) in LEAST.items():
        found = measure()
        missed += found < target / 3.0
        print(f"{what:60s} {found:8.1f}  target >= {target:g}, here >= {target / 3.0:.1f}")
    for what, (measure, target) in MOST.items():
        found = measure()
        missed += found > 3.0 * target
        print(f"{what:60s} {found:8.1f}  target <= {target:g}, here <= {3.0 * target:g}")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
