"""Sensors simulated from an exact log: each at its own times, with noise."""

from dataclasses import replace

import numpy as np

from hydrodamp.data.attitude import euler_from_quaternion, rotation_matrices
from hydrodamp.data.measurement import KINDS, Measurement


def integrate_position(log):
    """Positions [m] from exact velocities and attitudes, trapezoidal."""
    velocity = np.einsum("nij,nj->ni", rotation_matrices(log.attitude), log.velocity[:, :3])
    position = np.zeros((log.n, 3))
    for start, stop in log.bounds.tolist():
        step = np.diff(log.time[start:stop])[:, None]
        mean = 0.5 * (velocity[start : stop - 1] + velocity[start + 1 : stop])
        position[start + 1 : stop] = np.cumsum(step * mean, axis=0)
    return position


def sample(log, name, kind, series, period, std, seed=0, components=None, **settings):
    """Return measurements of series (n, k) every period [s], with white noise."""
    rng, parts = np.random.default_rng(seed), []
    delay = settings.pop("true_delay", 0.0)
    for number, (start, stop) in enumerate(log.bounds.tolist()):
        time = log.time[start:stop]
        moments = np.arange(time[0], time[-1], period)
        values = np.column_stack([np.interp(moments, time, each) for each in series[start:stop].T])
        parts.append((moments + delay, values, np.full(len(moments), number)))
    time, values, segment = (np.concatenate(each) for each in zip(*parts, strict=True))
    values = values + std * rng.standard_normal(values.shape)
    components = components or KINDS[kind]
    stds = np.full(len(components), std)
    return Measurement(name, kind, time, values, components, stds, segment, **settings)


def without(log, *names, measurements=()):
    """Return a log without some velocities, with measurements."""
    remaining = tuple(name for name in log.velocity_names if name not in names)
    velocity = log.velocity * [name not in names for name in "uvwpqr"]
    more = {"velocity_names": remaining, "measurements": tuple(measurements)}
    return replace(log, velocity=velocity, **more)


def euler_angles(log):
    """Roll, pitch, yaw [rad] without jumps."""
    euler = euler_from_quaternion(log.attitude)
    for start, stop in log.bounds.tolist():
        euler[start:stop] = np.unwrap(euler[start:stop], axis=0)
    return euler
