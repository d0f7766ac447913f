"""Delay between commands and velocities, by partial cross-correlation with the acceleration.

The acceleration and the lagged command are regressed on the state (1, v, v|v|, u v) and, except
for yaw, on the downward direction, which weight, buoyancy and righting moments follow; the lag of
largest squared correlation of the residuals is the delay (dead time plus lag). Its standard
deviation is taken over five blocks of the log.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.progress import count_items

# Multiples of the time scale of the motion; a response before its command: different clocks.
_MIN_RELATIVE_LAG, _MAX_RELATIVE_LAG = -0.35, 1.0
_MIN_CHANGES = 4
_MIN_SAMPLES = 60
_MIN_SHARE = 0.03  # of the variance of the acceleration
_SURE_SHARE = 0.1
_MIN_RELATIVE_LEAD = 0.02
_MAX_LEAD_CONFIDENCE = 0.4  # confidence limit of a response before its command
_YAW = 5  # the axis without restoring forces
_N_BLOCKS = 5  # of the log; their delays must agree
_RELATIVE_TOLERANCE = 0.05  # or two steps: tolerated difference of blocks
_MAX_SAMPLES = 20_000  # samples used
_ROUNDING_STEPS = 1e-3  # of a step; times since 1970 are rounded
_MIN_RELATIVE_STEP = 0.006  # a finer grid gains nothing

#: Share of the variance of an acceleration from which a command has an effect.
MIN_RESPONSE_SHARE = 0.05
#: Confidence [%] of a delay from which its velocity and sign are known.
MIN_RESPONSE_CONFIDENCE = 50


@dataclass(frozen=True)
class Delay:
    """Delay between one command and one velocity.

    Attributes
    ----------
    command, velocity : str
        Names of command and velocity.
    seconds : float
        Dead time plus lag [s]; negative if the response precedes the command.
    standard_deviation : float or None
        Over blocks of the log [s]; None if fewer than two blocks determine it.
    share : float
        Share of the variance of the acceleration that the command explains in addition to the
        velocities.
    sign : int
        1 if the velocity increases with the command, -1 if it decreases.
    confidence : int
        Confidence [%].
    """

    command: str
    velocity: str
    seconds: float
    standard_deviation: float | None
    share: float
    sign: int
    confidence: int

    @property
    def is_known(self) -> bool:
        """Whether the command has an effect on whose delay the parts of the log agree."""
        has_effect = self.share >= MIN_RESPONSE_SHARE
        return has_effect and self.confidence >= MIN_RESPONSE_CONFIDENCE


def estimate_delays(log: Log) -> tuple[Delay, ...]:
    """Estimate the delays between commands and velocities.

    Parameters
    ----------
    log : Log
        With commands or a wrench.

    Returns
    -------
    delays : tuple of Delay
        For every command, or axis of the wrench, that moves the vehicle: the delay of the
        velocity whose acceleration it explains best.

    Examples
    --------
    >>> time = np.arange(0.0, 60.0, 0.1)
    >>> rpm = np.sign(np.sin(time))
    >>> surge = 2 - np.abs(((time - 0.5) % (2 * np.pi)) / np.pi - 1)
    >>> found = estimate_delays(Log.from_arrays(time, {"u": surge}, commands={"rpm": rpm}))
    >>> found[0].command, found[0].velocity, round(found[0].seconds, 1)
    ('rpm', 'u', 0.5)
    """
    names, inputs = log.command_names, log.commands
    if log.wrench is not None:
        names, inputs = (*names, *AXES), np.column_stack((inputs, log.wrench))
    if not names:
        return ()
    step, state, commands = resample(log, inputs)
    velocity, down = state[:, :6], state[:, 6:]
    axes = [VELOCITIES.index(name) for name in log.velocity_names]
    columns = count_items(zip(names, commands.T, strict=True), "comparing delays", len(names))
    delays = [
        _estimate_delay(name, command, step, log.time_scale, velocity, down, axes)
        for name, command in columns
    ]
    return tuple(delay for delay in delays if delay is not None)


def resample(log: Log, inputs: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Return step, state and commands on a uniform clock, a NaN row between segments.

    The state is (u v w p q r), and the horizontal components of the downward direction.
    """
    step = max(float(np.median(log.steps)), _MIN_RELATIVE_STEP * log.time_scale)
    values = np.column_stack((log.velocity, log.down[:, :2]))
    states, commands = [], []
    n_remaining = _MAX_SAMPLES
    for start, stop in log.bounds.tolist():
        time = log.time[start:stop]
        grid = np.arange(time[0], time[-1], step)[:n_remaining]
        before = np.searchsorted(time, grid + _ROUNDING_STEPS * step, side="right") - 1
        columns = [np.interp(grid, time, each) for each in values[start:stop].T]
        states += [np.column_stack(columns), np.full((1, 8), np.nan)]
        rows = inputs[start:stop][before]
        commands += [rows, np.full((1, rows.shape[1]), np.nan)]
        n_remaining -= len(grid)
        if n_remaining <= 0:
            break
    return step, np.concatenate(states), np.concatenate(commands)


def _estimate_delay(
    name: str,
    command: FloatArray,
    step: float,
    time_scale: float,
    velocity: FloatArray,
    down: FloatArray,
    axes: list[int],
) -> Delay | None:
    """Return the delay of the axis whose acceleration a command explains best."""
    known = command[np.isfinite(command)]
    if np.count_nonzero(np.diff(known)) < _MIN_CHANGES:
        return None
    relative = time_scale / step
    limits = round(_MIN_RELATIVE_LAG * relative), round(_MAX_RELATIVE_LAG * relative)
    lags = np.arange(limits[0], limits[1] + 1)
    # The command at every lag; NaN outside the log.
    indices = np.arange(len(command))[:, np.newaxis] - lags
    inside = (indices >= 0) & (indices < len(command))
    shifted = np.where(inside, command[np.clip(indices, 0, len(command) - 1)], np.nan)
    acceleration = np.diff(velocity[:, axes], axis=0, append=np.nan) / step
    state = state_regressors(velocity, axes)
    valid = np.isfinite(np.column_stack((acceleration, shifted, state, down))).all(axis=1)
    if len(lags) < 4 or np.count_nonzero(valid) < _MIN_SAMPLES:
        return None
    acceleration, shifted = acceleration[valid], shifted[valid]
    sums = np.maximum(np.sum((acceleration - acceleration.mean(axis=0)) ** 2, axis=0), 1e-30)
    plain = _residuals(state[valid], shifted, acceleration)
    tilted = np.column_stack((state, _varying(down)))
    restored = _residuals(tilted[valid], shifted, acceleration)
    residuals = [plain if axis == _YAW else restored for axis in axes]
    rows = [
        _projections(targets[:, [k]], inputs)[0] for k, (inputs, targets) in enumerate(residuals)
    ]
    projections = np.array(rows) / np.sqrt(sums)[:, np.newaxis]
    axis, lag = np.unravel_index(int(np.argmax(projections**2)), projections.shape)
    share = float(projections[axis, lag] ** 2)
    if share < _MIN_SHARE:
        return None
    seconds = step * _interpolate_peak(projections[axis] ** 2, lags)
    delays = []
    inputs, targets = residuals[axis]
    for block in np.array_split(np.arange(len(targets)), _N_BLOCKS):
        variance = max(sums[axis] * len(block) / len(targets), 1e-30)
        shares = _projections(targets[block][:, [axis]], inputs[block])[0] ** 2 / variance
        if shares.max() > _MIN_SHARE:
            delays.append(step * _interpolate_peak(shares, lags))
    differences = np.abs(np.array(delays) - seconds)
    has_blocks = len(delays) > 1
    agreeing = differences <= max(2 * step, _RELATIVE_TOLERANCE * time_scale)
    agreement = float(np.mean(agreeing)) if has_blocks else 0.5
    confidence = agreement * min(1.0, share / _SURE_SHARE) if 0 < lag < len(lags) - 1 else 0.0
    if seconds < -max(step, _MIN_RELATIVE_LEAD * time_scale):
        confidence = min(confidence, _MAX_LEAD_CONFIDENCE)
    deviation = float(np.std(delays)) if has_blocks else None
    sign = int(np.sign(projections[axis, lag]))
    velocity_name = VELOCITIES[axes[axis]]
    return Delay(name, velocity_name, seconds, deviation, share, sign, round(99 * confidence))


def _residuals(
    state: FloatArray, commands: FloatArray, acceleration: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return commands and accelerations without what the state explains."""
    basis = np.linalg.qr(state)[0]
    inputs, targets = (each - basis @ (basis.T @ each) for each in (commands, acceleration))
    return inputs, targets


def state_regressors(velocity: FloatArray, axes: list[int]) -> FloatArray:
    """Return the state regressors (1, v, v|v|, u v)."""
    values = velocity[:, axes]
    with_speed = values * velocity[:, :1] if 0 in axes else values[:, :0]
    regressors = np.column_stack((values, values * np.abs(values), with_speed))
    return np.column_stack((np.ones(len(values)), _varying(regressors)))


def _varying(columns: FloatArray) -> FloatArray:
    """Return the columns that vary."""
    varies = np.nanstd(columns, axis=0) > 0.0
    return columns[:, varies]


def _projections(targets: FloatArray, inputs: FloatArray) -> FloatArray:
    """Return the projections of accelerations on the command at each lag, (axes, lags)."""
    sizes = np.linalg.norm(inputs, axis=0)
    nonzero = sizes > 1e-9 * max(float(sizes.max()), 1e-30)
    return np.where(nonzero, targets.T @ inputs, 0.0) / np.where(nonzero, sizes, 1.0)


def _interpolate_peak(shares: FloatArray, lags: IntArray) -> float:
    """Return the lag of the peak, by a parabola through the largest share and those next to it."""
    index = int(np.argmax(shares))
    if not 0 < index < len(lags) - 1:
        return float(lags[index])
    before, top, after = shares[index - 1 : index + 2].tolist()
    curvature = before - 2 * top + after
    return float(lags[index]) + (0.5 * (before - after) / curvature if curvature < 0.0 else 0.0)


#: Motion of the vehicle when a velocity increases, and decreases, that changes sign with the axes.
_MOTIONS = {
    "v": ("to starboard", "to port"),
    "w": ("down", "up"),
    "q": ("bow up", "bow down"),
    "r": ("to starboard", "to port"),
}


def list_responses(delays: Sequence[Delay]) -> tuple[str, ...]:
    """Return the motion of the vehicle when a command increases, in the axes of the log."""
    return tuple(
        f"increasing {delay.command} moves the vehicle {_MOTIONS[delay.velocity][delay.sign < 0]}"
        for delay in delays
        if delay.velocity in _MOTIONS and delay.share >= MIN_RESPONSE_SHARE
    )


def wrench_remark(log: Log, delays: Sequence[Delay]) -> Iterator[str]:
    """Yield a remark if no velocity responds to a recorded wrench."""
    driven = log.wrench is not None and bool(np.ptp(log.wrench, axis=0).any())
    responses = [item for item in delays if item.share >= MIN_RESPONSE_SHARE]
    if driven and not any(item.command in AXES for item in responses):
        yield "the motion responds to no axis of the recorded wrench."
