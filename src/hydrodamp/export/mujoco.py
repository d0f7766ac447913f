"""MuJoCo: a body in MJCF, and a passive force that moves it as equation 1 does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.export.body import Body, check_positive
from hydrodamp.export.craft import Craft
from hydrodamp.export.frames import FLU
from hydrodamp.export.printer import PYTHON, name_of, number, printed, said_of
from hydrodamp.export.target import Engine, Files, Target, executed, rendered, require, stepped
from hydrodamp.vehicle.mass import STANDARD_GRAVITY

T = TypeVar("T")

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
    meant: ClassVar[str] = "MuJoCo 3.3 or newer"
    step: float = 0.01

    def __post_init__(self) -> None:
        """Refuse time that stands."""
        check_positive(self)

    @property
    def ignores(self) -> str:
        """What meets the rigid body alone."""
        return "added mass where contacts, constraints and MuJoCo's own actuators push"

    def write(self, craft: Craft) -> Files:
        """Return the model, and the file with the force."""
        body, name = Body.of(craft, self.key, _WATER).turned, name_of(craft)
        xml = rendered(
            "mujoco.xml.j2",
            **said_of(craft, ""),
            body=body,
            side=body.volume ** (1.0 / 3.0),
            step=self.step,
            gravity=STANDARD_GRAVITY,
            number=number,
            numbers=lambda values: " ".join(map(number, values)),
        )
        said = said_of(craft, ",\n    ")
        text = rendered("mujoco.py.j2", **said, lines=printed(craft, PYTHON))
        return {f"{name}.xml": xml, f"{name}.py": text}

    def read(self, folder: Path, craft: Craft) -> Engine:
        """Return MuJoCo with the model and the force."""
        require("mujoco")
        body = _Body(folder, name_of(craft))
        engine = stepped(body, f"MuJoCo {version('mujoco')}", self.step)
        return replace(engine, rates=body.wet(engine.rates), replay=body.wet(engine.replay))


class _Body:
    """The body in MuJoCo."""

    def __init__(self, folder: Path, name: str) -> None:
        import mujoco

        self._mujoco: Any = mujoco
        self._model = mujoco.MjModel.from_xml_path(str(folder / f"{name}.xml"))
        self._data = mujoco.MjData(self._model)
        self._water = executed(folder / f"{name}.py")
        self._inputs = self._wrench = np.zeros(0)

    def wet(self, run: Callable[[T], FloatArray]) -> Callable[[T], FloatArray]:
        """Return a run with the callback that MuJoCo has for all models."""

        def run_in_water(given: T) -> FloatArray:
            self._inputs, self._wrench = self._water.in_water(self._model)
            try:
                return run(given)
            finally:
                self._mujoco.set_mjcb_passive(None)

        return run_in_water

    def place(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state."""
        self._data.qpos[:] = np.concatenate([np.zeros(3), [1.0, *FLU[:3]] * attitude])
        self._mujoco.mj_kinematics(self._model, self._data)
        turned = FLU * velocity
        self._data.qvel[:] = np.concatenate([self._rotation @ turned[:3], turned[3:]])

    def rate(self, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return the acceleration."""
        self._push(inputs, wrench)
        self._mujoco.mj_forward(self._model, self._data)
        velocity, found = self._in_body(self._data.qvel), self._in_body(self._data.qacc)
        found[:3] -= np.cross(velocity[3:], velocity[:3])
        return found

    def advance(self, length: float, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        """Take one step."""
        self._push(inputs, wrench)
        self._model.opt.timestep = length
        self._mujoco.mj_step(self._model, self._data)
        self._mujoco.mj_kinematics(self._model, self._data)
        return self._in_body(self._data.qvel)

    def _push(self, inputs: FloatArray, wrench: FloatArray) -> None:
        self._inputs[:] = inputs
        self._wrench[:] = wrench

    def _in_body(self, values: FloatArray) -> FloatArray:
        """Return a free joint's translation in the world and rotation in the body."""
        return np.asarray(FLU * np.concatenate([self._rotation.T @ values[:3], values[3:]]))

    @property
    def _rotation(self) -> FloatArray:
        return np.asarray(self._data.xmat[1].reshape(3, 3))
