"""Channels judged against each other: rates by attitude, velocity by position, clock by motion."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.conditioning.derived import GRAVITY
from hydrodamp.conditioning.spikes import leaps
from hydrodamp.data.agreement import Agreement, agreement, changes, compared, roughness, turned
from hydrodamp.data.attitude import rotation
from hydrodamp.data.log import Log
from hydrodamp.data.units import UNITS, si_unit

_TOLERANCE, _OTHER_SIGN = 0.08, 0.3  # of a ratio, about that of a unit, or about -1
_SCALE = 1.5  # times too large or too small, of no unit
_SURE = 0.95  # correlation from which a ratio of no unit is told
_UNLIKE = 0.5  # correlation below which two channels do not measure one motion
_DEAD = 0.2  # of the other's motion; less is none
_DEAD_RATIO = 1e-4  # of any two units of a rate or a speed
_NOISE = 10.0  # times the noise of a channel, from which it moves
_PART = 0.2  # of the way, that a velocity's own part must have to be missed
_WAY, _STEPS = 5.0, 10  # s, or steps, over which paths are compared: longer than noise
_LEAST_PART = 1e-4  # of the path, that a velocity must have; one in km/s beside others in m/s has
_USUAL = 0.95  # of the samples; the rest are spikes
_JITTER = 0.2  # of a step, from which a clock is asked
_EVEN = 3.0  # times smoother by row than by clock
_FEWEST = 200  # samples; in fewer, chance and spikes speak
_BURST = 0.01  # of the mean step


@dataclass(frozen=True)
class Suspicion:
    """Something about a channel that does not look right.

    Attributes
    ----------
    channel : str
        Which one, or several.
    looks : str
        What it looks like.
    evidence : str
        Why, with the number it rests on.
    where : str
        Which samples; empty where it is the whole channel.
    cure : str
        The step or the line of a mapping that mends it, or what to do.
    minor : bool
        Whether it concerns single samples, which the cure takes out.

    Examples
    --------
    >>> print(Suspicion("r", "is deg/s taken for rad/s", "it is 57.3 times the attitude's"))
    suspicion: `r` is deg/s taken for rad/s: it is 57.3 times the attitude's
    """

    channel: str
    looks: str
    evidence: str
    where: str = ""
    cure: str = ""
    minor: bool = False

    def __str__(self) -> str:
        """Return one sentence."""
        told = f"suspicion: `{self.channel}` {self.looks}: {self.evidence}"
        return told + (f", {self.where}" if self.where else "") + self.advice

    @property
    def advice(self) -> str:
        """The cure as the end of a sentence."""
        return f"; {self.cure}" if self.cure else ""


@dataclass(frozen=True)
class Size:
    """What is little and what is much for a vehicle, by Froude's law."""

    length: float  # m

    @classmethod
    def of(cls, log: Log) -> Size:
        """Return the size that the usual speed of a log speaks for."""
        speed = float(np.quantile(np.linalg.norm(log.velocity[:, :3], axis=1), 0.9))
        length = speed**2 / (_FROUDE**2 * GRAVITY)
        return cls(min(max(length, _SHORTEST), _LONGEST))

    def little(self, unit: str) -> float:
        """Return the standard deviation of a velocity that hardly varies."""
        scale = math.sqrt(self.length / _USUAL_LENGTH)
        return _LITTLE_SPEED * scale if unit == "m/s" else _LITTLE_RATE / scale

    def most(self, unit: str) -> float:
        """Return a velocity that no such vehicle reaches."""
        of_length = self.length if unit == "m/s" else 1.0 / self.length
        return _MOST_FROUDE * math.sqrt(GRAVITY * of_length)


_FROUDE, _MOST_FROUDE = 0.25, 2.0  # usual, and of a boat that planes
_SHORTEST, _LONGEST = 0.3, 100.0  # m
_USUAL_LENGTH, _LITTLE_SPEED, _LITTLE_RATE = 2.0, 0.02, 0.01  # m, m/s, rad/s


def _mistaken(quantity: str, other: str) -> dict[float, str]:
    """Return what a ratio to another channel means, by the units of a quantity."""
    unit = si_unit(quantity)
    units = {factor: name for name, factor in reversed(UNITS[quantity].items()) if name != unit}
    return {
        -1.0: f"of the other sign, or of another frame than the {other}",
        **{
            factor: f"{unit} taken for {name} and converted once too often"
            for factor, name in units.items()
        },
        **{1 / factor: f"{name} taken for {unit}" for factor, name in units.items()},
    }


_RATES = _mistaken("angular rate", "attitude")
_RATES[UNITS["angular rate"]["deg/s"]] += ", or its angle is degrees taken for radians"
_SPEEDS = _mistaken("speed", "position") | {0.001: "m/s beside a position in mm"}


def disagreements(log: Log, size: Size) -> Iterator[Suspicion]:
    """Yield where channels that measure one motion contradict each other."""
    yield from _clock(log)
    if log.attitude is not None:
        yield from _turning(log, log.attitude, size)
        # A depth alone is no way.
        if log.position is not None and np.count_nonzero(np.ptp(log.position, axis=0)) > 1:
            yield from _way(log, log.attitude, log.position)


def _turning(log: Log, attitude: FloatArray, size: Size) -> Iterator[Suspicion]:
    """Compare rates and attitude: dead rates, another unit or sign."""
    attitude = np.where(leaps(log, attitude)[:, np.newaxis], np.nan, attitude)
    turns = turned(attitude, log.bounds)
    cases: list[_Case] = []
    for k, rate in enumerate(VELOCITIES[3:]):
        if rate in log.velocity_names:
            values, own = log.velocity[:, [3 + k]], turns[:, [k]]
            both = agreement(log.time, log.bounds, values, own)
            noise = _NOISE * roughness(own, log.bounds)
            least = max(noise, size.little("rad/s") * both.span)
            looks = _looks(both, _RATES, least if log.n >= _FEWEST else np.inf)
            cases.append((rate, both, looks))
    yield from _told(cases, "attitude's rate", "rates_from_attitude")


#: A channel, how it goes with another, and what that looks like.
_Case = tuple[str, Agreement, str]

_NOTHING, _UNRELATED = "measures nothing of its motion", "is not the motion of the vehicle"
_RESCALED = "is of another size"


def _looks(both: Agreement, units: dict[float, str], least: float) -> str:
    """Return what is wrong with a channel beside another that moves by more than its noise."""
    if both.agrees() and (unit := _unit(both.ratio, units)):
        return f"is {unit}"
    dead = both.agrees() and abs(both.ratio) < _DEAD_RATIO
    if dead or (both.moved > least and both.added < _DEAD * both.moved):
        return _NOTHING
    if both.agrees():
        fits = 1 / _SCALE < both.ratio < _SCALE or abs(both.correlation) < _SURE
        return "" if fits or both.moved <= least else _RESCALED
    return _UNRELATED if both.moved > least and abs(both.correlation) < _UNLIKE else ""


def _told(cases: Sequence[_Case], other: str, step: str) -> Iterator[Suspicion]:
    """Yield what is wrong with channels, a sentence for all that look the same."""
    for looks in dict.fromkeys(looks for _, _, looks in cases if looks):
        mine = [(name, both) for name, both, its in cases if its == looks]
        names, each = " ".join(name for name, _ in mine), [both for _, both in mine]
        evidence = f"it is {', '.join(f'{both.ratio:.3g}' for both in each)} times the {other}"
        if looks in (_NOTHING, _UNRELATED):
            added, moved, likeness = (
                ", ".join(f"{one:.2g}" for one in column)
                for column in zip(*map(_numbers, each), strict=True)
            )
            evidence = (
                f"over {each[0].span:.3g} s it adds up to {added}, and the {other} to {moved} "
                f"(correlation {likeness})"
            )
        cure = f"derive it: `steps: [{step}: {{names: [{', '.join(names.split())}]}}]`"
        if "too often" in looks:
            cure = "write the units that the file has in the mapping, `unit: deg` for such an angle"
        elif " taken for " in looks:
            cure = f"write `unit: {looks.split()[1]}` for it in the mapping"
        elif "sign" in looks:
            cure = "write `sign: -1` for it, or other axes under `sensors`, in the mapping"
        yield Suspicion(names, looks, evidence, cure=cure)


def _numbers(one: Agreement) -> tuple[float, float, float]:
    return one.added, one.moved, one.correlation


def _unit(ratio: float, units: dict[float, str]) -> str:
    """Return what a ratio means, or nothing."""
    if not np.isfinite(ratio):
        return ""
    unit = min(units, key=lambda unit: abs(ratio / unit - 1))
    allowed = _TOLERANCE if unit > 0.0 else _OTHER_SIGN
    return units[unit] if abs(ratio / unit - 1) < allowed else ""


def _way(log: Log, attitude: FloatArray, position: FloatArray) -> Iterator[Suspicion]:
    """Compare velocities and position: all together, and each velocity with its part."""
    names = [name for name in VELOCITIES[:3] if name in log.velocity_names]
    turning = rotation(attitude)
    axes, gone, span = travels(log.time, log.bounds, turning, position)
    made, _, _ = travels(log.time, log.bounds, turning * log.velocity[:, np.newaxis, :3], position)
    whole = compared(made.sum(axis=2), gone)._replace(span=span)
    noise = _NOISE * roughness(position, log.bounds)
    if not names or whole.moved < noise:
        return
    if other := _other_way(" ".join(names), log, turning, position, whole):
        yield other
        return
    each = zip(VELOCITIES[:3], path_agreements(made, axes, gone), strict=True)
    least = max(noise, _PART * whole.moved) if log.n >= _FEWEST else np.inf
    cases = [(name, both._replace(span=span), _looks(both, _SPEEDS, least)) for name, both in each]
    yield from _told(
        [case for case in cases if case[0] in names],
        "position's path along it",
        "velocity_from_position",
    )


def travels(
    time: FloatArray, bounds: IntArray, axes: FloatArray, position: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Return what columns of world vectors add up to over some seconds, and the position's move."""
    steps = np.concatenate([np.diff(time[a:b]) for a, b in bounds.tolist()])
    span = max(_WAY, _STEPS * float(np.median(steps)))
    made, gone = changes(time, bounds, axes.reshape(-1, 9), position, span)
    return made.reshape(-1, 3, 3), gone, span


def path_agreements(made: FloatArray, axes: FloatArray, gone: FloatArray) -> list[Agreement]:
    """Return how the path of each of u v w goes with what the others leave of the position's."""
    flat, moves = made.reshape(-1, 3), gone.ravel()
    sizes = np.linalg.norm(flat, axis=0)
    there = np.flatnonzero(sizes > _LEAST_PART * np.linalg.norm(sizes))
    shares = np.zeros(3)
    shares[there] = np.linalg.lstsq(flat[:, there] / sizes[there], moves)[0] / sizes[there]
    rests = (moves - flat @ shares).reshape(-1, 3)
    lengths = np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-9)
    along = axes / lengths  # of the part that the vehicle's own axis keeps pointing to
    own = np.einsum("nij,nij->nj", made, along)
    left = np.einsum("ni,nij->nj", rests, along) + own * shares
    return [compared(own[:, k], left[:, k]) for k in range(3)]


def _other_way(
    names: str, log: Log, turning: FloatArray, position: FloatArray, whole: Agreement
) -> Suspicion | None:
    """Return in which axes velocities would make the way of the position that they do not."""
    velocity = log.velocity[:, :3]
    body = np.einsum("nij,nj->ni", turning, velocity)
    ways: dict[str, tuple[FloatArray, str]] = {
        "is along the axes of the world, not of the vehicle": (
            velocity,
            "name them `north`, `east` and `down` under `velocity` in the mapping",
        ),
        "has a position of another world, east and north exchanged": (
            np.asarray(body[:, (1, 0, 2)] * (1.0, 1.0, -1.0)),
            "name the axes of the position `east`, `north`, `up` in the mapping",
        ),
    }
    for looks, (way, cure) in ways.items():
        found = compared(*changes(log.time, log.bounds, way, position, whole.span))
        if found.correlation > _SURE and found.beats(whole):
            told = f"added up it goes with the position by a correlation of {whole.correlation:.2f}"
            return Suspicion(names, looks, f"{told}, so by {found.correlation:.2f}", cure=cure)
    return None


def _clock(log: Log) -> Iterator[Suspicion]:
    """Ask whether samples follow each other more evenly than their clock says."""
    steps = np.concatenate([np.diff(log.time[a:b]) for a, b in log.bounds.tolist()])
    few, low, step, high = np.quantile(steps, (0.1, 0.05, 0.5, 0.95)).tolist()
    if log.n < _FEWEST or high - low < 2 * _JITTER * step:
        return
    columns = [log.velocity[:, VELOCITIES.index(name)] for name in log.velocity_names]
    columns += [] if log.position is None else [*log.position.T]
    columns += [] if log.attitude is None else [*turned(log.attitude, log.bounds).T]
    by_clock, by_row = np.array([_bends(log, one) for one in columns]).T
    times = np.divide(by_clock, by_row, out=np.ones_like(by_row), where=by_row > 0.0)
    in_bursts = few < _BURST * float(np.mean(steps))
    if in_bursts or (times.max() > _EVEN and times.min() > 1 / _EVEN):
        told = f"by row number the motion is {times.max():.2g} times smoother"
        yield Suspicion(
            "time",
            "is not when the samples were taken",
            f"its steps are from {low:.2g} to {high:.2g} s, "
            + ("in bursts" if in_bursts else told),
            cure="take the sensor's own stamp (`time: header.stamp` in the mapping), not when a "
            "message came",
        )


def _bends(log: Log, values: FloatArray) -> tuple[float, float]:
    """Return how far most samples are off between their neighbours, by clock and by row."""
    clock, row = [], []
    for start, stop in log.bounds.tolist():
        time, own = log.time[start:stop], values[start:stop]
        share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
        rise, ahead = own[1:-1] - own[:-2], own[2:] - own[:-2]
        clock.append(np.abs(rise - share * ahead))
        row.append(np.abs(rise - ahead / 2))
    by_clock, by_row = np.concatenate(clock), np.concatenate(row)
    usual = by_row <= np.quantile(by_row, _USUAL)
    return float(by_clock[usual].mean()), float(by_row[usual].mean())
