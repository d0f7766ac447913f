"""The adaptive identifier on the full basis: against NumPy, and against its own C."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from statistics import median

import by_hand
import numpy as np
import pytest
from interleaving import interleaved
from workload import FULL, VEHICLE, problem

import hydrodamp as hd
from hydrodamp.kernels import core

HERE = Path(__file__).parent
SOURCES = HERE.parent / "src" / "hydrodamp" / "kernels" / "csrc"
FLAGS = ["-std=c99", "-O3", "-DNDEBUG", "-fPIC", "-ffp-contract=off"]  # as in hatch_build.py
GAIN = 20.0
pytestmark = pytest.mark.usefixtures("one_core")


def batch(prepared: hd.Problem):
    """Return the identifier over the whole log as a call of no arguments."""
    bound = hd.AdaptiveIdentifier(a=GAIN, gamma=GAIN).bind(prepared, FULL)
    start = bound.table
    arguments = (bound.settings, start, prepared.inputs)
    return arguments, lambda: core.adapt(*arguments, prepared.segments)


def test_against_numpy(benchmark, ledger):
    n, few = 200_000, 3_000
    prepared = problem(n)
    columns = prepared.equations
    (_, start, inputs), ours = batch(prepared)
    table = start[columns.n_known :].T

    fast, slow = interleaved(
        benchmark, ours, lambda: by_hand.identify(VEHICLE, inputs, GAIN, GAIN, table, few)
    )

    _, briefly = batch(problem(few))
    expected = by_hand.identify(VEHICLE, problem(few).inputs, GAIN, GAIN, table, few)
    np.testing.assert_allclose(
        briefly().matrix[columns.n_known :].T, expected, rtol=1e-6, atol=1e-8
    )
    what = "adaptive identifier, 85 terms x 6 axes: NumPy, sample by sample"
    ledger.faster(what, fast / n * 1e6, slow / few * 1e6, unit="us/sample", target=250.0)


def test_against_numpy_prepared(benchmark, ledger):
    """What is left of the ratio where NumPy may evaluate all terms beforehand."""
    n, few = 200_000, 3_000
    prepared = problem(n)
    known = prepared.equations.n_known
    (_, start, inputs), ours = batch(prepared)
    xi = prepared.regressor(0, few)
    forcing = core.coriolis(VEHICLE.mass_matrix, inputs.velocity[:few]) + inputs.wrench[:few]
    forcing += xi[:, :known] @ prepared.equations.known
    middle, forcing = 0.5 * (xi[1:] + xi[:-1]), 0.5 * (forcing[1:] + forcing[:-1])
    middle = np.ascontiguousarray(middle[:, known:])
    table = start[known:].T

    fast, slow = interleaved(
        benchmark,
        ours,
        lambda: by_hand.identify_prepared(VEHICLE, inputs, GAIN, GAIN, table, middle, forcing),
    )

    what = "the same: NumPy, off-line, terms evaluated beforehand"
    ledger.faster(what, fast / n * 1e6, slow / few * 1e6, unit="us/sample")


@pytest.fixture
def program(tmp_path: Path) -> Path:
    """The C files and a main, compiled as the package compiles them."""
    compiler = next((name for name in ("cc", "gcc", "clang") if shutil.which(name)), None)
    if compiler is None:
        pytest.skip("no C compiler here")
    files = [HERE / "identifier_main.c", *sorted(SOURCES.glob("*.c"))]
    made = tmp_path / "identifier"
    command = [compiler, *FLAGS, f"-I{SOURCES}", *map(str, files), "-lm", "-o", str(made)]
    subprocess.run(command, check=True)
    return made


def test_against_its_own_c(benchmark, ledger, program, tmp_path):
    n = 200_000
    (gains, start, inputs), ours = batch(problem(n))
    plant = gains.plant
    record = (inputs.time, inputs.velocity, inputs.down, inputs.wrench, inputs.propulsion)
    with (tmp_path / "problem").open("wb") as file:
        np.array([n, plant.n_terms], dtype=np.int64).tofile(file)
        plant.factors.tofile(file)
        for array in (plant.mass_matrix.T, gains.a, gains.gamma, start, *record):
            np.ascontiguousarray(array).tofile(file)
    seconds: list[float] = []
    told: list[str] = []

    def from_c() -> None:
        command = [program, tmp_path / "problem"]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        time, *told[:] = done.stdout.split()
        seconds.append(float(time))

    fast, _ = interleaved(benchmark, ours, from_c, rounds=9)

    np.testing.assert_array_equal([float(word) for word in told], ours().error)
    what = "adaptive identifier, called from Python: its C called from C"
    ledger.within(what, fast / n * 1e6, median(seconds) / n * 1e6, unit="us/sample", target=1.3)


def test_one_step_online(benchmark, ledger):
    """One step a call, as on board, against the batch."""
    prepared = problem(20_000)
    identifier = hd.AdaptiveIdentifier(a=GAIN, gamma=GAIN)
    samples = [prepared.inputs.sample(k) for k in range(prepared.n_samples)]
    initial = identifier.init(prepared, FULL, samples[0])
    _, whole = batch(prepared)

    def online() -> None:
        state = initial
        for sample in samples[1:]:
            state = identifier.step(state, sample)

    ours, other = interleaved(benchmark, online, whole)

    scale = 1e6 / prepared.n_samples
    ledger.within("one step called from Python: a step of the batch", ours * scale, other * scale,
                  unit="us/sample")  # fmt: skip
