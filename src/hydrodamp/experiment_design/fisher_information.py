"""What a dive will tell: normal matrices of its replay, window by window, added up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator, Trajectories
from hydrodamp.identification.differentiation import median_step
from hydrodamp.identification.multiple_shooting import MAX_STEP, eliminate_initial_states
from hydrodamp.kernels import core
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, prepare

#: Length of a window [s], means of errors in it, and how well its first velocity is known, in
#: standard deviations of what is measured: as the search of output error has them.
WINDOW, _MEANS, _DOUBT = 8.0, 10, 0.4


@dataclass(frozen=True, eq=False)
class ErrorModel:
    """By what errors replays are judged: their standard deviation, and that of first velocities."""

    residual_std: FloatArray
    initial_state_std: FloatArray

    @classmethod
    def of(cls, noise: FloatArray) -> ErrorModel:
        """Return the errors of sensors."""
        return cls(np.maximum(noise, 1e-6), np.maximum(_DOUBT * noise, 1e-6))


def fisher_information(
    closed_loop: ClosedLoopSimulator,
    trajectories: Trajectories,
    seen: ErrorModel,
    window: float = WINDOW,
) -> FloatArray:
    """Return what each vehicle's record tells of the model's coefficients, shape (n, p, p).

    With A the slopes of a replay on the coefficients, over the spread of its errors, and B those
    on the first velocity, a window tells A'A - A'B (B'B + D)^-1 B'A, where D is what is known of
    the first velocity: Cramer and Rao's bound of output error (Farina and Piroddi 2010).
    """
    n_members, n = len(closed_loop.matrices), trajectories.states.shape[1]
    p = closed_loop.ensemble.model.n_coefficients
    found = np.zeros((n, p, p))
    for member in range(min(n_members, n)):
        own = np.arange(member, n, n_members)
        found[own] = _of_member(closed_loop, trajectories.select(own), member, seen, window)
    return found


def _of_member(
    closed_loop: ClosedLoopSimulator,
    trajectories: Trajectories,
    member: int,
    seen: ErrorModel,
    window: float,
) -> FloatArray:
    """Return the Fisher information of each vehicle, all with the damping of one member."""
    log = trajectories.log(closed_loop.vehicle, closed_loop.autopilot.names, exact=True)
    problem = prepare(closed_loop.vehicle, log, closed_loop.ensemble.wide)
    n, model = trajectories.states.shape[1], closed_loop.ensemble.model
    information = window_information(problem, closed_loop.matrices[member], model, seen, window)
    return np.asarray(information.reshape(n, -1, *information.shape[1:]).sum(axis=1))


def window_information(
    problem: Problem,
    matrix: FloatArray,
    model: DampingModel,
    seen: ErrorModel,
    window: float = WINDOW,
) -> FloatArray:
    """Return what each window of a record tells, segment by segment, shape (windows, p, p)."""
    free, p = np.flatnonzero(problem.vehicle.free), model.n_coefficients
    bounds = problem.segments.tolist()
    length = max(round(window / median_step(problem)), 2)
    length = min(length, *(stop - start - 1 for start, stop in bounds))
    first = np.concatenate([np.arange(a, b - length, length) for a, b in bounds])
    _, _, slopes = core.replay(
        problem.equations.plant,
        matrix,
        problem.inputs,
        np.column_stack([first, first + length]),
        problem.equations.entries(model),
        max_step=MAX_STEP,
        block=max(length // _MEANS, 1),
    )
    slopes = np.nan_to_num(slopes[:, free] / seen.residual_std[free, None])
    rows = slopes.reshape(len(first), -1, p + 6)[:, :, [*(p + free), *range(p)]]
    return eliminate_initial_states(rows.transpose(0, 2, 1) @ rows, seen.initial_state_std[free])[0]
