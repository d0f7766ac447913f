"""The C library: the core's bits in double, near it in float, on small processors too."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.export.c99 import SOURCES, STRICT, C
from hydrodamp.export.plant import ExportedPlant
from microcontroller import TOOLS, run_on_cortex

from .conftest import (
    COMPILER,
    PAPER,
    RICH,
    WIDE,
    core,
    level_log,
    needs_compiler,
    read_back,
    states,
    write_export,
)

pytestmark = needs_compiler

DOUBLE = C()


def test_float_is_near(tmp_path):
    at = states(WIDE)
    found, wanted = read_back(C(precision="float"), WIDE, at, tmp_path), core(WIDE, at)
    assert np.abs(found - wanted).max() < 1e-5 * np.abs(wanted).max()
    assert np.abs(found - wanted).max() > 0.0


@pytest.fixture(scope="module")
def rich(tmp_path_factory):
    """A folder with the library of a vehicle, and a program that sails five seconds."""
    damping = hd.Damping(hd.catalog["fossen"], -np.linspace(2.0, 30.0, 12))
    folder = write_export(DOUBLE, ExportedPlant.of(RICH, damping), tmp_path_factory.mktemp("rich"))
    shutil.copy(Path(__file__).with_name("sail.c"), folder)
    return folder, damping


def run(folder, compiler, *flags):
    call = [compiler, *STRICT, *flags, "sail.c", *SOURCES, "-lm", "-o", f"sail{compiler}"]
    subprocess.run(call, cwd=folder, check=True)
    return subprocess.run([folder / call[-1]], capture_output=True, text=True, check=True).stdout


def test_its_step_is_that_of_a_replay(rich):
    folder, damping = rich
    state = np.frombuffer(bytes.fromhex(run(folder, COMPILER)))
    n = 101
    log = level_log(
        np.arange(n) * 0.05,
        np.tile([1.5, 0.0, 0.1, 0.0, 0.0, 0.0], (n, 1)),
        commands=np.tile([0.1, 1500.0, 0.4, 2.0], (n, 1)),
        command_names=ExportedPlant.of(RICH, damping).inputs,
    )
    wanted = hd.simulate(RICH, damping, log, attitude="simulated").velocity[-1]
    np.testing.assert_allclose(state[:6], wanted, rtol=1e-12)


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("flags", [(), ("-DHD_FLOAT",)], ids=["double", "float"])
def test_compilers_agree_to_the_last_bit(rich, compiler, flags):
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} is not installed")
    assert run(rich[0], compiler, *flags) == run(rich[0], "cc", *flags)


def test_cmake_builds_the_example(rich, tmp_path):
    if not shutil.which("cmake"):
        pytest.skip("cmake is not installed")
    for call in (["cmake", "-S", rich[0], "-B", tmp_path], ["cmake", "--build", tmp_path]):
        subprocess.run(call, capture_output=True, check=True)
    process = subprocess.run([tmp_path / "simulate"], capture_output=True, text=True, check=True)
    assert len(process.stdout.splitlines()) == 13


def test_all_c_files_of_the_folder_are_the_library(tmp_path):
    """As Arduino, STM32Cube and Keil compile them; the README's command adds one example."""
    folder = write_export(DOUBLE, PAPER, tmp_path)
    assert {path.name for path in (folder / "examples").iterdir()} == {"simulate.c", "estimate.c"}
    assert not any("int main" in path.read_text() for path in folder.glob("*.c"))
    readme = (folder / "README.md").read_text()
    command = next(line for line in readme.splitlines() if line.startswith("    cc "))
    subprocess.run(command, cwd=folder, shell=True, check=True)
    process = subprocess.run(["./a.out"], cwd=folder, capture_output=True, text=True, check=True)
    assert [line.split()[0] for line in process.stdout.splitlines()][:3] == ["u", "v", "w"]


@pytest.mark.parametrize("flags", [(), ("-DHD_FLOAT",)], ids=["double", "float"])
def test_a_cortex_m7_gives_the_same_bits(rich, tmp_path, flags):
    if missing := [name for name in TOOLS if not shutil.which(name)]:
        pytest.skip(f"{', '.join(missing)} not installed")
    folder = shutil.copytree(rich[0], tmp_path / "rich")
    assert run_on_cortex(folder, "sail.c", flags) == run(rich[0], "cc", *flags)


def test_the_precision_is_one_of_two(refused):
    refused(MethodError, C, precision="half")
