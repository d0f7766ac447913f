"""Python, CasADi and Octave: files with equation 1 in the syntax of a language."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from subprocess import PIPE, Popen
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import demand
from hydrodamp.export.codegen import CASADI, template_values, vehicle_identifier
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.target import (
    Files,
    NotRun,
    RunError,
    Target,
    program_version,
    render_template,
    require_package,
)
from hydrodamp.export.verification import Engine, attitude_quaternions
from hydrodamp.files import load_text


@dataclass(frozen=True)
class Python(Target):
    """One Python file that needs NumPy only, with the interfaces of two simulators.

    Functions of the wrench and the acceleration, a vehicle class of the Python Vehicle Simulator,
    and HoloOcean's six accelerations.
    """

    key: ClassVar[str] = "python"
    description: ClassVar[str] = "Python with NumPy, PythonVehicleSimulator and HoloOcean 2"

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the file."""
        return {
            f"{vehicle_identifier(plant)}.py": render_template(
                "python.py.j2", **template_values(plant)
            )
        }

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Run the file and yield its accelerations."""
        yield _module(folder, plant, f"NumPy {np.__version__}")


@dataclass(frozen=True)
class CasADi(Target):
    """A Python module of CasADi functions of wrench, acceleration, state derivative and step.

    Parameters
    ----------
    smooth : float
        Width over which |x|, sign(x) and speeds are smoothed, so that they are differentiable at
        rest [m/s, rad/s or the unit of a command]; 0 disables smoothing.
    """

    key: ClassVar[str] = "casadi"
    description: ClassVar[str] = "CasADi 3.6 or newer"
    smooth: float = 0.0

    def __post_init__(self) -> None:
        """Check the width."""
        valid = 0.0 <= self.smooth < np.inf
        demand(valid, "smooth", "zero or positive", f"{self.smooth:g}.")

    @property
    def omitted_effects(self) -> str:
        """The smoothed non-differentiable points."""
        return f"corners of |x|, smoothed over {self.smooth:g}" if self.smooth else ""

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the module, and an example of predictive control."""
        values, name = template_values(plant, CASADI), vehicle_identifier(plant)
        return {
            f"{name}.py": render_template("casadi.py.j2", **values, smooth=self.smooth),
            "mpc.py": render_template("mpc.py.j2", name=name, free=plant.vehicle.free.astype(int)),
        }

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Run the module and yield its accelerations."""
        require_package("casadi")
        yield _module(folder, plant, f"CasADi {version('casadi')}")


def execute_module(path: Path) -> ModuleType:
    """Return a Python file as a module."""
    module = ModuleType(path.stem)
    exec(compile(load_text(path), str(path), "exec"), module.__dict__)
    return module


def _module(folder: Path, plant: ExportedPlant, name: str) -> Engine:
    module: Any = execute_module(folder / f"{vehicle_identifier(plant)}.py")

    def accelerations(at: States) -> FloatArray:
        return np.asarray(module.acceleration(*(values.T for values in at))).T

    return Engine(name, accelerations)


@dataclass(frozen=True)
class Octave(Target):
    """Two functions for GNU Octave and MATLAB, as the Marine Systems Simulator has them."""

    key: ClassVar[str] = "octave"
    description: ClassVar[str] = "GNU Octave, MATLAB and the Marine Systems Simulator"

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the functions of the state derivative and of the wrench."""
        values, name = template_values(plant), vehicle_identifier(plant)
        return {
            f"{name}.m": render_template("octave.m.j2", **values),
            f"{name}_tau.m": render_template("octave_tau.m.j2", **values),
        }

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Run the files in Octave and yield its accelerations."""
        program = next(filter(shutil.which, ("octave-cli", "octave")), None)
        if program is None:
            raise NotRun("GNU Octave is not installed")
        with tempfile.TemporaryDirectory() as scratch:
            script = Path(scratch, "answer.m")
            names = {"name": vehicle_identifier(plant), "inputs": plant.inputs}
            script.write_text(render_template("answer.m.j2", **names), encoding="utf-8")
            call = [program, "--no-init-file", "--quiet", "--path", str(folder), str(script)]
            with Popen(call, stdin=PIPE, stdout=PIPE, stderr=PIPE) as octave:
                yield Engine(program_version(program), lambda at: _query_octave(octave, at))


def _query_octave(octave: Any, at: States) -> FloatArray:
    """Send states to Octave one by one and return its accelerations."""
    origin, result = np.zeros((len(at.velocity), 3)), []
    for row in np.column_stack(
        [at.velocity, origin, attitude_quaternions(at.down), at.wrench, at.inputs]
    ):
        octave.stdin.write(row.tobytes())
        octave.stdin.flush()
        result.append(octave.stdout.read(48))
        if not result[-1]:
            raise RunError(f"Octave reports: {octave.stderr.read().decode().strip()}")
    return np.frombuffer(b"".join(result)).reshape(-1, 6)
