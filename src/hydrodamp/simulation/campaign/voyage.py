"""Sailing the runs: all of them at once, steered by the autopilot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.campaign.autopilot import PERIOD, Memory, steer
from hydrodamp.simulation.campaign.motion import DEPTH, MEASURED, N_STATES, Motion
from hydrodamp.simulation.campaign.plan import Run

STARTING_DEPTH = 10.0
"""Depth at which every run starts [m]."""


@dataclass(frozen=True)
class Voyage:
    """What happened and what was measured, in every run."""

    runs: tuple[Run, ...]
    time: FloatArray
    states: FloatArray
    accelerations: FloatArray
    measured: FloatArray
    commands: FloatArray
    pushes: FloatArray


def sail(
    runs: Sequence[Run],
    motion: Motion,
    errors: FloatArray,
    pushes: FloatArray,
    done: Callable[[], None] | None = None,
) -> Voyage:
    """Return the voyage of every run, one sample each tenth of a second."""
    time = np.arange(len(errors), dtype=np.float64) * PERIOD
    heading = np.radians(np.transpose([run.heading.at(time) for run in runs]))
    depth = STARTING_DEPTH + np.transpose([run.depth.at(time) for run in runs])
    state, memory = _at_start(motion), Memory.blank(len(runs))
    samples = []
    for error, push, course, level in zip(errors, pushes, heading, depth, strict=True):
        measured, pushed = state[:, MEASURED] + error, motion.pushed(push)
        commands, memory = steer(measured, course, level, memory)
        state = pushed.receive(state, commands)
        samples.append((state, pushed.acceleration(state), measured, commands))
        state = pushed.advance(state, commands, PERIOD)
        if done is not None:
            done()
    states, accelerations, seen, sent = (np.array(column) for column in zip(*samples, strict=True))
    return Voyage(tuple(runs), time, states, accelerations, seen, sent, pushes)


def _at_start(motion: Motion) -> FloatArray:
    state = np.zeros((len(motion.propulsion), N_STATES))
    state[:, 0] = motion.steady_surge
    state[:, DEPTH] = STARTING_DEPTH
    return state
