"""The current, estimated from a log alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.conditioning.current_rows import (
    TEN_MINUTES,
    beforehand,
    placed_knots,
    turned,
    under_way,
    way_and_current,
)
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

LARGEST_ERROR = 0.1
"""Standard error [m/s] beyond which a current is not determined."""

LEAST_TURNED = 0.05
"""Headings that differ less do not tell a current: they lie within some 20 degrees."""

_HUBER = 1.345  # robust standard deviations; 95 % efficient under normal noise
_ROUNDS = 15
_TINY = 1e-4  # m/s; no Doppler log is better
_BLOCKS = (7.5, 15.0, 30.0, 60.0, 120.0, 240.0)  # s; one of them longer than correlations
_LEAST_BLOCKS = 10


@dataclass(frozen=True, eq=False)
class Current:
    """The horizontal velocity of the water over ground, linear between knots.

    Attributes
    ----------
    time : ndarray, shape (k,)
        The knots, counted as :attr:`Log.elapsed <hydrodamp.data.log.Log.elapsed>` [s].
    velocity : ndarray, shape (k, 2)
        Towards north and east [m/s].
    standard_error : ndarray, shape (k, 2)
        Of each number [m/s].
    turned : float
        How far headings differ: one less the length of the mean of their unit vectors. Zero
        is one heading, 0.3 two at right angles, 1 there and back.

    Examples
    --------
    >>> tide = Current([0.0, 100.0], [[0.0, 0.1], [0.0, 0.3]], np.zeros((2, 2)))
    >>> tide.at([50.0]).round(3).tolist()
    [[0.0, 0.2]]
    """

    time: FloatArray
    velocity: FloatArray
    standard_error: FloatArray
    turned: float = 1.0

    def __post_init__(self) -> None:
        """Copy the arrays at the door."""
        object.__setattr__(self, "time", frozen(self.time, (None,), "time"))
        for name in ("velocity", "standard_error"):
            block = frozen(getattr(self, name), (len(self.time), 2), name)
            object.__setattr__(self, name, block)

    @property
    def determined(self) -> bool:
        """Whether headings differ enough and no standard error is too large."""
        small = bool(self.standard_error.max() <= LARGEST_ERROR)
        return small and self.turned >= LEAST_TURNED

    def at(self, elapsed: npt.ArrayLike) -> FloatArray:
        """Return the current at some times.

        Parameters
        ----------
        elapsed : array_like, shape (n,)
            Counted as the knots [s].

        Returns
        -------
        velocity : ndarray, shape (n, 2)
            Towards north and east [m/s]; constant before the first knot and after the last.
        """
        times: FloatArray = np.asarray(elapsed, dtype=np.float64)
        return np.column_stack([np.interp(times, self.time, part) for part in self.velocity.T])

    def __str__(self) -> str:
        """Return a line a knot, twelve at most."""
        lines = ["    time [s]  north [m/s]   east [m/s]"]
        for row in np.unique(np.linspace(0, len(self.time) - 1, 12).astype(int)).tolist():
            pairs = zip(self.velocity[row], self.standard_error[row], strict=True)
            told = "  ".join(f"{value:6.3f}±{error:.3f}" for value, error in pairs)
            lines.append(f"{self.time[row]:12.6g} {told}")
        return "\n".join(lines)


def estimate_current(
    log: Log,
    *,
    commands: Sequence[str] | None = None,
    spacing: float = TEN_MINUTES,
    drift: float = 0.05,
) -> Current:
    """Estimate the current of a log from the way its vehicle makes over ground.

    Parameters
    ----------
    log : Log
        With u and v over ground, an attitude, and courses on several headings.
    commands : sequence of str, optional
        Those that speed and drift may depend on; all that vary where not given.
    spacing : float, optional
        Time from knot to knot, about [s].
    drift : float, optional
        How much the current is likely to change in ten minutes [m/s]; zero for a constant
        current.

    Returns
    -------
    current : Current
        Look at its standard errors: along a single heading there is no telling a current
        from a faster vehicle.

    Raises
    ------
    LogError
        If a channel is lacking, the vehicle never gets under way, or a setting cannot be.

    Examples
    --------
    >>> time = np.arange(0.0, 400.0)
    >>> yaw = np.where(time < 200, 0.0, np.pi / 2)
    >>> log = Log.from_arrays(
    ...     time, {"u": 1.5 + 0.2 * np.cos(yaw), "v": -0.2 * np.sin(yaw)},
    ...     attitude=np.outer(yaw, (0, 0, 1)),
    ... )
    >>> estimate_current(log, drift=0).velocity[:, 0].round(3).tolist()
    [0.2]
    """
    _refuse(log, spacing, drift)
    assert log.attitude is not None
    rows = under_way(log)
    knots = placed_knots(log, spacing if drift > 0 else np.inf)
    design = way_and_current(log, rows, knots, commands)
    prior = beforehand(design, knots, float(np.median(log.velocity[rows, 0])), drift)
    measured = log.velocity[rows, :2].T
    elapsed = log.elapsed[rows]
    weight = np.full(measured.shape, 1.0 / np.maximum(np.var(measured, axis=1), _TINY**2)[:, None])
    for _ in range(_ROUNDS):
        weighted = design.matrix.multiply(weight.reshape(-1, 1))
        information = (design.matrix.T @ weighted).toarray() + prior
        estimate = np.linalg.solve(information, weighted.T @ measured.ravel())
        rest = measured - (design.matrix @ estimate).reshape(2, -1)
        weight = np.array([_weights(one, elapsed) for one in rest])
    covariance = np.linalg.inv(information)
    errors = np.sqrt(covariance.diagonal()[design.n_way :]).reshape(2, -1).T
    found = estimate[design.n_way :].reshape(2, -1).T
    return Current(knots, found, errors, turned(log.attitude[rows]))


def _refuse(log: Log, spacing: float, drift: float) -> None:
    faults = [
        f"there is no velocity `{name}`; a current is told from u and v on several headings"
        for name in ("u", "v")
        if name not in log.velocity_names
    ]
    if log.attitude is None:
        faults.append("there is no attitude; a current is told from u and v on several headings")
    if not (spacing > 0 and np.isfinite(drift) and drift >= 0):
        faults.append(
            f"`spacing` must be positive [s] and `drift` zero or positive [m/s]; got {spacing:g}"
            f" and {drift:g}"
        )
    if faults:
        raise LogError(faults, source=log.source)


def _weights(rest: FloatArray, elapsed: FloatArray) -> FloatArray:
    """Return Huber's weights over the variance that residuals as long as these have."""
    spread = max(1.4826 * float(np.median(np.abs(rest))), _TINY)
    huber = np.minimum(1.0, _HUBER * spread / np.maximum(np.abs(rest), _TINY))
    length = max(_length(huber * rest, elapsed, block) for block in _BLOCKS) / spread**2
    weights: FloatArray = huber / (spread**2 * max(length, 1.0))
    return weights


def _length(rest: FloatArray, elapsed: FloatArray, block: float) -> float:
    """Return the variance that independent residuals would have whose sums vary as these."""
    _, number, count = np.unique(elapsed // block, return_inverse=True, return_counts=True)
    if len(count) < _LEAST_BLOCKS:
        return 0.0
    return float(np.mean(np.bincount(number, weights=rest) ** 2) / np.mean(count))
