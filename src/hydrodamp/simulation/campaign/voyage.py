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
    """What happened and what was measured, in every run.

    Attributes
    ----------
    runs : tuple of Run
        What was asked for.
    time : ndarray, shape (n,)
        Time from the start of each run [s].
    states : ndarray, shape (n, n_runs, 12)
        The exact states, just after the commands of the sample arrived.
    accelerations : ndarray, shape (n, n_runs, 6)
        The exact accelerations there [m/s^2, rad/s^2].
    measured : ndarray, shape (n, n_runs, 10)
        The states but for the fins, as the sensors saw them.
    commands : ndarray, shape (n, n_runs, 2)
        Rudder and elevator as sent [rad].
    pushes : ndarray, shape (n, n_runs, 6)
        Wrench from the outside [N, N m], body frame, from each sample to the next.
    """

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
    """Return the voyage of every run, one sample each tenth of a second.

    They start level and straight, at the speed that their propeller sustains.

    Parameters
    ----------
    runs : sequence of Run
        What is asked for.
    motion : Motion
        The vehicles, one for each run.
    errors : ndarray, shape (n, n_runs, 10)
        What the sensors add; they also say how long to sail.
    pushes : ndarray, shape (n, n_runs, 6)
        Wrench on the vehicle from the outside [N, N m], body frame, held from sample
        to sample.
    done : callable, optional
        Called after each sample, for a progress bar.

    Returns
    -------
    voyage : Voyage
        Of ``n`` samples.
    """
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
