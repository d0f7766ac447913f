"""MuJoCo: a body in MJCF, and a passive force that moves it as equation 1 does."""

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
from hydrodamp.export.codegen import name_of, said_of
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.export.rigid_body import FLU, Body
from hydrodamp.export.scripts import executed
from hydrodamp.export.target import Files, Target, rendered, require
from hydrodamp.export.verification import Engine, Simulator

_WATER = 1000.0  # kg/m^3: the size of the box alone


@dataclass(frozen=True)
class MuJoCo(Target):
    """A body in MJCF and a Python file with a passive force: all terms, inputs and added mass.

    Parameters
    ----------
    step : float
        Of the model and of the replay [s].
    """

    key: ClassVar[str] = "mujoco"
    description: ClassVar[str] = "MuJoCo 3.3 or newer"
    step: float = 0.01

    def __post_init__(self) -> None:
        """Refuse time that stands."""
        demand(0.0 < self.step < np.inf, "step", "positive", f"{self.step:g}.")

    @property
    def ignores(self) -> str:
        """What meets the rigid body alone."""
        return "added mass where contacts, constraints and MuJoCo's own actuators push"

    def write(self, craft: ExportedPlant) -> Files:
        """Return the model, and the file with the force."""
        body, name = Body.of(craft, self.key, _WATER).turned, name_of(craft)
        said = said_of(craft)
        xml = rendered("mujoco.xml.j2", **said, body=body, step=self.step)
        return {f"{name}.xml": xml, f"{name}.py": rendered("mujoco.py.j2", **said)}

    @contextmanager
    def read(self, folder: Path, craft: ExportedPlant) -> Iterator[Engine]:
        """Hold MuJoCo with the model and the force, which all its models have while it is held."""
        require("mujoco")
        import mujoco

        try:
            yield _Body(folder, name_of(craft), self.step)
        finally:
            mujoco.set_mjcb_passive(None)


class _Body(Simulator):
    """The body in MuJoCo, whose water is in a callback."""

    def __init__(self, folder: Path, name: str, step: float) -> None:
        import mujoco

        super().__init__(f"MuJoCo {version('mujoco')}", step)
        self._mujoco: Any = mujoco
        self._model = mujoco.MjModel.from_xml_path(str(folder / f"{name}.xml"))
        self._data = mujoco.MjData(self._model)
        self._water = executed(folder / f"{name}.py").in_water(self._model)

    def set_state(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state."""
        self._data.qpos[:] = np.concatenate([np.zeros(3), [1.0, *FLU[:3]] * attitude])
        self._mujoco.mj_kinematics(self._model, self._data)
        turned = FLU * velocity
        self._data.qvel[:] = np.concatenate([self._rotation @ turned[:3], turned[3:]])

    def acceleration(self) -> FloatArray:
        """Return the acceleration."""
        self._mujoco.mj_forward(self._model, self._data)
        velocity, found = self._in_body(self._data.qvel), self._in_body(self._data.qacc)
        found[:3] -= np.cross(velocity[3:], velocity[:3])
        return found

    def move(self, h: float) -> FloatArray:
        """Take one step."""
        self._model.opt.timestep = h
        self._mujoco.mj_step(self._model, self._data)
        self._mujoco.mj_kinematics(self._model, self._data)
        return self._in_body(self._data.qvel)

    def push(self, inputs: FloatArray, wrench: FloatArray) -> None:
        """Set what drives it."""
        for set_between_steps, values in zip(self._water, (inputs, wrench), strict=True):
            set_between_steps[:] = values

    def _in_body(self, values: FloatArray) -> FloatArray:
        """Return a free joint's translation in the world and rotation in the body."""
        return np.asarray(FLU * np.concatenate([self._rotation.T @ values[:3], values[3:]]))

    @property
    def _rotation(self) -> FloatArray:
        return np.asarray(self._data.xmat[1].reshape(3, 3))
