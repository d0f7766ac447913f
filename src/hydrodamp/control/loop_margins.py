"""Closed loop of a linear model and an autopilot, sampled: gains, growth and stability margins.

Commands are held over a period T. With a linear autopilot c = C z + D x, z+ = A z + B x, the loop
L(exp(jwT)) is the return ratio at the commands, and S = (I + L)^-1. The loop of command i, broken
while the others are closed, is 1 / S_ii - 1; its modulus margin min |1 / S_ii| is its distance
from -1. A margin m allows gains from 1 / (1 + m) to 1 / (1 - m), and a lag of 2 asin(m / 2).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.control.linear_model import LinearModel
from hydrodamp.experiment_design.steady_states import differences
from hydrodamp.simulation.closed_loop import Autopilot, AutopilotState

MIN_MODULUS = 0.5
"""Smallest acceptable modulus margin, a sensitivity of 2: K. J. Astrom and R. M. Murray, Feedback
Systems (2008), section 11.5, state that of 1.2 to 2. Gain margin 6 dB, phase margin 29 deg."""

N_FREQUENCIES, LOWEST, HIGHEST = 400, 1e-4, 1.001
"""Frequencies of a loop, over the Nyquist frequency, at which a loop crosses the real axis."""

MARGINAL = 1e-6
"""Growth of a mode over a period that counts as none: rounding of the differences."""


class LinearLaw(NamedTuple):
    """An autopilot for small errors: matrices A (3, 3), B (3, 10), C (k, 3) and D (k, 10)."""

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray


class Margins(NamedTuple):
    """Growth of a mode over a period (n,), and margins of the loop at each command (n, k)."""

    growth: FloatArray
    modulus: FloatArray
    gain: FloatArray  # least factor above 1, up or down, to the limit of stability
    phase: FloatArray  # [deg]
    delay: FloatArray  # [s]


def hold(model: LinearModel, period: float) -> tuple[FloatArray, FloatArray]:
    """Return A and B over a period of held commands, of every draw."""
    n, k = model.a.shape[1], model.b.shape[2]
    exponent = np.zeros((len(model.a), n + k, n + k))
    exponent[:, :n] = np.concatenate([model.a, model.b], axis=2) * period
    advance = np.asarray(expm(exponent))
    return advance[:, :n, :n], advance[:, :n, n:]


def linear_law(
    autopilot: Autopilot, trim: FloatArray, scales: FloatArray, period: float
) -> LinearLaw:
    """Return an autopilot linearised about a trim, without its limits."""
    infinite = np.full(len(autopilot.names), np.inf)
    free = {
        name: loop._replace(pid=replace(loop.pid, limit=np.inf))
        for name in ("heading", "pitch", "depth")
        if (loop := getattr(autopilot, name)) is not None
    }
    unlimited = replace(autopilot, lowest=-infinite, highest=infinite, **free)

    def respond(points: FloatArray) -> FloatArray:
        rows, zeros = points[:, 0], np.zeros((len(points), 3))
        memory = AutopilotState.initial(len(rows))._replace(integrals=rows[:, 10:])
        overlay = np.zeros((len(rows), len(infinite)))
        commands, memory = unlimited.control(rows[:, :10], zeros, overlay, memory, period)
        return np.hstack([memory.integrals, commands])[:, None]

    scale = np.append(scales, np.ones(3))
    slopes = differences(respond, np.append(trim, np.zeros(3))[None], scale)[0] / scale
    return LinearLaw(slopes[:3, 10:], slopes[:3, :10], slopes[3:, 10:], slopes[3:, :10])


def stability_margins(
    model: LinearModel, law: LinearLaw, used: BoolArray, period: float
) -> Margins:
    """Return the margins of every draw; states that no loop controls are left out."""
    plant, inputs = hold(model, period)
    plant, inputs = plant[:, used][:, :, used], inputs[:, used]
    b, d = law.b[:, used], law.d[:, used]
    closed = np.block(
        [
            [plant + inputs @ d, inputs @ law.c],
            [
                np.broadcast_to(b, (len(plant), *b.shape)),
                np.broadcast_to(law.a, (len(plant), 3, 3)),
            ],
        ]
    )
    modes = np.abs(np.linalg.eigvals(closed))
    # an integral that no loop has keeps its value: a mode of modulus 1
    growth = modes.max(axis=1) - 1.0
    frequency = np.pi / period * np.geomspace(LOWEST, HIGHEST, N_FREQUENCIES)
    z = np.exp(1j * frequency * period)[:, None, None]
    controller = (
        law.c @ np.linalg.solve(z * np.eye(3) - law.a, np.broadcast_to(b, (len(z), *b.shape))) + d
    )
    modulus, crossings = np.empty((len(plant), len(d))), np.empty((3, len(plant), len(d)))
    for index, (a, each) in enumerate(zip(plant, inputs, strict=True)):
        response = np.linalg.solve(
            z * np.eye(len(a)) - a, np.broadcast_to(each, (len(z), *each.shape))
        )
        sensitivity = np.linalg.inv(np.eye(len(d)) - controller @ response)
        distance = 1.0 / np.diagonal(sensitivity, axis1=1, axis2=2)
        modulus[index] = np.abs(distance).min(axis=0)
        crossings[:, index] = np.transpose(
            [loop_margins(loop, frequency) for loop in distance.T - 1.0]
        )
    return Margins(growth, np.where(growth[:, None] > MARGINAL, 0.0, modulus), *crossings)


def loop_margins(loop: FloatArray, frequency: FloatArray) -> tuple[float, float, float]:
    """Return gain margin (a factor), phase margin [deg] and delay margin [s] of a loop."""
    angle, size = np.unwrap(np.angle(-loop)), np.log(np.maximum(np.abs(loop), 1e-300))
    turns = angle / (2.0 * np.pi)
    at = np.flatnonzero(np.floor(turns[1:]) != np.floor(turns[:-1]))
    level = np.maximum(np.floor(turns[1:]), np.floor(turns[:-1]))[at]
    share = (level - turns[at]) / (turns[at + 1] - turns[at])
    sizes = np.abs(size[at] + share * (size[at + 1] - size[at]))
    cross = np.flatnonzero(np.sign(size[1:]) != np.sign(size[:-1]))
    fraction = -size[cross] / (size[cross + 1] - size[cross])
    phases = angle[cross] + fraction * (angle[cross + 1] - angle[cross])
    phases -= 2.0 * np.pi * np.round(phases / (2.0 * np.pi))
    omega = frequency[cross] + fraction * (frequency[cross + 1] - frequency[cross])
    lags = np.mod(phases, 2.0 * np.pi) / omega
    values = np.exp(sizes), np.degrees(np.abs(phases)), lags
    gain, phase, delay = (float(each.min(initial=np.inf)) for each in values)
    return gain, phase, delay
