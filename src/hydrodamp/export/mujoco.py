"""MuJoCo: a body in MJCF, and a passive-force callback with the wrenches of equation 1."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import demand
from hydrodamp.export.codegen import template_values, vehicle_identifier
from hydrodamp.export.plant import FLU, Body, ExportedPlant
from hydrodamp.export.scripts import execute_module
from hydrodamp.export.target import Files, Target, render_template, require_package
from hydrodamp.export.verification import Engine, Simulator

BOX_DENSITY = 1000.0  # kg/m^3; determines the size of the drawn box only


@dataclass(frozen=True)
class MuJoCo(Target):
    """A body in MJCF and a Python file with the passive force of all terms and inputs.

    Parameters
    ----------
    step : float
        Time step of the model and of the replay [s].
    """

    key: ClassVar[str] = "mujoco"
    description: ClassVar[str] = "MuJoCo 3.3 or newer"
    step: float = 0.01

    def __post_init__(self) -> None:
        """Check the step."""
        demand(0.0 < self.step < np.inf, "step", "positive", f"{self.step:g}.")

    @property
    def omitted_effects(self) -> str:
        """Forces that act on the rigid-body mass only."""
        return "added mass in contacts, constraints and MuJoCo's own actuators"

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the model, and the file with the passive force."""
        body, name = Body.of(plant, self.key, BOX_DENSITY).mirrored, vehicle_identifier(plant)
        values = template_values(plant)
        xml = render_template("mujoco.xml.j2", **values, body=body, step=self.step)
        return {f"{name}.xml": xml, f"{name}.py": render_template("mujoco.py.j2", **values)}

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Yield MuJoCo with the model; meanwhile all models of the process have the force."""
        require_package("mujoco")
        import mujoco

        try:
            yield _Body(folder, vehicle_identifier(plant), self.step)
        finally:
            mujoco.set_mjcb_passive(None)


class _Body(Simulator):
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
        """Set the inputs of the callback."""
        for array, values in zip(self._callback_inputs, (inputs, wrench), strict=True):
            array[:] = values

    def _in_body(self, values: FloatArray) -> FloatArray:
        """Convert translation in the world and rotation in the body to hydrodamp's body frame."""
        return np.asarray(FLU * np.concatenate([self._rotation.T @ values[:3], values[3:]]))

    @property
    def _rotation(self) -> FloatArray:
        return np.asarray(self._data.xmat[1].reshape(3, 3))
