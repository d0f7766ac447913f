"""How late a vehicle answers its commands, from steps of the commands and what follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.progress import count_items

_MIN_LAG_S, _MAX_LAG_S = -0.6, 3.0  # s; an answer before its command means that clocks differ
_MIN_CHANGES = 4
_MIN_SAMPLES = 60
_MIN_SHARE = 0.03  # of the variance of the growth
_SURE_SHARE = 0.1
_MIN_LEAD_S = 0.05  # s
_MAX_LEAD_CONFIDENCE = 0.4  # at most, that an answer before its command is a delay
_N_BLOCKS = 5  # of the log; their delays must agree
_BLOCK_TOLERANCE_S = 0.15  # s, that parts may differ by; or two steps
_MAX_SAMPLES = 20_000  # samples that are looked at
_ROUNDING_STEPS = 1e-3  # of a step; times counted from 1970 are rounded
_MIN_STEP_S = 0.02  # s, a step below which nothing is gained


@dataclass(frozen=True)
class Delay:
    """How late one velocity answers one command.

    Attributes
    ----------
    command, velocity : str
        Which.
    seconds : float
        Dead time and lag together [s]; negative where the answer comes first.
    spread : float or None
        Standard deviation among parts of the log [s]; None where one part alone tells.
    share : float
        Of the variance of the growth of the velocity that the command explains beyond what the
        velocities do.
    sense : int
        1 where the velocity grows with the command, -1 where it falls.
    confidence : int
        [%].
    """

    command: str
    velocity: str
    seconds: float
    standard_deviation: float | None
    share: float
    sign: int
    confidence: int


def estimate_delays(log: Log) -> tuple[Delay, ...]:
    """Estimate how late the velocities answer the commands.

    Parameters
    ----------
    log : Log
        With commands or a wrench.

    Returns
    -------
    delays : tuple of Delay
        For every command, or axis of the wrench, that moves a velocity, the one of which it
        explains most.

    Examples
    --------
    >>> time = np.arange(0.0, 60.0, 0.1)
    >>> rpm = np.sign(np.sin(time))
    >>> surge = 2 - np.abs(((time - 0.5) % (2 * np.pi)) / np.pi - 1)
    >>> found = estimate_delays(Log.from_arrays(time, {"u": surge}, commands={"rpm": rpm}))
    >>> found[0].command, found[0].velocity, round(found[0].seconds, 1)
    ('rpm', 'u', 0.5)
    """
    names, given = log.command_names, log.commands
    if log.wrench is not None:
        names, given = (*names, *AXES), np.column_stack((given, log.wrench))
    if not names:
        return ()
    step, velocity, commands = _resample(log, given)
    axes = [VELOCITIES.index(name) for name in log.velocity_names]
    columns = count_items(enumerate(names), "comparing delays", len(names))
    found = [_estimate_delay(name, commands[:, k], step, velocity, axes) for k, name in columns]
    return tuple(one for one in found if one is not None)


def _resample(log: Log, given: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Return step, velocities and commands on an even clock, a row of NaN between segments."""
    step = max(float(np.median(log.steps)), _MIN_STEP_S)
    velocities, commands = [], []
    left = _MAX_SAMPLES
    for start, stop in log.bounds.tolist():
        time = log.time[start:stop]
        even = np.arange(time[0], time[-1], step)[:left]
        before = np.searchsorted(time, even + _ROUNDING_STEPS * step, side="right") - 1
        columns = [np.interp(even, time, log.velocity[start:stop, k]) for k in range(6)]
        velocities += [np.column_stack(columns), np.full((1, 6), np.nan)]
        held = given[start:stop][before]
        commands += [held, np.full((1, held.shape[1]), np.nan)]
        left -= len(even)
        if left <= 0:
            break
    return step, np.concatenate(velocities), np.concatenate(commands)


def _estimate_delay(
    name: str, command: FloatArray, step: float, velocity: FloatArray, axes: list[int]
) -> Delay | None:
    """Return the delay of the axis of which a command explains most."""
    known = command[np.isfinite(command)]
    if np.count_nonzero(np.diff(known)) < _MIN_CHANGES:
        return None
    lags = np.arange(round(_MIN_LAG_S / step), round(_MAX_LAG_S / step) + 1)
    # The command at every lag; NaN beyond the ends.
    places = np.arange(len(command))[:, np.newaxis] - lags
    inside = (places >= 0) & (places < len(command))
    moved = np.where(inside, command[np.clip(places, 0, len(command) - 1)], np.nan)
    growth = np.diff(velocity[:, axes], axis=0, append=np.nan) / step
    state = _state_regressors(velocity, axes)
    fine = np.isfinite(np.column_stack((growth, moved, state))).all(axis=1)
    if len(lags) < 4 or np.count_nonzero(fine) < _MIN_SAMPLES:
        return None
    basis = np.linalg.qr(state[fine])[0]
    given, wanted = (one - basis @ (basis.T @ one) for one in (moved[fine], growth[fine]))
    totals = np.sum((growth[fine] - growth[fine].mean(axis=0)) ** 2, axis=0)
    along = _projections(wanted, given) / np.sqrt(np.maximum(totals, 1e-30))[:, np.newaxis]
    axis, place = np.unravel_index(int(np.argmax(along**2)), along.shape)
    share = float(along[axis, place] ** 2)
    if share < _MIN_SHARE:
        return None
    seconds = step * _interpolate_peak(along[axis] ** 2, lags)
    parts = []
    for part in np.array_split(np.arange(len(wanted)), _N_BLOCKS):
        usual = totals[axis] * len(part) / len(wanted)
        shares = _projections(wanted[part][:, [axis]], given[part])[0] ** 2 / max(usual, 1e-30)
        if shares.max() > _MIN_SHARE:
            parts.append(step * _interpolate_peak(shares, lags))
    allowed = max(2 * step, _BLOCK_TOLERANCE_S)
    near = float(np.mean(np.abs(np.array(parts) - seconds) <= allowed)) if len(parts) > 1 else 0.5
    sure = near * min(1.0, share / _SURE_SHARE) if 0 < place < len(lags) - 1 else 0.0
    if seconds < -max(step, _MIN_LEAD_S):
        sure = min(sure, _MAX_LEAD_CONFIDENCE)
    return Delay(
        command=name,
        velocity=VELOCITIES[axes[axis]],
        seconds=seconds,
        standard_deviation=float(np.std(parts)) if len(parts) > 1 else None,
        share=share,
        sign=int(np.sign(along[axis, place])),
        confidence=round(99 * sure),
    )


def _state_regressors(velocity: FloatArray, axes: list[int]) -> FloatArray:
    """Return what else moves a vehicle: itself, its drag, and what turns with its speed."""
    own = velocity[:, axes]
    ones = np.ones((len(velocity), 1))
    with_speed = [own * velocity[:, [0]]] if 0 in axes else []
    spread = np.column_stack((ones, own, own * np.abs(own), *with_speed))
    size = np.nanstd(spread, axis=0)
    return spread[:, (size > 0.0) | (np.arange(len(size)) == 0)]


def _projections(wanted: FloatArray, given: FloatArray) -> FloatArray:
    """Return how far growths go along the command at each lag, shape (axes, lags)."""
    sizes = np.linalg.norm(given, axis=0)
    there = sizes > 1e-9 * max(float(sizes.max()), 1e-30)
    return np.where(there, wanted.T @ given, 0.0) / np.where(there, sizes, 1.0)


def _interpolate_peak(shares: FloatArray, lags: IntArray) -> float:
    """Return the lag at the top of a parabola through the highest share and its neighbours."""
    place = int(np.argmax(shares))
    if not 0 < place < len(lags) - 1:
        return float(lags[place])
    left, top, right = shares[place - 1 : place + 2]
    bend = float(left - 2 * top + right)
    return float(lags[place]) + (0.5 * float(left - right) / bend if bend < 0.0 else 0.0)
