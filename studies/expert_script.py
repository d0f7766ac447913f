"""What an engineer writes in an hour: accelerations fitted without mass matrix or vehicle file.

On each axis the acceleration is a sum of products: commands (or the wrench), its own velocity,
linear and quadratic, products of velocities, restoring, and a constant. A regression of integrals
over a second gives first coefficients; a robust minimisation of simulation errors follows, over
windows of four correlation times.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.data.time_scale import motion_time_scale

PRODUCTS = "vr wq", "ur wp uv", "uq vp uw", "v", "u uw", "v uv ur"
TILT = 0, 1, None, 1, 0, None  # component of the direction of gravity in the restoring force
ACROSS = 1, 2, 4, 5  # axes on which a command may act as a fin
INTERVAL, WINDOW_STEPS, MAX_WINDOWS, MAX_EVALUATIONS = 1.0, (20, 250), 120, 12  # s; steps; counts


class Series(NamedTuple):
    """Samples (..., n) without gaps; velocity, inputs and direction of gravity by axis."""

    time: FloatArray
    velocity: FloatArray
    inputs: FloatArray
    down: FloatArray


def split_series(log: Log) -> list[Series]:
    """Return the segments of a log, with zero for missing values."""
    inputs = log.commands if log.wrench is None else log.wrench
    down = np.zeros((log.n, 3)) if log.attitude is None else log.down
    whole = [np.nan_to_num(each).T for each in (log.time, log.velocity, inputs, down)]
    return [Series(*(each[..., start:stop] for each in whole)) for start, stop in log.bounds]


class Script(NamedTuple):
    """Free axes, whether inputs are a wrench or act as fins too, and the greatest velocities."""

    axes: list[int]
    has_wrench: bool
    has_fins: bool
    limit: FloatArray

    def features(self, axis: int, velocity: FloatArray, *more: FloatArray) -> list[FloatArray]:
        """Return the features of an axis at velocities (6, ...), inputs and down."""
        (inputs, down), own, surge = more, velocity[axis], np.abs(velocity[0])
        by_name = dict(zip("uvwpqr", velocity, strict=True))
        found = [own, own * np.abs(own), surge * own, np.ones_like(own)]
        found += [np.prod([by_name[x] for x in pair], axis=0) for pair in PRODUCTS[axis].split()]
        found += [inputs[axis]] if self.has_wrench else [*inputs]
        found += [each * surge**2 for each in inputs] * (self.has_fins and axis in ACROSS)
        return found if (tilt := TILT[axis]) is None else [*found, down[tilt]]

    def regress(self, log: Log, axis: int) -> FloatArray:
        """Return coefficients by a regression of integrals, shrunk by a thousandth."""
        n, rows = max(round(INTERVAL / np.median(log.steps)), 2), []
        for time, velocity, *more in split_series(log):
            features = np.stack(self.features(axis, velocity, *more))
            area = np.cumsum((features[:, 1:] + features[:, :-1]) / 2 * np.diff(time), axis=1)
            integral = np.vstack([np.pad(area, ((0, 0), (1, 0))), velocity[axis]])
            rows.append((integral[:, n:] - integral[:, :-n]).T)
        *columns, target = np.vstack(rows).T
        size = np.linalg.norm(columns, axis=1) + 1e-12  # of a feature that never acts: none
        matrix = np.vstack([np.transpose(columns) / size, 1e-3 * np.eye(len(size))])
        return np.asarray(np.linalg.lstsq(matrix, np.append(target, 0 * size))[0] / size)

    def simulate(self, coefficients: list[FloatArray], of: Series) -> FloatArray:
        """Return velocities (6, p, w, n) by p sets of coefficients (k, p) over w windows."""
        p, limit, half = coefficients[0].shape[1], self.limit[:, None, None], np.diff(of.time) / 2
        result = np.repeat(of.velocity[:, None], p, axis=1)

        def rate(x: FloatArray, i: int) -> FloatArray:
            value = np.zeros_like(x)
            for axis, part in zip(self.axes, coefficients, strict=True):
                features = self.features(axis, x, of.inputs[..., i], of.down[..., i])
                value[axis] = sum(a[:, None] * b for a, b in zip(part, features, strict=True))
            return value

        for i in range(half.shape[-1]):
            x, h = result[..., i], half[:, i]
            for _ in range(2):  # Heun steps
                slope = rate(x, i)
                x = x + h / 2 * (slope + rate(np.clip(x + h * slope, -limit, limit), i))
                x = np.clip(x, -limit, limit)
            result[self.axes, ..., i + 1] = x[self.axes]
        return result


def stack_windows(log: Log, axes: list[int]) -> Series | None:
    """Return windows of four correlation times, spread over a log; None if it is shorter."""
    start = np.array([[0, min(log.n, 4000)]])
    scale = motion_time_scale(log.time, log.velocity[:, axes], start) / np.median(log.steps)
    n, runs = int(np.clip(4 * scale, *WINDOW_STEPS)), split_series(log)
    starts = [(run, i) for run in runs for i in range(0, len(run.time) - n, n)]
    stride = max(1, log.n // n // MAX_WINDOWS)
    windows = [[each[..., i : i + n] for each in run] for run, i in starts[::stride]]
    return Series(*(np.stack(x, axis=-2) for x in zip(*windows, strict=True))) if windows else None


def replay_script(train: Log, test: Log, axes: list[int], *, has_fins: bool) -> FloatArray:
    """Identify from one log and return the velocity (n, 6) of an open-loop replay of another."""
    recorded = np.nan_to_num(train.velocity).T
    limit, has_wrench = 4 * np.abs(recorded).max(axis=1) + 1e-9, train.wrench is not None
    script = Script(axes, has_wrench, has_fins, limit)
    first = [script.regress(train, axis) for axis in axes]
    cuts, best = np.cumsum([len(part) for part in first])[:-1], np.concatenate(first)
    if (windows := stack_windows(train, axes)) is not None:
        std = recorded[axes].std(axis=1)[:, None, None, None]

        def residuals(x: FloatArray) -> FloatArray:
            error = script.simulate(np.split(x, cuts), windows) - windows.velocity[:, None]
            by_set = np.moveaxis(error[axes] / std, 1, -1)
            return np.asarray(by_set.reshape(-1, x.shape[1]))

        def residual(x: FloatArray) -> FloatArray:
            return residuals(x[:, None])[:, 0]

        def jacobian(x: FloatArray) -> FloatArray:
            probe = np.sqrt(np.finfo(float).eps) * np.maximum(1.0, np.abs(x))
            found = residuals(np.column_stack([x, x[:, None] + np.diag(probe)]))
            return np.asarray((found[:, 1:] - found[:, :1]) / probe)

        best = least_squares(
            residual,
            best,
            jacobian,
            loss="soft_l1",
            f_scale=0.5,
            max_nfev=MAX_EVALUATIONS,
            x_scale=np.maximum(np.abs(best), 1e-3 * np.abs(best).max()),
        ).x
    alone = (Series(*(each[..., None, :] for each in run)) for run in split_series(test))
    coefficients = np.split(best[:, None], cuts)
    return np.hstack([script.simulate(coefficients, run)[:, 0, 0] for run in alone]).T
