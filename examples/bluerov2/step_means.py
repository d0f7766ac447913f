"""A log of means over a few steps: what a regression should see of held commands.

A command is held from one row to the next, so the acceleration *between* two rows belongs to the
mean of everything between them. A difference around a row mixes the command before with the one
after; at 5 to 10 Hz and steps of half a second that is what spoils ordinary least squares.
"""

from __future__ import annotations

import numpy as np

import hydrodamp as hd
from hydrodamp.arrays import FloatArray


def step_means(log: hd.Log, steps: int) -> hd.Log:
    """Return the means over every ``steps`` steps, with the acceleration over them."""
    return hd.concatenate([_means(log.select(part.name), steps) for part in log.segments])


def _means(log: hd.Log, steps: int) -> hd.Log:
    width = np.diff(log.time)
    span = log.time[steps:] - log.time[:-steps]

    def mean(values: FloatArray) -> FloatArray:
        """Mean over ``steps`` steps of values that hold for one step each."""
        total = np.cumsum(np.vstack([np.zeros(values.shape[1]), values * width[:, None]]), axis=0)
        return np.asarray((total[steps:] - total[:-steps]) / span[:, None])

    def between(rows: FloatArray) -> FloatArray:
        return np.asarray((rows[1:] + rows[:-1]) / 2.0)

    attitude = mean(between(_continuous(log.attitude)))
    return hd.Log.from_arrays(
        time=(log.time[steps:] + log.time[:-steps]) / 2.0,
        velocity=mean(between(log.velocity)),
        attitude=attitude / np.linalg.norm(attitude, axis=1, keepdims=True),
        commands=dict(zip(log.command_names, mean(log.commands[:-1]).T, strict=True)),
        acceleration=(log.velocity[steps:] - log.velocity[:-steps]) / span[:, None],
    )


def _continuous(attitude: FloatArray | None) -> FloatArray:
    """Quaternions without the jumps of sign that are no rotation."""
    if attitude is None:
        raise hd.LogError("the tank runs have an attitude; this log has none")
    turned = np.sum(attitude[1:] * attitude[:-1], axis=1) < 0.0
    sign = np.cumprod(np.concatenate([[1.0], np.where(turned, -1.0, 1.0)]))
    return attitude * sign[:, None]
