"""System identification of MuJoCo: a free ellipsoid in a fluid, by ``mujoco.sysid.optimize``.

MuJoCo has five coefficients of the fluid for an ellipsoid: blunt and slender drag, angular drag,
Kutta lift and Magnus lift; its added mass follows from the semi-axes. Free are these, the
semi-axes, the height of the centre of buoyancy over that of mass, the net buoyancy and a gain for
each channel. The toolbox (extra ``sysid`` of mujoco 3.5 or later) knows bodies and actuators by
name, not the fluid: the residuals are those of rollouts that set the model directly.
"""

from __future__ import annotations

import importlib
import importlib.util
import time
from typing import Any

import numpy as np

from benchmark_campaign import Logs
from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log

WINDOW, N_WINDOWS, MAX_ITERATIONS, STEP = 100, 15, 12, 0.05
DENSITY, VISCOSITY, GRAVITY = 1000.0, 1e-3, 9.81
FLIP = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])  # forward-starboard-down to forward-port-up
CHANNELS = "ch_forward", "ch_lateral", "ch_heave", "ch_roll", "ch_pitch", "ch_yaw"
FIRST = [0.4, 0.3, 0.2, 0.5, 0.25, 1.5, 1.0, 1.0, 0.02, 0.0]
LOWER = [0.05, 0.05, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -20.0]
UPPER = [1.0, 1.0, 1.0, 5.0, 5.0, 10.0, 5.0, 5.0, 0.3, 20.0]


def is_available() -> bool:
    """Return whether the toolbox is installed with its requirements."""
    if importlib.util.find_spec("mujoco") is None:
        return False
    if importlib.util.find_spec("mujoco.sysid") is None:
        return False
    return hasattr(importlib.import_module("mujoco.sysid"), "optimize")


class Simulator:
    """The free body; parameters are those of FIRST, then a gain for each channel."""

    def __init__(self, mass: float, inertia: FloatArray) -> None:
        """Compile the body."""
        import mujoco

        self.mujoco = mujoco
        moments = " ".join(str(each) for each in inertia)
        self.model = mujoco.MjModel.from_xml_string(f"""
            <mujoco><option density="{DENSITY}" viscosity="{VISCOSITY}" gravity="0 0 0"
              integrator="implicitfast"/>
            <worldbody><body><freejoint/>
              <inertial pos="0 0 0" mass="{mass}" diaginertia="{moments}"/>
              <geom type="ellipsoid" size="0.3 0.2 0.1" fluidshape="ellipsoid" mass="0"
                contype="0" conaffinity="0"/></body></worldbody></mujoco>""")
        self.data = mujoco.MjData(self.model)
        self.mass = mass

    def run(self, x: FloatArray, log: Log, inputs: FloatArray, start: int, stop: int) -> FloatArray:
        """Return velocities (n, 6), forward-starboard-down, from the measured state at a start."""
        assert log.attitude is not None
        model, data, mujoco = self.model, self.data, self.mujoco
        model.geom_size[0] = x[:3]
        # interaction, then blunt drag, slender drag, angular drag, Kutta lift, Magnus lift
        model.geom_fluid[0, 1:6] = x[3:8]
        self._set_added_mass(x)
        mujoco.mj_resetData(model, data)
        w, i, j, k = log.attitude[start]
        data.qpos[3:] = w, i, -j, -k
        data.qvel[:] = log.velocity[start] * FLIP
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, data.qpos[3:])
        data.qvel[:3] = rotation.reshape(3, 3) @ data.qvel[:3]
        found = np.full((stop - start, 6), np.nan)
        for index in range(start, stop):
            mujoco.mju_quat2Mat(rotation, data.qpos[3:])
            turn = rotation.reshape(3, 3)
            found[index - start] = np.concatenate([turn.T @ data.qvel[:3], data.qvel[3:]]) * FLIP
            if index == stop - 1 or not np.abs(found[index - start]).max() < 50.0:
                break
            step = log.time[index + 1] - log.time[index]
            n = max(int(np.ceil(step / STEP)), 1)
            model.opt.timestep = step / n
            wrench = x[len(FIRST) :] * inputs[index] * FLIP
            for _ in range(n):
                mujoco.mju_quat2Mat(rotation, data.qpos[3:])
                turn = rotation.reshape(3, 3)
                lift = turn.T @ [0.0, 0.0, self.mass * GRAVITY]
                moment = np.cross([0.0, 0.0, x[8]], lift)
                data.xfrc_applied[1, :3] = turn @ wrench[:3] + [0.0, 0.0, x[9]]
                data.xfrc_applied[1, 3:] = turn @ (wrench[3:] + moment)
                mujoco.mj_step(model, data)
        return found

    def _set_added_mass(self, x: FloatArray) -> None:
        """Let MuJoCo compute the added mass of an ellipsoid with the semi-axes."""
        size = " ".join(str(each) for each in x[:3])
        made = self.mujoco.MjModel.from_xml_string(f"""
            <mujoco><worldbody><body><freejoint/>
            <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
            <geom type="ellipsoid" size="{size}" fluidshape="ellipsoid"/>
            </body></worldbody></mujoco>
            """)
        self.model.geom_fluid[0, 6:] = made.geom_fluid[0, 6:]
        self.model.geom_fluid[0, 0] = made.geom_fluid[0, 0]


def replay(logs: Logs) -> tuple[FloatArray, float]:
    """Return the velocities of the test log by the fitted body, and the CPU time of the fit."""
    from mujoco import sysid

    began, train, test = time.process_time(), logs.train, logs.test
    assert logs.vehicle.added_mass is not None
    rigid = np.diag(logs.vehicle.mass_matrix - logs.vehicle.added_mass)
    simulator = Simulator(rigid[0], rigid[3:])
    std = train.velocity.std(axis=0)
    windows = [
        (start, start + WINDOW)
        for first, last in train.bounds.tolist()
        for start in range(first, last - WINDOW + 1, WINDOW)
    ]
    windows = windows[:: max(1, -(-len(windows) // N_WINDOWS))]
    inputs = _channels(train)
    gains = np.ones(6) if train.wrench is not None else np.array([10.0, 10, 10, 1, 1, 1])
    bound = 10.0 * gains
    parameters = sysid.ParameterDict()
    lower, upper = np.append(LOWER, -bound), np.append(UPPER, bound)
    parameters.add(sysid.Parameter("body", np.append(FIRST, gains), lower, upper))

    def residuals(x: Any, _: Any, **__: Any) -> tuple[list[FloatArray], None, None]:
        columns = np.atleast_2d(np.asarray(x).T)
        errors = []
        for each in columns:
            runs = [simulator.run(each, train, inputs, *window) for window in windows]
            measured = [train.velocity[slice(*window)] for window in windows]
            error = np.nan_to_num((np.vstack(runs) - np.vstack(measured)) / std, nan=10.0)
            errors.append(error.ravel() / np.sqrt(error.size))
        return [np.squeeze(np.array(errors).T)], None, None

    found, _ = sysid.optimize(
        parameters, residuals, "scipy", verbose=False, max_iters=MAX_ITERATIONS, x_scale="jac"
    )
    took, x, commands = time.process_time() - began, found.as_vector(), _channels(test)
    parts = [simulator.run(x, test, commands, *bounds) for bounds in test.bounds.tolist()]
    return np.vstack(parts), took


def _channels(log: Log) -> FloatArray:
    """Return the wrench, or the channels of each axis."""
    if log.wrench is not None:
        return np.asarray(log.wrench)
    return np.column_stack([log.command(name) for name in CHANNELS])
