"""Python, CasADi, Octave, MuJoCo: files with equation 1 in the syntax of a language.

MuJoCo applies it as a passive force of a body in MJCF.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Mapping
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
from hydrodamp.export.actuation import command_forces
from hydrodamp.export.codegen import CASADI, render_template, template_values, vehicle_identifier
from hydrodamp.export.plant import FLU, Body, ExportedPlant, States
from hydrodamp.export.target import (
    Files,
    NotRun,
    RunError,
    Target,
    program_version,
    require_package,
)
from hydrodamp.export.verification import Engine, Simulator, attitude_quaternions
from hydrodamp.files import load_text

DEPTH_STEP = "depth_step.py"


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
        code = render_template("python.py.j2", **template_values(plant))
        return {f"{vehicle_identifier(plant)}.py": code}

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
        Width over which ``|x|``, ``sign(x)`` and speeds are smoothed, so that they are
        differentiable at rest [m/s, rad/s or the unit of a command]; 0 disables smoothing.
    """

    key: ClassVar[str] = "casadi"
    description: ClassVar[str] = "CasADi 3.6 or newer"
    template: ClassVar[str] = "casadi.py.j2"
    examples: ClassVar[Mapping[str, str]] = {"mpc.py": "mpc.py.j2"}
    """Templates of the other files, by their names."""
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
        """Return the module, and an example of its use."""
        values, name = template_values(plant, CASADI), vehicle_identifier(plant)
        module = render_template(self.template, **values, smooth=self.smooth)
        return {f"{name}.py": module, **render_examples(plant, self.examples)}

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


def render_examples(plant: ExportedPlant, examples: Mapping[str, str], **values: object) -> Files:
    """Return the files of templates, but no depth step of a plant that keeps its depth."""
    vehicle = plant.vehicle
    values |= {"name": vehicle_identifier(plant), "free": vehicle.free.astype(int)}
    values["masses"] = np.where(vehicle.free, vehicle.mass_matrix.diagonal(), 1.0).tolist()
    return {
        path: render_template(template, **values)
        for path, template in examples.items()
        if path != DEPTH_STEP or "Z" in vehicle.axes
    }


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


BOX_DENSITY = 1000.0  # kg/m^3; determines the size of the drawn box only


@dataclass(frozen=True)
class MuJoCo(Target):
    """A body in MJCF with its actuators, and a Python file with the passive force of all terms.

    Parameters
    ----------
    step : float
        Time step of the model and of the replay [s].
    """

    key: ClassVar[str] = "mujoco"
    description: ClassVar[str] = "MuJoCo 3.3 or newer"
    completes_planar: ClassVar[bool] = True
    step: float = 0.01

    def __post_init__(self) -> None:
        """Check the step."""
        demand(0.0 < self.step < np.inf, "step", "positive", f"{self.step:g}.")

    @property
    def omitted_effects(self) -> str:
        """Forces that act on the rigid-body mass only."""
        return "added mass in contacts and constraints"

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the model, and the file with the passive force."""
        body, name = Body.of(plant, self.key, BOX_DENSITY).mirrored, vehicle_identifier(plant)
        values, forces = template_values(plant), [*command_forces(plant)]
        xml = render_template("mujoco.xml.j2", **values, body=body, step=self.step, forces=forces)
        return {f"{name}.xml": xml, f"{name}.py": render_template("mujoco.py.j2", **values)}

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Yield MuJoCo with the model; meanwhile all models of the process have the force."""
        require_package("mujoco")
        import mujoco

        try:
            yield _MuJoCoBody(folder, vehicle_identifier(plant), self.step)
        finally:
            mujoco.set_mjcb_passive(None)


class _MuJoCoBody(Simulator):
    """The body in MuJoCo, with the hydrodynamic wrench in a callback."""

    def __init__(self, folder: Path, name: str, step: float) -> None:
        import mujoco

        super().__init__(f"MuJoCo {version('mujoco')}", step)
        self._mujoco: Any = mujoco
        self._model = mujoco.MjModel.from_xml_path(str(folder / f"{name}.xml"))
        self._data = mujoco.MjData(self._model)
        self._callback_inputs = execute_module(folder / f"{name}.py").in_water(self._model)

    def set_state(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state."""
        self._data.qpos[:] = np.concatenate([np.zeros(3), [1.0, *FLU[:3]] * attitude])
        self._mujoco.mj_kinematics(self._model, self._data)
        body_velocity = FLU * velocity
        translation = self._rotation @ body_velocity[:3]
        self._data.qvel[:] = np.concatenate([translation, body_velocity[3:]])

    def compute_acceleration(self) -> FloatArray:
        """Return the acceleration."""
        self._mujoco.mj_forward(self._model, self._data)
        velocity, result = self._in_body(self._data.qvel), self._in_body(self._data.qacc)
        result[:3] -= np.cross(velocity[3:], velocity[:3])
        return result

    def take_step(self, h: float) -> FloatArray:
        """Take one step."""
        self._model.opt.timestep = h
        self._mujoco.mj_step(self._model, self._data)
        self._mujoco.mj_kinematics(self._model, self._data)
        return self._in_body(self._data.qvel)

    def apply_inputs(self, inputs: FloatArray, wrench: FloatArray) -> None:
        """Set the commands of the actuators, and the other inputs of the callback."""
        n, (other_inputs, other_wrench) = self._model.nu, self._callback_inputs
        self._data.ctrl[:], other_inputs[n:], other_wrench[:] = inputs[:n], inputs[n:], wrench

    def _in_body(self, values: FloatArray) -> FloatArray:
        """Convert translation in the world and rotation in the body to hydrodamp's body frame."""
        return np.asarray(FLU * np.concatenate([self._rotation.T @ values[:3], values[3:]]))

    @property
    def _rotation(self) -> FloatArray:
        return np.asarray(self._data.xmat[1].reshape(3, 3))
