"""The adaptive identifier by the implicit midpoint rule: eqs. 15-16 in discrete time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.kernels.adapted import Adapted
from hydrodamp.kernels.arguments import (
    at_least,
    check_step,
    coefficients,
    floats,
    matching,
    spans,
)
from hydrodamp.kernels.inputs import Inputs, Sample
from hydrodamp.kernels.plant import Plant
from hydrodamp.kernels.reference.motion import coriolis, momentum
from hydrodamp.kernels.reference.products import regressor


@dataclass(frozen=True, eq=False)
class Steps:
    """What n - 1 steps between n samples need, each a row.

    Attributes
    ----------
    h : ndarray, shape (n - 1,)
        Length [s].
    xi : ndarray, shape (n - 1, n_terms)
        Mean of the terms at both ends, channels held from the first.
    forcing : ndarray, shape (n - 1, 6)
        Mean of H(M nu) nu plus the recorded wrench [N, N m].
    gain : ndarray, shape (n - 1, 6)
        M (nu_{k+1} - nu_k), the momentum gained [N s, N m s].
    """

    h: FloatArray
    xi: FloatArray
    forcing: FloatArray
    gain: FloatArray


def adapt(
    plant: Plant,
    a: FloatArray,
    gamma: FloatArray,
    matrix: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    passes: int = 1,
    every: int = 0,
) -> Adapted:
    """Run the adaptive identifier over a record: the fold of :func:`adapt_step`.

    The velocity error starts at zero in every segment of every pass; the
    coefficients carry on.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    a : ndarray, shape (6,)
        Error gain of each axis, positive [N/(m/s), N m/(rad/s)].
    gamma : ndarray, shape (n_terms, 6)
        Adaptation gain of each coefficient; 0 holds it. In the paper one number.
    matrix : ndarray, shape (n_terms, 6)
        Coefficients to start from; the transpose of the paper's K-hat.
    inputs : Inputs
        The record.
    segments : ndarray of int64, shape (s, 2)
        First sample of each segment and the one after its last.
    passes : int, optional
        How often to run over the record.
    every : int, optional
        Store the state after every so many steps; 0 stores nothing.

    Returns
    -------
    adapted : Adapted
        Last coefficients and error, and the history asked for.

    Raises
    ------
    ProblemError
        If shapes do not agree, or ``passes`` or ``every`` is out of range.

    Examples
    --------
    >>> plant = Plant(np.eye(6), [True] * 6, [[1, 0, 0, 0]], 0)
    >>> rest = [np.zeros((3, width)) for width in (3, 6, 0, 2)]
    >>> inputs = Inputs([0.0, 0.1, 0.2], [[1.0, 0, 0, 0, 0, 0]] * 3, *rest)
    >>> start = np.array([[-1.0, 0, 0, 0, 0, 0]])
    >>> found = adapt(plant, np.ones(6), np.ones((1, 6)), start, inputs, np.array([[0, 3]]))
    >>> bool(found.matrix[0, 0] > -1.0)
    True
    """
    estimate = coefficients(plant, matrix).copy()
    gains = coefficients(plant, gamma, "gamma")
    a = floats(a, (6,), "a")
    matching(plant, inputs)
    rows = spans(segments, inputs.n).tolist()
    at_least("passes", passes, 1)
    at_least("every", every, 0)
    error = np.zeros(6)
    history: list[tuple[float, FloatArray, FloatArray]] = []
    count = 0
    for start, stop in rows * passes:
        error = np.zeros(6)
        steps = steps_between(plant, part_of(inputs, start, stop))
        for k in range(stop - start - 1):
            estimate, error = midpoint(plant, a, gains, estimate, error, steps, k)
            count += 1
            if every and count % every == 0:
                history.append((float(inputs.time[start + k + 1]), error, estimate))
    return _adapted(plant, estimate, error, history)


def adapt_step(
    plant: Plant,
    a: FloatArray,
    gamma: FloatArray,
    matrix: FloatArray,
    error: FloatArray,
    previous: Sample,
    current: Sample,
) -> tuple[FloatArray, FloatArray]:
    """Take the step from the previous sample to the current one.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    a : ndarray, shape (6,)
        Error gain of each axis, positive [N/(m/s), N m/(rad/s)].
    gamma : ndarray, shape (n_terms, 6)
        Adaptation gain of each coefficient; 0 holds it.
    matrix : ndarray, shape (n_terms, 6)
        Coefficients so far; the transpose of the paper's K-hat.
    error : ndarray, shape (6,)
        Velocity error so far [m/s, rad/s]; zero at a segment's first sample.
    previous, current : Sample
        The samples at both ends of the step.

    Returns
    -------
    matrix : ndarray, shape (n_terms, 6)
        The next coefficients, a new array.
    error : ndarray, shape (6,)
        The next velocity error, a new array.

    Raises
    ------
    ProblemError
        If a shape does not fit the plant.
    """
    check_step(plant, a, gamma, matrix, error, previous, current)
    return midpoint(plant, a, gamma, matrix, error, steps_of(plant, previous, current), 0)


def midpoint(
    plant: Plant,
    a: FloatArray,
    gamma: FloatArray,
    matrix: FloatArray,
    error: FloatArray,
    steps: Steps,
    k: int,
) -> tuple[FloatArray, FloatArray]:
    """Take one implicit midpoint step of eqs. 15-16.

    Parameters
    ----------
    plant, a, gamma, matrix, error
        See :func:`adapt_step`.
    steps : Steps
        The record turned into steps.
    k : int
        Which of them.

    Returns
    -------
    matrix, error : ndarray
        After the step.
    """
    h, xi = float(steps.h[k]), steps.xi[k]
    s = (xi * xi) @ gamma
    left = 2.0 / h * plant.mass_matrix + np.diag(a + 0.5 * h * s)
    right = (
        2.0 / h * (plant.mass_matrix @ error) + steps.forcing[k] + xi @ matrix - steps.gain[k] / h
    )
    both_free = np.logical_and.outer(plant.free, plant.free)
    d = np.linalg.solve(np.where(both_free, left, np.eye(6)), np.where(plant.free, right, 0.0))
    return matrix - h * gamma * np.outer(xi, d), 2.0 * d - error


def steps_between(plant: Plant, inputs: Inputs) -> Steps:
    """Turn samples into steps: means of both ends, channels held from the first.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    inputs : Inputs
        The record of one segment.

    Returns
    -------
    steps : Steps
        One row a step.
    """
    nu = np.where(plant.free, inputs.velocity, 0.0)
    held, speed = inputs.channels[:-1], inputs.propulsion
    first = regressor(plant.factors, nu[:-1], inputs.down[:-1], held, speed[:-1, 0])
    last = regressor(plant.factors, nu[1:], inputs.down[1:], held, speed[1:, 1])
    known = coriolis(plant.mass_matrix, nu) + inputs.wrench
    return Steps(
        h=np.diff(inputs.time),
        xi=np.ascontiguousarray(0.5 * (first + last)),
        forcing=0.5 * (known[:-1] + known[1:]),
        gain=np.ascontiguousarray(momentum(plant.mass_matrix, np.diff(nu, axis=0).T).T),
    )


def steps_of(plant: Plant, previous: Sample, current: Sample) -> Steps:
    """Turn two samples into one step.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    previous, current : Sample
        The samples at both ends.

    Returns
    -------
    steps : Steps
        A single row.
    """
    pair = np.stack([previous.values, current.values])
    inputs = Inputs(
        pair[:, 0], pair[:, 1:7], pair[:, 7:10], pair[:, 10:16], pair[:, 18:], pair[:, 16:18]
    )
    return steps_between(plant, inputs)


def part_of(inputs: Inputs, start: int, stop: int) -> Inputs:
    """Return the samples from ``start`` up to ``stop``.

    Parameters
    ----------
    inputs : Inputs
        The record.
    start, stop : int
        First sample and the one after the last.

    Returns
    -------
    part : Inputs
        That stretch alone.
    """
    rows = slice(start, stop)
    return Inputs(
        inputs.time[rows],
        inputs.velocity[rows],
        inputs.down[rows],
        inputs.wrench[rows],
        inputs.channels[rows],
        inputs.propulsion[rows],
    )


def _adapted(
    plant: Plant,
    matrix: FloatArray,
    error: FloatArray,
    history: list[tuple[float, FloatArray, FloatArray]],
) -> Adapted:
    return Adapted(
        matrix=matrix,
        error=error,
        history_time=np.array([time for time, _, _ in history]),
        history_error=np.array([row for _, row, _ in history]).reshape(-1, 6),
        history_matrix=np.array([table for _, _, table in history]).reshape(-1, plant.n_terms, 6),
    )
