"""A vehicle simulated as teaching simulators do it: matrices, Euler angles, Euler's rule.

One step is ``nu += h * M^-1 (tau - C(nu) nu - D(nu) nu - g(eta))`` with small
NumPy matrices made anew each time, then the same for the attitude.
"""

from __future__ import annotations

import numpy as np

import hydrodamp as hd
from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.data.attitude import euler_from_quaternion


def skew(a: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def coriolis_matrix(mass: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    p = mass @ velocity
    matrix = np.zeros((6, 6))
    matrix[:3, 3:] = -skew(p[:3])
    matrix[3:, :3] = -skew(p[:3])
    matrix[3:, 3:] = -skew(p[3:])
    return matrix


def gravity(vehicle: hd.Vehicle, roll: float, pitch: float) -> np.ndarray:
    down = np.array([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])
    arm = vehicle.weight * np.array(vehicle.center_of_gravity)
    arm = arm - vehicle.buoyancy * np.array(vehicle.center_of_buoyancy)
    force = (vehicle.weight - vehicle.buoyancy) * down
    return -np.concatenate([force, np.cross(arm, down)])


def angle_rates(roll: float, pitch: float) -> np.ndarray:
    sine, cosine, tangent = np.sin(roll), np.cos(roll), np.tan(pitch)
    return np.array(
        [
            [1.0, sine * tangent, cosine * tangent],
            [0.0, cosine, -sine],
            [0.0, sine / np.cos(pitch), cosine / np.cos(pitch)],
        ]
    )


def simulate(vehicle: hd.Vehicle, damping: hd.Damping, log: hd.Log) -> np.ndarray:
    """Return the velocities of the whole log, linear and quadratic damping on each axis."""
    names = list(zip(AXES, VELOCITIES, strict=True))
    linear = np.array([damping[f"{axis}_{name}"] for axis, name in names])
    quadratic = np.array([damping[f"{axis}_{name}|{name}|"] for axis, name in names])
    mass, inverse = vehicle.mass_matrix, np.linalg.inv(vehicle.mass_matrix)
    velocity, angles = log.velocity[0].copy(), euler_from_quaternion(log.attitude[:1])[0]
    history = np.empty((log.n, 6))
    for k in range(log.n):
        history[k] = velocity
        if k + 1 == log.n:
            break
        h = log.time[k + 1] - log.time[k]
        drag = -np.diag(linear + quadratic * np.abs(velocity))
        forces = (
            log.wrench[k]
            - np.matmul(coriolis_matrix(mass, velocity), velocity)
            - np.matmul(drag, velocity)
            - gravity(vehicle, angles[0], angles[1])
        )
        turning = np.matmul(angle_rates(angles[0], angles[1]), velocity[3:])
        velocity = velocity + h * np.matmul(inverse, forces)
        angles = angles + h * turning
    return history
