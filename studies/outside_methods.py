"""What a user would pick instead, with NumPy, SciPy and PySINDy: nothing of hydrodamp.

The acceleration of each velocity is ``W φ(x, c)`` with the velocities x and the inputs c: a
polynomial of second order in x, ``x|x|``, and the terms of a vehicle.

- ``numpy-ls``: linear least squares on the accelerations of ``numpy.gradient``;
- ``scipy-oe``: output error by ``scipy.optimize.least_squares`` over windows, from ``numpy-ls``;
- ``filter-error``: maximum likelihood after Jategaonkar (2015), chapter 5: innovations of a filter
  with a constant diagonal gain, estimated with W; output error is the case of no gain;
- ``pysindy``: ``SINDy`` with second-order polynomials in x and c, defaults elsewhere.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

Array = np.ndarray[Any, np.dtype[np.float64]]
Columns = Callable[[Array, Array], Array]

WINDOW, N_WINDOWS, N_ROUNDS, MAX_EVALUATIONS, FIRST_GAIN = 200, 60, 3, 12, 0.1
LIMIT, DIVERGED = 4.0, 50.0  # of a window, relative to the greatest measured velocity; m/s, rad/s


class Run(NamedTuple):
    """Samples: time (n,), velocities (n, k) and inputs (n, m)."""

    time: Array
    velocity: Array
    inputs: Array


class Names(NamedTuple):
    """Names of velocities and inputs, and terms such as ``u*|v|*rudder``."""

    velocities: tuple[str, ...]
    inputs: tuple[str, ...]
    terms: tuple[str, ...]

    def columns(self, velocity: Array, inputs: Array) -> Array:
        """Return φ (..., f) at velocities (..., k) and inputs (..., m)."""
        known = dict(zip((*self.velocities, *self.inputs), _last([velocity, inputs]), strict=True))
        known |= {f"|{name}|": np.abs(value) for name, value in known.items()}
        own = [known[name] for name in self.velocities]
        squares = [a * b for a, b in combinations_with_replacement(own, 2)]
        more = [_product([known[name] for name in term.split("*")]) for term in self.terms]
        found = [np.ones(()), *own, *(x * np.abs(x) for x in own), *squares, *more]
        return np.stack(np.broadcast_arrays(*found), axis=-1)


def _last(parts: list[Array]) -> list[Array]:
    return [part[..., index] for part in parts for index in range(part.shape[-1])]


def _product(factors: list[Array]) -> Array:
    result = factors[0]
    for factor in factors[1:]:
        result = result * factor
    return result


def numpy_ls(runs: Sequence[Run], names: Names) -> Array:
    """Return W (k, f) by least squares on the accelerations."""
    target = np.vstack([np.gradient(run.velocity, run.time, axis=0) for run in runs])
    design = np.vstack([names.columns(run.velocity, run.inputs) for run in runs])
    size = np.linalg.norm(design, axis=0) + 1e-12
    return np.asarray(np.linalg.lstsq(design / size, target, rcond=1e-8)[0].T / size)


def scipy_oe(runs: Sequence[Run], names: Names) -> Array:
    """Return W of the least simulation error over windows."""
    return _minimise(runs, names, has_gain=False)


def filter_error(runs: Sequence[Run], names: Names) -> Array:
    """Return W of the greatest likelihood of the innovations."""
    return _minimise(runs, names, has_gain=True)


def _minimise(runs: Sequence[Run], names: Names, *, has_gain: bool) -> Array:
    windows = _windows(runs)
    start = numpy_ls(runs, names)
    k = len(start)
    limit = LIMIT * np.abs(windows.velocity).max(axis=(0, 1))
    std = windows.velocity.std(axis=(0, 1))
    x = np.concatenate([start.ravel(), np.full(k if has_gain else 0, FIRST_GAIN)])
    bounds = np.full(len(x), np.inf)
    bounds[start.size :] = 1.0
    lower = np.concatenate([-bounds[: start.size], np.zeros(len(x) - start.size)])
    cache: dict[bytes, tuple[Array, Array]] = {}

    def both(x: Array) -> tuple[Array, Array]:
        key = x.tobytes()
        if key not in cache:
            cache.clear()
            gain = x[start.size :] if has_gain else np.zeros(k)
            error, slope = _innovations(x[: start.size].reshape(k, -1), gain, windows, names, limit)
            cache[key] = error, slope[..., : len(x)]
        return cache[key]

    for _ in range(N_ROUNDS):
        weight = 1.0 / std

        def residuals(x: Array, weight: Array = weight) -> Array:
            return np.asarray((both(x)[0] * weight).ravel())

        def jacobian(x: Array, weight: Array = weight) -> Array:
            return np.asarray((both(x)[1] * weight[:, None]).reshape(-1, len(x)))

        x = least_squares(
            residuals, x, jacobian, (lower, bounds), x_scale="jac", max_nfev=MAX_EVALUATIONS
        ).x
        std = np.sqrt(np.mean(both(x)[0] ** 2, axis=(0, 1)))
    return np.asarray(x[: start.size].reshape(k, -1))


def _windows(runs: Sequence[Run]) -> Run:
    """Return windows of equal length, spread over the runs, along a new first axis."""
    n = min(WINDOW, *(len(run.time) for run in runs))
    starts = [(run, i) for run in runs for i in range(0, len(run.time) - n + 1, n)]
    chosen = starts[:: -(-len(starts) // N_WINDOWS)]
    parts = ([each[i : i + n] for each in run] for run, i in chosen)
    return Run(*(np.stack(each) for each in zip(*parts, strict=True)))


def _innovations(
    w: Array, gain: Array, windows: Run, names: Names, limit: Array
) -> tuple[Array, Array]:
    """Return innovations (windows, n - 1, k), and their derivatives by W and the gain."""
    measured, inputs = windows.velocity, windows.inputs
    step = np.diff(windows.time, axis=1)[..., None]
    n_windows, n, k = measured.shape
    x, slope = measured[:, 0], np.zeros((n_windows, k, w.size + k))
    errors, slopes = np.empty((n_windows, n - 1, k)), np.empty((n_windows, n - 1, k, w.size + k))

    def moved(slope: Array, x: Array, at: Array, scale: Array) -> tuple[Array, Array]:
        columns = names.columns(x, at)
        probe = 1e-6 * limit
        near = names.columns(x[:, None] + np.diag(probe), at[:, None])
        by_x = (near - columns[:, None]) @ w.T / probe[:, None]  # (windows, of x, of rate)
        found = by_x.transpose(0, 2, 1) @ slope
        for axis in range(k):
            found[:, axis, axis * w.shape[1] : (axis + 1) * w.shape[1]] += columns
        return scale * (columns @ w.T), scale[..., None] * found

    for i in range(n - 1):
        h = step[:, i]
        rate, change = moved(slope, x, inputs[:, i], h / 2.0)
        middle = np.clip(x + rate, -limit, limit)
        rate, change = moved(slope + change, middle, inputs[:, i], h)
        x, slope = np.clip(x + rate, -limit, limit), slope + change
        error = x - measured[:, i + 1]
        errors[:, i], slopes[:, i] = error, slope
        x, slope = x - gain * error, (1.0 - gain)[:, None] * slope
        slope[:, np.arange(k), w.size + np.arange(k)] -= error
    return errors, slopes


def replay(w: Array, columns: Columns, run: Run) -> Array:
    """Return the velocities (n, k) of an open-loop replay; NaN from where it diverges."""
    result = np.full(run.velocity.shape, np.nan)
    result[0] = x = run.velocity[0]
    for i, h in enumerate(np.diff(run.time)):
        with np.errstate(over="ignore", invalid="ignore"):
            middle = x + h / 2.0 * w @ columns(x, run.inputs[i])
            x = x + h * w @ columns(middle, run.inputs[i])
        if not np.all(np.abs(x) < DIVERGED):
            break
        result[i + 1] = x
    return result


def pysindy(runs: Sequence[Run], names: Names) -> tuple[Array, Columns]:
    """Return coefficients and columns of SINDy with its defaults and second-order polynomials."""
    import pysindy as ps

    model = ps.SINDy(feature_library=ps.PolynomialLibrary(degree=2))
    times, velocities, inputs = (list(each) for each in zip(*runs, strict=True))
    model.fit(velocities, t=times, u=inputs)
    powers = model.feature_library.powers_

    def columns(velocity: Array, inputs: Array) -> Array:
        z = np.concatenate([velocity, inputs])
        return np.asarray(np.prod(z**powers, axis=-1))

    return np.asarray(model.coefficients()), columns


def fit(method: str, runs: Sequence[Run], names: Names) -> tuple[Array, Columns]:
    """Return W and φ by the name of a method."""
    if method == "pysindy":
        return pysindy(runs, names)
    methods = {"numpy-ls": numpy_ls, "scipy-oe": scipy_oe, "filter-error": filter_error}
    return methods[method](runs, names), names.columns


def available() -> tuple[str, ...]:
    """Return the methods whose packages are installed."""
    has_sindy = importlib.util.find_spec("pysindy") is not None
    return ("numpy-ls", "scipy-oe", "filter-error", *(["pysindy"] if has_sindy else []))
