"""Exported forms of equation 1: what an evaluation takes, against the core's own in a replay."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from interleaving import on_all_cores

import hydrodamp as hd
from hydrodamp.export.c99 import SOURCES, STATES, STRICT, open_fmu
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.scripts import execute_module
from hydrodamp.export.target import NotRun, Target

VEHICLE, DAMPING = hd.fleet["vt690"], hd.published["vt690-sname2022"]
STEPS = 100_000
"""Runge-Kutta steps of 0.05 s, four evaluations each, of what steps by itself."""

MAIN = """
#include "auv_vt690.h"
int main(void)
{
    hd_real state[13] = {2, 0, 0, 0, 0, 0, 0, 0, 0, 1}, none[6] = {0};
    const hd_real inputs[3] = {(hd_real)0.1, 0, 2000};
    for (int k = 0; k < %d; ++k)
        auv_vt690_step(state, inputs, none, (hd_real)0.05);
    return !(state[0] < 10);
}
"""

Form = tuple[Callable[[], object], int]
"""A call, and how often it evaluates equation 1."""


def states(n: int) -> States:
    random = np.random.default_rng(0)
    scale = [2.0, 0.2, 0.2, 0.1, 0.1, 0.2], [0.3, 0.3, 2000.0]
    down = np.tile([0.0, 0.0, 1.0], (n, 1))
    velocity, inputs = (random.normal(size=(n, len(each))) * each for each in scale)
    return States(velocity, down, inputs, np.zeros((n, 6)))


def written(target: Target, folder: Path) -> Path:
    hd.export(DAMPING, VEHICLE, target, folder)
    return folder


def in_c(folder: Path, precision: str) -> Form:
    where = written(replace(hd.find_target("c"), precision=precision), folder / "c")
    (where / "loop.c").write_text(MAIN % STEPS)
    flags = ["-O3", "-DHD_FLOAT"] if precision == "float" else ["-O3"]
    compiler = next(name for name in ("cc", "gcc", "clang") if shutil.which(name))
    call = [compiler, *STRICT, *flags, "loop.c", *SOURCES, "-lm", "-o", "loop"]
    subprocess.run(call, cwd=where, check=True)
    return lambda: subprocess.run([where / "loop"], check=True), 4 * STEPS


def in_unit(folder: Path, held: ExitStack) -> Form:
    path = written(hd.find_target("fmu"), folder / "fmu") / "auv_vt690.fmu"
    unit = held.enter_context(open_fmu(path))
    unit.setReal([STATES], [2.0])
    unit.exitInitializationMode()
    return lambda: unit.doStep(0.0, 0.05 * STEPS), 4 * STEPS


def in_python(folder: Path, many: bool) -> Form:
    module = execute_module(written(hd.find_target("python"), folder / "python") / "auv_vt690.py")
    given = states(100_000 if many else 1000)
    if many:
        columns = [part.T for part in given]
        return lambda: module.acceleration(*columns), 100_000
    return lambda: [module.acceleration(*each) for each in zip(*given, strict=True)], 1000


def in_casadi(folder: Path, many: bool) -> Form:
    pytest.importorskip("casadi")
    module = execute_module(written(hd.find_target("casadi"), folder / "casadi") / "auv_vt690.py")
    given = states(50_000 if many else 1000)
    if many:
        function, columns = module.acceleration.map(50_000), [part.T for part in given]
        return lambda: function(*columns), 50_000
    return lambda: [module.acceleration(*each) for each in zip(*given, strict=True)], 1000


def in_octave(folder: Path, held: ExitStack) -> Form:
    plant, target = ExportedPlant.of(VEHICLE, DAMPING), hd.find_target("octave")
    engine = held.enter_context(target.open_engine(written(target, folder / "octave"), plant))
    return lambda: engine.accelerations(states(10_000)), 10_000


FORMS = {
    "C, double": lambda folder, held: in_c(folder, "double"),
    "C, float": lambda folder, held: in_c(folder, "float"),
    "FMU, co-simulation": in_unit,
    "Python, many at once": lambda folder, held: in_python(folder, True),
    "Python, one by one": lambda folder, held: in_python(folder, False),
    "CasADi, many at once": lambda folder, held: in_casadi(folder, True),
    "CasADi, one by one": lambda folder, held: in_casadi(folder, False),
    "Octave, one by one through a pipe": in_octave,
}


@pytest.fixture
def held():
    with ExitStack() as stack:
        yield stack


@pytest.mark.parametrize("name", FORMS)
def test_a_form_against_the_core(benchmark, ledger, tmp_path, held, name):
    try:
        form, evaluations = FORMS[name](tmp_path, held)
    except (NotRun, ImportError, StopIteration) as reason:
        pytest.skip(str(reason))
    n = STEPS // 2 + 1
    at = states(n)
    log = hd.Log(
        np.arange(n) * 0.1,
        np.tile([2.0, 0.0, 0.0, 0.0, 0.0, 0.0], (n, 1)),
        attitude=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)),
        commands=np.tile([0.1, 0.0, 2000.0], (len(at.velocity), 1)),
        command_names=VEHICLE.commands,
    )
    ours, core = on_all_cores(
        benchmark,
        form,
        lambda: hd.simulate(VEHICLE, DAMPING, log, attitude="simulated"),
        rounds=5,
    )
    each = ours.best / evaluations * 1e6, core.best / (4 * STEPS) * 1e6
    ledger.within(f"equation 1 exported, {name}: the core", *each, unit="us/evaluation")
