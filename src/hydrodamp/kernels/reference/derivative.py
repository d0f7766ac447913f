"""Forward sensitivities: the derivative of exactly the RK4 step that replay takes."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IndexArray, IntArray
from hydrodamp.kernels.arguments import coefficients, floats, matching, places, positive, spans
from hydrodamp.kernels.inputs import Inputs
from hydrodamp.kernels.plant import Plant
from hydrodamp.kernels.reference.atoms import atom_slopes, atoms
from hydrodamp.kernels.reference.integration import (
    Interval,
    down_of,
    initial_state,
    quaternion_columns,
    state_rate,
)
from hydrodamp.kernels.reference.motion import cross
from hydrodamp.kernels.reference.products import products


def sensitivities(
    plant: Plant,
    matrix: FloatArray,
    parameters: IndexArray,
    inputs: Inputs,
    segments: IntArray,
    attitude: FloatArray | None = None,
    max_step: float = 0.05,
    limit: float = 50.0,
) -> tuple[FloatArray, FloatArray]:
    """Replay, and differentiate the replay on coefficients and initial velocity.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    matrix : ndarray, shape (n_terms, 6)
        Coefficients, one row a term; the transpose of the paper's K.
    parameters : ndarray of int32, shape (p, 2)
        Row and column in ``matrix`` of each coefficient to differentiate on.
    inputs, segments, attitude, max_step, limit
        As in :func:`hydrodamp.kernels.replay`.

    Returns
    -------
    velocity : ndarray, shape (n, 6)
        Simulated velocity [m/s, rad/s]; NaN where diverged or outside segments.
    jacobian : ndarray, shape (n, 6, p + 6)
        Derivative of the velocity on the p coefficients, then on the six
        velocities at the segment's first sample. NaN where the velocity is.

    Raises
    ------
    ProblemError
        If shapes do not agree, a place does not exist or a setting is not positive.

    Examples
    --------
    >>> plant = Plant(np.eye(6), [True] * 6, [[1, 0, 0, 0]], 0)
    >>> decay = np.array([[-1.0, 0, 0, 0, 0, 0]])
    >>> rest = [np.zeros((2, width)) for width in (3, 6, 0, 2)]
    >>> inputs = Inputs([0.0, 1.0], [[1.0, 0, 0, 0, 0, 0]] * 2, *rest)
    >>> _, jacobian = sensitivities(plant, decay, [[0, 0]], inputs, np.array([[0, 2]]))
    >>> jacobian[1, 0, :2].round(5).tolist()
    [0.36788, 0.36788]
    """
    table = coefficients(plant, matrix)
    matching(plant, inputs)
    chosen = places(plant, parameters)
    rows = spans(segments, inputs.n)
    poses = None if attitude is None else floats(attitude, (inputs.n, 4), "attitude")
    positive(max_step, "max_step")
    positive(limit, "limit")
    velocity = np.full((inputs.n, 6), np.nan)
    jacobian = np.full((inputs.n, 6, len(chosen) + 6), np.nan)
    with np.errstate(all="ignore"):
        for start, stop in rows.tolist():
            state = initial_state(plant, inputs, poses, start)
            slope = initial_slope(plant.free, len(state), len(chosen))
            for k in range(start, stop):
                if k > start:
                    interval = Interval(inputs, k - 1)
                    state, slope = step_with_slope(
                        plant, table, chosen, interval, state, slope, max_step
                    )
                if not np.all(np.abs(state[:6]) <= limit):
                    break
                velocity[k] = state[:6]
                jacobian[k] = slope[:6]
    return velocity, jacobian


def initial_slope(free: BoolArray, n_states: int, n_parameters: int) -> FloatArray:
    """Return the derivative of the initial state: the identity on free velocities.

    Parameters
    ----------
    free : ndarray of bool, shape (6,)
        The axes that move.
    n_states, n_parameters : int
        6 or 10 states; p coefficients.

    Returns
    -------
    slope : ndarray, shape (n_states, p + 6)
        Rows are states.
    """
    slope = np.zeros((n_states, n_parameters + 6))
    slope[:6, n_parameters:] = np.diag(free.astype(np.float64))
    return slope


def step_with_slope(
    plant: Plant,
    matrix: FloatArray,
    parameters: IndexArray,
    interval: Interval,
    state: FloatArray,
    slope: FloatArray,
    max_step: float,
) -> tuple[FloatArray, FloatArray]:
    """Integrate state and slope from one sample to the next.

    Parameters
    ----------
    plant, matrix, parameters
        See :func:`sensitivities`.
    interval : Interval
        The inputs between the samples.
    state, slope : ndarray
        At the first.
    max_step : float
        No sub-step is longer [s].

    Returns
    -------
    state, slope : ndarray
        At the second.
    """
    n = interval.steps(max_step)
    h = interval.length / n
    inverse_mass = np.asarray(np.linalg.inv(plant.effective_mass), dtype=np.float64)

    def rates(x: FloatArray, dx: FloatArray, at: float) -> tuple[FloatArray, FloatArray]:
        rate = state_rate(plant, inverse_mass, matrix, interval, x, at)
        by_state, by_coefficient = rate_slopes(
            plant, inverse_mass, matrix, parameters, interval, x, at
        )
        drate = by_state @ dx
        drate[:6, : len(parameters)] += by_coefficient
        return rate, drate

    for i in range(n):
        k1, s1 = rates(state, slope, i / n)
        k2, s2 = rates(state + 0.5 * h * k1, slope + 0.5 * h * s1, (i + 0.5) / n)
        k3, s3 = rates(state + 0.5 * h * k2, slope + 0.5 * h * s2, (i + 0.5) / n)
        k4, s4 = rates(state + h * k3, slope + h * s3, (i + 1) / n)
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        slope = slope + h / 6.0 * (s1 + 2.0 * s2 + 2.0 * s3 + s4)
        if len(state) == 10:
            length = np.linalg.norm(state[6:])
            q = state[6:] / length
            slope[6:] = (slope[6:] - np.outer(q, q @ slope[6:])) / length
            state[6:] = q
    return state, slope


def rate_slopes(
    plant: Plant,
    inverse_mass: FloatArray,
    matrix: FloatArray,
    parameters: IndexArray,
    interval: Interval,
    state: FloatArray,
    fraction: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the derivative of the state's rate on the state and on the coefficients.

    Parameters
    ----------
    plant, inverse_mass, matrix, interval, state, fraction
        As for :func:`hydrodamp.kernels.reference.integration.state_rate`.
    parameters : ndarray of int32, shape (p, 2)
        Row and column of each coefficient.

    Returns
    -------
    by_state : ndarray, shape (n_states, n_states)
        Rows are rates.
    by_coefficient : ndarray, shape (6, p)
        Of the acceleration.
    """
    nu, q = state[:6], state[6:]
    down = down_of(q) if len(q) else interval.down(fraction)
    speed = float(interval.inputs.propulsion[interval.k, 0])
    values = atoms(nu, down, interval.inputs.channels[interval.k], speed)
    by_atom = atom_weights(plant.factors, values, matrix)
    solve = inverse_mass * plant.free
    force = by_atom.T @ atom_slopes(nu, speed, plant.n_channels)
    force += coriolis_slope(plant.mass_matrix, nu)
    by_state = np.zeros((len(state), len(state)))
    by_state[:6, :6] = solve @ force
    if len(q):
        by_state[:6, 6:] = solve @ by_atom[18:21].T @ down_slope(q)
        by_state[6:, 3:6] = 0.5 * quaternion_columns(q)
        by_state[6:, 6:] = 0.5 * quaternion_matrix(nu[3:])
    term, axis = parameters.T
    return by_state, solve[:, axis] * products(plant.factors, values)[term]


def atom_weights(factors: IndexArray, values: FloatArray, matrix: FloatArray) -> FloatArray:
    """Return the derivative of the damping wrench on every atom, by the product rule.

    Parameters
    ----------
    factors : ndarray of int32, shape (n_terms, 4)
        The atoms of every term.
    values : ndarray, shape (n_atoms,)
        Every atom.
    matrix : ndarray, shape (n_terms, 6)
        Coefficients.

    Returns
    -------
    weights : ndarray, shape (n_atoms, 6)
        Rows are atoms, columns axes.
    """
    weights = np.zeros((len(values), 6))
    chosen = values[factors]
    for place in range(4):
        others = np.delete(chosen, place, axis=1).prod(axis=1)
        np.add.at(weights, factors[:, place], others[:, None] * matrix)
    return weights


def coriolis_slope(mass_matrix: FloatArray, nu: FloatArray) -> FloatArray:
    """Return the derivative of H(M nu) nu on the velocity.

    Parameters
    ----------
    mass_matrix : ndarray, shape (6, 6)
        Rigid body plus added mass. Its columns are the momentum's derivatives.
    nu : ndarray, shape (6,)
        Velocity.

    Returns
    -------
    slope : ndarray, shape (6, 6)
        Rows are axes, columns velocities.
    """
    p, dp, unit = mass_matrix @ nu, mass_matrix, np.eye(6)
    force = cross(dp[:3], nu[3:]) + cross(p[:3], unit[3:])
    moment = (
        cross(dp[:3], nu[:3])
        + cross(p[:3], unit[:3])
        + cross(dp[3:], nu[3:])
        + cross(p[3:], unit[3:])
    )
    return np.concatenate([force, moment])


def down_slope(q: FloatArray) -> FloatArray:
    """Return the derivative of R(q)^T e3 on the quaternion.

    Parameters
    ----------
    q : ndarray, shape (4,)
        Quaternion w x y z, body to world.

    Returns
    -------
    slope : ndarray, shape (3, 4)
        Rows are components of the down vector.
    """
    w, x, y, z = q
    return 2.0 * np.array([[-y, z, -w, x], [x, w, z, y], [w, -x, -y, z]])


def quaternion_matrix(omega: FloatArray) -> FloatArray:
    """Return twice the derivative of dq/dt on the quaternion.

    Parameters
    ----------
    omega : ndarray, shape (3,)
        p q r [rad/s], body frame.

    Returns
    -------
    matrix : ndarray, shape (4, 4)
        Skew-symmetric.
    """
    p, q, r = omega
    return np.array([[0, -p, -q, -r], [p, 0, r, -q], [q, -r, 0, p], [r, q, -p, 0]])
