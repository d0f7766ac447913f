"""Python, CasADi and Octave: files that print equation 1 in the words of a language."""

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
from hydrodamp.export.codegen import CASADI, name_of, said_of
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.target import Files, NotRun, RunError, Target, rendered, require, version_of
from hydrodamp.export.verification import Engine, upright
from hydrodamp.files import load_text


@dataclass(frozen=True)
class Python(Target):
    """One Python file that needs NumPy alone, with the forms of two simulators.

    Functions of the wrench and the acceleration, a vehicle class of the Python Vehicle Simulator,
    and HoloOcean's six accelerations.
    """

    key: ClassVar[str] = "python"
    description: ClassVar[str] = "Python with NumPy, PythonVehicleSimulator and HoloOcean 2"

    def write(self, craft: ExportedPlant) -> Files:
        """Return the file."""
        return {f"{name_of(craft)}.py": rendered("python.py.j2", **said_of(craft))}

    @contextmanager
    def read(self, folder: Path, craft: ExportedPlant) -> Iterator[Engine]:
        """Run the file, and hold its accelerations."""
        yield _module(folder, craft, f"NumPy {np.__version__}")


@dataclass(frozen=True)
class CasADi(Target):
    """A Python module of CasADi functions of wrench, acceleration, state derivative and step.

    Parameters
    ----------
    smooth : float
        Where |x|, sign(x) and speeds are rounded off, so that they have derivatives at rest
        [m/s, rad/s or the unit of a command]; 0 leaves them as they are.
    """

    key: ClassVar[str] = "casadi"
    description: ClassVar[str] = "CasADi 3.6 or newer"
    smooth: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what rounds nothing off."""
        good = 0.0 <= self.smooth < np.inf
        demand(good, "smooth", "zero or positive", f"{self.smooth:g}.")

    @property
    def ignores(self) -> str:
        """The corners that are rounded off."""
        return f"corners of |x|, rounded off over {self.smooth:g}" if self.smooth else ""

    def write(self, craft: ExportedPlant) -> Files:
        """Return the module, and an example of predictive control."""
        said, name = said_of(craft, CASADI), name_of(craft)
        return {
            f"{name}.py": rendered("casadi.py.j2", **said, smooth=self.smooth),
            "mpc.py": rendered("mpc.py.j2", name=name, free=craft.vehicle.free.astype(int)),
        }

    @contextmanager
    def read(self, folder: Path, craft: ExportedPlant) -> Iterator[Engine]:
        """Run the module, and hold its accelerations."""
        require("casadi")
        yield _module(folder, craft, f"CasADi {version('casadi')}")


def executed(path: Path) -> ModuleType:
    """Return a written Python file as a module."""
    module = ModuleType(path.stem)
    exec(compile(load_text(path), str(path), "exec"), module.__dict__)
    return module


def _module(folder: Path, craft: ExportedPlant, name: str) -> Engine:
    module: Any = executed(folder / f"{name_of(craft)}.py")

    def rates(at: States) -> FloatArray:
        return np.asarray(module.acceleration(*(part.T for part in at))).T

    return Engine(name, rates)


@dataclass(frozen=True)
class Octave(Target):
    """Two functions for GNU Octave and MATLAB, in the form of the Marine Systems Simulator."""

    key: ClassVar[str] = "octave"
    description: ClassVar[str] = "GNU Octave, MATLAB and the Marine Systems Simulator"

    def write(self, craft: ExportedPlant) -> Files:
        """Return the function of the state's rate, and that of the wrench."""
        said, name = said_of(craft), name_of(craft)
        return {
            f"{name}.m": rendered("octave.m.j2", **said),
            f"{name}_tau.m": rendered("octave_tau.m.j2", **said),
        }

    @contextmanager
    def read(self, folder: Path, craft: ExportedPlant) -> Iterator[Engine]:
        """Run the files in Octave, which answers each state with its rate."""
        program = next(filter(shutil.which, ("octave-cli", "octave")), None)
        if program is None:
            raise NotRun("GNU Octave is not installed")
        with tempfile.TemporaryDirectory() as place:
            script = Path(place, "answer.m")
            words = {"name": name_of(craft), "inputs": craft.inputs}
            script.write_text(rendered("answer.m.j2", **words), encoding="utf-8")
            call = [program, "--no-init-file", "--quiet", "--path", str(folder), str(script)]
            with Popen(call, stdin=PIPE, stdout=PIPE, stderr=PIPE) as octave:
                yield Engine(version_of(program), lambda at: _answers(octave, at))


def _answers(octave: Any, at: States) -> FloatArray:
    """Send states to Octave, one after the other, and return the accelerations it answers."""
    still, found = np.zeros((len(at.velocity), 3)), []
    for row in np.column_stack([at.velocity, still, upright(at.down), at.wrench, at.inputs]):
        octave.stdin.write(row.tobytes())
        octave.stdin.flush()
        found.append(octave.stdout.read(48))
        if not found[-1]:
            raise RunError(f"Octave refused it: {octave.stderr.read().decode().strip()}")
    return np.frombuffer(b"".join(found)).reshape(-1, 6)
