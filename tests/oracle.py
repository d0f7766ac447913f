"""The C core's functions in NumPy, as the equations read: the oracle of the core.

Same names, arguments and results as :mod:`hydrodamp.kernels`, whose docstrings say what they
are; nothing is checked here, and nothing differentiated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from hydrodamp.kernels.core import AdaptationRun, Estimate
from hydrodamp.kernels.plant import FIXED_ATOMS, Inputs

SLOWEST = 1e-6  # m/s; slower speeds count as this where the propulsion ratio divides by one
SLACK = 1e-6  # how much longer than asked a sub-step may be, relative: clocks round


# Atoms and terms (eq. 4) ----------------------------------------------------------------------


def atoms(velocity, down, channels, propulsion_speed):
    """Every atom at one sample or at n of them, atoms first."""
    nu, held = velocity.T, channels.T
    m = len(held)
    table = np.empty((FIXED_ATOMS + 2 * m, *nu.shape[1:]))
    speed = np.sqrt(nu[0] * nu[0] + nu[1] * nu[1] + nu[2] * nu[2])
    crossflow = np.sqrt(nu[1] * nu[1] + nu[2] * nu[2])
    table[0] = 1.0
    table[1:7] = nu
    table[7:13] = np.abs(nu)
    table[13] = speed
    table[14] = crossflow
    table[15] = np.sign(nu[1]) * crossflow
    table[16] = np.sign(nu[2]) * crossflow
    table[17] = propulsion_speed / np.maximum(speed, SLOWEST) - 1.0
    table[18:21] = down.T
    table[21 : 21 + m] = held
    table[21 + m :] = np.abs(held)
    return table


def products(factors, values):
    """The value of every term from those of the atoms."""
    a, b, c, d = values[np.asarray(factors).T]
    return a * b * c * d


def regressor(factors, velocity, down, channels, propulsion_speed):
    """One column a term."""
    return products(factors, atoms(velocity, down, channels, propulsion_speed)).T


# The right-hand side of eq. 1 -----------------------------------------------------------------


def frame(p, nu):
    """H(p) nu = [p1 x w ; p1 x v + p2 x w], rows or one."""
    (p1, p2), (v, w) = ((each[..., :3], each[..., 3:]) for each in (p, nu))
    return np.concatenate([np.cross(p1, w), np.cross(p1, v) + np.cross(p2, w)], axis=-1)


def body_rates(euler, slopes):
    """Body rates of Euler angles and their slopes (Fossen 2021, equation 2.39)."""
    (roll, pitch, _), (droll, dpitch, dyaw) = euler.T, slopes.T
    return np.column_stack(
        (
            droll - dyaw * np.sin(pitch),
            dpitch * np.cos(roll) + dyaw * np.cos(pitch) * np.sin(roll),
            -dpitch * np.sin(roll) + dyaw * np.cos(pitch) * np.cos(roll),
        )
    )


def coriolis(mass_matrix, velocity):
    """H(M nu) nu."""
    return frame(velocity @ mass_matrix.T, velocity)


def inverse_mass(plant):
    """On the free axes; zero on the locked ones."""
    both = np.logical_and.outer(plant.free, plant.free)
    return np.linalg.inv(np.where(both, plant.mass_matrix, np.eye(6))) * both


def acceleration(plant, matrix, velocity, down, wrench, channels, propulsion_speed):
    """M dnu/dt = H(M nu) nu + K xi + wrench, solved on the free axes."""
    nu = np.where(plant.free, velocity, 0.0)
    xi = products(plant.factors, atoms(nu, down, channels, propulsion_speed))
    return inverse_mass(plant) @ (coriolis(plant.mass_matrix, nu[None])[0] + xi @ matrix + wrench)


# Replay by RK4 --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Motion:
    """What is integrated: velocity and, where simulated, quaternion."""

    plant: object
    matrix: np.ndarray
    inputs: Inputs
    down: object  # a function of time

    def driven(self, k, fraction, state):
        """Velocity, down, wrench, channels, u_c between sample k and the next."""
        inputs = self.inputs
        wrench = inputs.wrench[k] + fraction * (inputs.wrench[k + 1] - inputs.wrench[k])
        time = inputs.time[k] + fraction * (inputs.time[k + 1] - inputs.time[k])
        down = down_of(state[6:]) if len(state) == 10 else self.down(time)
        return state[:6], down, wrench, inputs.channels[k], inputs.propulsion[k, 0]

    def rate(self, k, fraction, state):
        """The derivative of the state over time."""
        moving = acceleration(self.plant, self.matrix, *self.driven(k, fraction, state))
        return np.r_[moving, quaternion_rate(state[6:], state[3:6])] if len(state) == 10 else moving

    def step(self, k, i, n, state):
        """One RK4 step, sub-step i of n."""
        h = (self.inputs.time[k + 1] - self.inputs.time[k]) / n
        rates = [np.zeros_like(state)]
        for reach in (0.0, 0.5, 0.5, 1.0):
            rates.append(self.rate(k, (i + reach) / n, state + reach * h * rates[-1]))
        _, k1, k2, k3, k4 = rates
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        if len(state) == 10:
            state[6:] /= np.linalg.norm(state[6:])
        return state


def replay(plant, matrix, inputs, segments, attitude=None, max_step=0.05, limit=50.0):
    """Velocity, and where each segment diverged."""
    velocity = np.full((inputs.n, 6), np.nan)
    diverged_at = np.full(len(segments), -1)
    for s, (start, stop) in enumerate(np.asarray(segments).tolist()):
        time, down = inputs.time[start:stop], inputs.down[start:stop]
        spline = CubicHermiteSpline(time, down, inputs.down_slope[start:stop])
        motion = Motion(plant, matrix, inputs, spline)
        state = np.where(plant.free, inputs.velocity[start], 0.0)
        if attitude is not None:
            state = np.r_[state, attitude[start] / np.linalg.norm(attitude[start])]
        for k in range(start, stop):
            if k > start:
                ratio = (inputs.time[k] - inputs.time[k - 1]) / max_step * (1.0 - SLACK)
                n = max(int(np.ceil(ratio)), 1)
                for i in range(n):
                    state = motion.step(k - 1, i, n, state)
            if not np.all(np.abs(state[:6]) <= limit):
                diverged_at[s] = k
                break
            velocity[k] = state[:6]
    return velocity, diverged_at


def down_of(q):
    """R(q)^T e3 of a quaternion w x y z, body to world."""
    w, x, y, z = q
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z])


def quaternion_rate(q, omega):
    """dq/dt = 1/2 q (0, omega)."""
    w, x, y, z = q
    return 0.5 * np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]) @ omega


# Steps between samples, and the estimators on them --------------------------------------------


@dataclass(frozen=True)
class Steps:
    """What the steps between n samples need, each a row."""

    h: np.ndarray
    xi: np.ndarray  # mean of the terms at both ends, channels held from the first
    forcing: np.ndarray  # mean of H(M nu) nu plus the recorded wrench
    gain: np.ndarray  # M (nu_{k+1} - nu_k), the momentum gained


def steps_between(plant, inputs):
    """Turn the samples of a segment into steps."""
    nu = np.where(plant.free, inputs.velocity, 0.0)
    held, speed = inputs.channels[:-1], inputs.propulsion
    first = regressor(plant.factors, nu[:-1], inputs.down[:-1], held, speed[:-1, 0])
    last = regressor(plant.factors, nu[1:], inputs.down[1:], held, speed[1:, 1])
    known = coriolis(plant.mass_matrix, nu) + inputs.wrench
    return Steps(
        h=np.diff(inputs.time),
        xi=0.5 * (first + last),
        forcing=0.5 * (known[:-1] + known[1:]),
        gain=np.diff(nu, axis=0) @ plant.mass_matrix.T,
    )


def midpoint(gains, matrix, error, steps, k):
    """The implicit midpoint step of eqs. 15-16."""
    plant, h, xi = gains.plant, steps.h[k], steps.xi[k]
    left = 2.0 / h * plant.mass_matrix + np.diag(gains.a + 0.5 * h * (xi * xi) @ gains.gamma)
    right = 2.0 / h * (plant.mass_matrix @ error) + steps.forcing[k] + xi @ matrix
    right = right - steps.gain[k] / h
    both = np.logical_and.outer(plant.free, plant.free)
    d = np.linalg.solve(np.where(both, left, np.eye(6)), np.where(plant.free, right, 0.0))
    return matrix - h * gains.gamma * np.outer(xi, d), 2.0 * d - error


def adapt(gains, matrix, inputs, segments, passes=1, every=0):
    """The fold of adapt_step over a record."""
    error, count, kept = np.zeros(6), 0, []
    for start, stop in np.asarray(segments).tolist() * passes:
        error, steps = np.zeros(6), steps_between(gains.plant, inputs.select(slice(start, stop)))
        for k in range(stop - start - 1):
            matrix, error = midpoint(gains, matrix, error, steps, k)
            count += 1
            if every and count % every == 0:
                kept.append((inputs.time[start + k + 1], error, matrix))
    time, errors, tables = zip(*kept, strict=True) if kept else ((), (), ())
    return AdaptationRun(matrix, error, np.array(time), np.array(errors), np.array(tables))


def hats(recursion, steps):
    """Yield the rows of a stretch: sums under hats, up over a block and down over the next."""
    h, time, edges = steps.h[:, None], np.cumsum(steps.h), [0.0]
    for length, end in zip(steps.h, time, strict=True):
        if end - edges[-1] + length / 2.0 >= recursion.block:
            edges.append(end)
    known = steps.forcing + steps.xi @ recursion.known
    parts = np.hstack([h * steps.xi, steps.gain - h * known])
    for edge in zip(edges, edges[1:], edges[2:], strict=False):
        yield np.interp(time - steps.h / 2.0, edge, [0.0, 1.0, 0.0]) @ parts


def absorb(recursion, estimate, row):
    """Take in a row: S <- S - r S phi phi'S / (phi'S phi) + phi phi'.

    0 <= S <= c I with c = max(1, max |phi|^2 / forgetting), whatever the rows. For let
    S = c I - E with E >= 0; for any x, c x.phi = x'S phi + x'E phi, and by Cauchy's inequality
    twice (c x.phi)^2 <= (r (x'S phi)^2 / phi'S phi + x'E x) (phi'S phi / r + phi'E phi), whose
    last factor is at most c |phi|^2 / r <= c^2. The decomposition is that of Cao and Schwartz,
    Automatica 36 (2000) 1725.
    """
    kappa, information, noise, rows, iv_state = map(np.array, estimate)
    for axis in range(6):
        block, matrix = recursion.axis_block(axis, information)
        if block.start == block.stop:
            continue
        unit, terms = recursion.unit[block], row[recursion.rows[block]]
        innovation, phi = row[len(recursion.known) + axis] - kappa[block] @ terms, unit * terms
        information_along, eye = phi @ matrix @ phi, np.eye(len(phi))
        state = iv_state[recursion.iv_offsets[axis] : recursion.iv_offsets[axis + 1]]
        if information_along > 0.0:
            share = min(recursion.forgetting, 2.0 * (phi @ np.linalg.solve(eye + matrix, phi)))
            factor = (1.0 - np.sqrt(1.0 - share)) / information_along
            forgetting = eye - factor * np.outer(matrix @ phi, phi)
            moments = state[9 + len(phi) :][: len(phi) ** 2].reshape(eye.shape)
            moments[:] = forgetting @ moments @ forgetting.T
            matrix -= share / information_along * np.outer(matrix @ phi, matrix @ phi)
        gain = np.linalg.solve(eye + matrix, phi)
        matrix += np.outer(phi, phi)
        leverage = phi @ gain
        kappa[block] += unit * gain * (innovation / (1.0 + leverage))
        rows[axis] += 1.0
        weight = max(3.0 / (rows[axis] + 2.0), recursion.forgetting)
        noise[axis] += weight * (innovation**2 / (1.0 + leverage) - noise[axis])
        target = row[len(recursion.known) + axis]
        update_instruments(state, phi, target, innovation / np.sqrt(1.0 + leverage), weight)
    return Estimate(kappa, information, noise, rows, iv_state)


def update_instruments(state, phi, target, innovation, weight):
    """Take a row in: lag products of innovations, and an estimate by instruments 3 rows away."""
    n, count = len(phi), int(state[0])
    estimate, moments = state[9 : 9 + n], state[9 + n : 9 + n + n * n].reshape(n, n)
    rows = state[9 + n + n * n :].reshape(7, n + 1)
    known = min(count, 4)
    state[5 : 5 + known] += weight * (innovation * state[1 : 1 + known] - state[5 : 5 + known])
    state[1:5] = np.append(innovation, state[1:4])
    rows[:] = np.vstack([[*phi, target], rows[:6]])
    state[0] = min(count + 1, 7)
    if count < 3:
        return
    middle, instruments = rows[3, :n], rows[0, :n] + (count >= 6) * rows[6, :n]
    moments += np.outer(instruments, middle)
    gain = np.linalg.solve(moments + np.eye(n), instruments)
    estimate += gain * (rows[3, n] - middle @ estimate)


def recur(recursion, estimate, inputs, segments):
    """Take in the rows of every segment."""
    estimate = estimate._replace(iv_state=estimate.iv_state.copy())
    for start, stop in np.asarray(segments).tolist():
        estimate.iv_state[recursion.iv_offsets[:-1]] = 0.0
        for row in hats(
            recursion, steps_between(recursion.plant, inputs.select(slice(start, stop)))
        ):
            estimate = absorb(recursion, estimate, row)
    return estimate
