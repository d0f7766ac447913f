"""The identifiers in C: the bits of a live run in double, near them in float, and nothing leaks."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
import hydrodamp.kernels
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.export.c99 import IDENTIFIER_SOURCES, SOURCES, STRICT, C
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.live.estimator import METHODS
from hydrodamp.live.readers import LineParser
from hydrodamp.live.runner import LiveRun
from microcontroller import TOOLS, run_on_cortex, write_program

from .conftest import coefficients, write_export

COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
pytestmark = pytest.mark.skipif(not COMPILERS, reason="neither gcc nor clang is installed")
MODEL = hd.catalog["prestero"]
FLOAT = ("-DHD_FLOAT",)
CLEAN = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def in_text(log, folder):
    hd.write_log(log, folder / "dive.csv")
    return (folder / "dive.csv").read_text()


def damage_log(text):
    """An empty cell, a row that is there twice, one that is older, and a second and a half less."""
    head, *lines = text.splitlines()
    first, _, rest = lines[40].split(",", 2)
    lines[40] = f"{first},,{rest}"
    lines[60:60] = [lines[59], lines[50]]
    return "\n".join([head, *lines[:80], *lines[95:]])


def library(vehicle, model, folder):
    return write_export(C(), ExportedPlant.of(vehicle, coefficients(model)), folder)


@pytest.fixture(scope="module")
def compile_program(tmp_path_factory):
    """What compiles a program beside an exported library, and its own files once."""
    csrc, made = Path(hydrodamp.kernels.__file__).parent / "csrc", {}

    def compile_one(folder, program, *flags, compiler=None):
        call = [compiler or COMPILERS[0], *STRICT, *flags]
        if tuple(call) not in made:
            place = made[tuple(call)] = tmp_path_factory.mktemp("objects")
            sources = [csrc / name for name in (*SOURCES, *IDENTIFIER_SOURCES)]
            subprocess.run([*call, "-c", *sources], cwd=place, check=True)
        objects = sorted(made[tuple(call)].glob("*.o"))
        subprocess.run(
            [*call, "-I.", program, *objects, "-lm", "-o", "program"], cwd=folder, check=True
        )
        return folder / "program"

    return compile_one


def run_program(program, text="", *, under=()):
    call = [*under, str(program)]
    done = subprocess.run(call, input=text, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def columns(table):
    """The numbers of a table of coefficients, a row a method."""
    rows = [line.split(",") for line in table.splitlines()]
    assert rows[0] == ["coefficient", *METHODS]
    return np.array([row[1:] for row in rows[1:]], dtype=float).T


@pytest.fixture
def estimate(compile_program):
    """What runs the example of a library on a log, and returns the numbers of its table."""

    def run(folder, text, *flags):
        return columns(run_program(compile_program(folder, "examples/estimate.c", *flags), text))

    return run


def live(text, vehicle, model):
    """What live runs of all methods tell at last of the lines of a table."""
    line, told = LineParser(), []
    rows = [row for each in text.splitlines() if (row := line(each.encode())) is not None]
    for method in METHODS:
        lines = []
        LiveRun(vehicle, model, method, lines.append, print).process_rows(rows)
        told.append([one["value"] for one in lines[-1]["coefficients"].values()])
    return np.array(told)


@pytest.fixture(scope="module")
def dive(campaign, tmp_path_factory):
    """The library of the paper's vehicle, and a log as text."""
    folder = tmp_path_factory.mktemp("dive")
    hd.export(coefficients(MODEL), campaign.vehicle, "c", folder)
    return folder, in_text(campaign.train, tmp_path_factory.mktemp("log"))


@pytest.mark.slow
@pytest.mark.parametrize("what", [str, damage_log], ids=["whole", "damaged"])
def test_estimates_have_the_bits_of_a_live_run(estimate, dive, campaign, what):
    folder, text = dive[0], what(dive[1])
    found = estimate(folder, text, *CLEAN)
    np.testing.assert_array_equal(found, live(text, campaign.vehicle, MODEL))


def test_roll_and_pitch_do_as_well(estimate, dive, campaign, tmp_path):
    folder, log = dive[0], campaign.train.between(0.0, 200.0)
    text, angles = in_text(log, tmp_path), euler_from_quaternion(log.attitude)
    head, *lines = text.splitlines()
    assert head.startswith("time,qw,qx,qy,qz,")
    turned = [
        ",".join([repr(time), *map(repr, row), line.split(",", 5)[5]])
        for time, row, line in zip(log.time.tolist(), angles.tolist(), lines, strict=True)
    ]
    text = "\n".join([head.replace("qw,qx,qy,qz", "roll,pitch,yaw"), *turned])
    found = estimate(folder, text)
    np.testing.assert_allclose(found, live(text, campaign.vehicle, MODEL), rtol=1e-6)


DRIVEN = hd.DampingModel.from_table({"X": "u u^2(eta-1)", "Y": "v r", "N": "r r|r|"}, key="driven")


@pytest.mark.parametrize("kind", ["commands", "wrench", "eta"])
def test_a_boat_too_whatever_drives_it(estimate, planar, tmp_path, kind):
    boat, _, log = planar
    random = np.random.default_rng(5)
    if kind == "wrench":
        wrench = random.normal(size=(log.n, 6)) * boat.free
        log = replace(log, wrench=wrench)
        boat = replace(boat, actuators=())
    if kind == "eta":
        log = replace(log, propulsion_ratio=random.uniform(0.8, 1.4, log.n))
    model = DRIVEN if kind == "eta" else hd.catalog["linear"].restricted_to(boat.axes)
    text = in_text(log, tmp_path)
    found = estimate(library(boat, model, tmp_path), text)
    np.testing.assert_array_equal(found, live(text, boat, model))


def test_float_is_near_after_a_hundred_hours_too(compile_program, dive):
    """A clock of 100 h has 31 ms left in float; lengths of steps lose nothing."""
    folder, text = dive
    whole = columns(run_program(compile_program(folder, "examples/estimate.c"), text))
    program = compile_program(folder, "examples/estimate.c", *FLOAT)
    near = run_program(program, text)
    off = np.abs(columns(near) - whole).max(axis=1) / np.abs(whole).max(axis=1)
    assert np.all(off < 1e-4)
    assert np.all(off > 0.0)
    head, *lines = text.splitlines()
    later = [f"{float(time) + 360_000.0},{rest}" for time, rest in (x.split(",", 1) for x in lines)]
    assert run_program(program, "\n".join([head, *later])) == near


@pytest.mark.parametrize("flags", [(), FLOAT], ids=["double", "float"])
def test_every_compiler_and_processor_gives_the_same_bits(compile_program, dive, tmp_path, flags):
    folder = shutil.copytree(dive[0], tmp_path / "dive")
    program = write_program(folder, "auv_vt690")
    first, *others = [
        run_program(compile_program(folder, program, *flags, compiler=x)).splitlines()[1::2]
        for x in COMPILERS
    ]
    assert all(other == first for other in others)
    if missing := [name for name in TOOLS if not shutil.which(name)]:
        pytest.skip(f"{', '.join(missing)} not installed")
    told = run_on_cortex(folder, program, flags).splitlines()
    assert told[1::2] == first
    _, most = re.findall(r"(\d+)\s+bytes\s+of\s+stack", (folder / "README.md").read_text())
    assert all(0 < int(line.split()[3]) < int(most) for line in told[::2])


def test_valgrind_finds_nothing(compile_program, dive):
    if not shutil.which("valgrind"):
        pytest.skip("valgrind is not installed")
    folder, text = dive
    under = ("valgrind", "-q", "--error-exitcode=9", "--leak-check=full")
    short = "\n".join(text.splitlines()[:60])
    assert run_program(compile_program(folder, "examples/estimate.c"), short, under=under)


def test_a_state_is_taken_up_where_it_was_kept_and_only_whole(compile_program, dive):
    folder, _ = dive
    shutil.copy(Path(__file__).with_name("kept.c"), folder)
    assert run_program(compile_program(folder, "kept.c", *CLEAN)) == "11001 " * 3


def test_a_log_without_a_column_is_told(compile_program, dive):
    done = subprocess.run(
        [compile_program(dive[0], "examples/estimate.c")],
        input="time,u\n",
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("column v is missing: give a log in the canonical form")


@pytest.mark.parametrize("flags", [(), FLOAT], ids=["double", "float"])
def test_no_number_makes_a_state_infinite(compile_program, dive, flags):
    """Random magnitudes up to the largest number: refused, or taken with a finite result."""
    folder, _ = dive
    shutil.copy(Path(__file__).with_name("wild.c"), folder)
    assert run_program(compile_program(folder, "wild.c", *flags)) == "1 1 0 0 " * 3
