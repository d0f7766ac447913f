"""Trim at a steady surge speed, and equation 1 linearised about it, for each draw of damping.

The trim is the minimum-norm solution (v, w, roll, pitch, commands) of zero acceleration and zero
depth rate at a surge speed u, by Gauss-Newton steps. With x the deviation of velocity, Euler angles
and depth from it, and c that of the commands, ``dx/dt = A x + B c`` by central differences.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.experiment_design.autopilot_design import DesignedAutopilot
from hydrodamp.experiment_design.steady_states import (
    FIRST_DIFFERENCE,
    TOLERANCE,
    differences,
    solve_steady_states,
)
from hydrodamp.simulation import closed_loop as dynamics
from hydrodamp.simulation.checks import estimate_length
from hydrodamp.simulation.closed_loop import FIN_LIMIT, EquationOfMotion
from hydrodamp.vehicle.mass import STANDARD_GRAVITY
from hydrodamp.vehicle.vehicle import Vehicle

STATES = (*VELOCITIES, "roll", "pitch", "yaw", "depth")
"""States of a linear model [m/s, rad/s, rad, m]."""

_STATE_AXES = (*AXES, "K", "M", "N", "Z")  # each state varies where this axis is free
_BALANCED, _TRIMMED = [*range(6), 9], [1, 2, 6, 7]  # zero rates; v, w, roll and pitch


@dataclass(frozen=True, eq=False)
class LinearModel:
    """Trims and linear models at one speed of n draws of damping, the estimate first.

    Attributes
    ----------
    state, commands : ndarray, shape (n, 10) and (n, k)
        The trims: velocity, Euler angles and depth; NaN where there is none.
    a, b : ndarray, shape (n, 10, 10) and (n, 10, k)
        Zero rows and columns for states of locked axes.
    force : ndarray, shape (n, 6)
        Wrench of the actuators that holds the trim: the feed-forward [N, N m].
    """

    state: FloatArray
    commands: FloatArray
    a: FloatArray
    b: FloatArray
    force: FloatArray

    @cached_property
    def exists(self) -> BoolArray:
        """Whether each draw has a trim, shape (n,)."""
        return np.asarray(np.isfinite(self.state).all(axis=1))


def free_states(vehicle: Vehicle) -> BoolArray:
    """Return which states vary, shape (10,)."""
    return np.array([axis in vehicle.axes for axis in _STATE_AXES])


def vehicle_length(vehicle: Vehicle) -> float:
    """Return the length scale of a vehicle [m]."""
    return estimate_length(vehicle) or float(np.cbrt(vehicle.mass_matrix[0, 0] / 1000.0))


def state_scales(vehicle: Vehicle) -> FloatArray:
    """Return the scale of each state at equal Froude number, shape (10,)."""
    length = vehicle_length(vehicle)
    velocity = np.sqrt(STANDARD_GRAVITY * length)
    return np.repeat([velocity, velocity / length, FIN_LIMIT, length], [3, 3, 3, 1])


def linearise(
    equation: EquationOfMotion, autopilot: DesignedAutopilot, speed: float
) -> LinearModel:
    """Return the linear models of an equation of n members at a surge speed [m/s]."""
    vehicle, n = equation.table.vehicle, len(equation.matrices)
    highest = np.maximum(autopilot.highest, autopilot.full_ahead)
    scale = np.append(state_scales(vehicle), np.maximum(highest, -autopilot.lowest))
    scale[:10] *= free_states(vehicle)

    def rates(points: FloatArray) -> FloatArray:
        """Return the rates (m, n, 10) at states and commands (m, n, 10 + k)."""
        rows = points.reshape(-1, points.shape[2])
        state = np.zeros((len(rows), dynamics.N_STATES))
        state[:, dynamics.MEASURED] = rows[:, :10]
        commands = dict(zip(autopilot.names, rows[:, 10:].T, strict=True))
        acceleration = equation.acceleration(state, *equation.inputs(commands, len(rows)))
        motion = dynamics.motion_rates(acceleration, state)[:, dynamics.MEASURED]
        return np.asarray((motion * free_states(vehicle)).reshape(*points.shape[:2], 10))

    point = np.zeros((n, len(scale)))
    point[:, 0] = speed
    unknown = [*_TRIMMED, *range(10, len(scale))]
    rate_scale = state_scales(vehicle)[_BALANCED] * np.sqrt(
        STANDARD_GRAVITY / vehicle_length(vehicle)
    )

    def imbalance(points: FloatArray) -> FloatArray:
        return np.asarray(rates(points)[:, :, _BALANCED] / rate_scale)

    with np.errstate(all="ignore"):
        point, is_trimmed = solve_steady_states(imbalance, point, scale, unknown, FIRST_DIFFERENCE)
        slack = TOLERANCE * scale[10:]
        allowed = (point[:, 10:] >= autopilot.lowest - slack) & (point[:, 10:] <= highest + slack)
        upright = np.abs(point[:, 6:8]).max(axis=1) < np.pi / 2.0
        point[~(is_trimmed & allowed.all(axis=1) & upright)] = np.nan
        slopes = differences(rates, point, scale)
        slopes = np.divide(slopes, scale, out=0.0 * slopes, where=scale > 0.0)
        unpowered = point * (np.arange(len(scale)) < 10)
        change = rates(point[None])[0, :, :6] - rates(unpowered[None])[0, :, :6]
    force = change @ vehicle.mass_matrix.T * vehicle.free
    return LinearModel(point[:, :10], point[:, 10:], slopes[:, :, :10], slopes[:, :, 10:], force)
