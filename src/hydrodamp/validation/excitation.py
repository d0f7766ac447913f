"""Excitation of training and test data, velocity by velocity, and the motion at a divergence."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np

from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.data.concatenation import concatenate
from hydrodamp.data.digests import velocity_digests
from hydrodamp.data.intervals import ALL_TEST_DATA, select_data
from hydrodamp.data.log import Log
from hydrodamp.identification.dissipativity import velocity_ranges, velocity_unit
from hydrodamp.identification.fit import Fit
from hydrodamp.simulation.checks import estimate_length
from hydrodamp.simulation.replay import Trajectory
from hydrodamp.vehicle.mass import STANDARD_GRAVITY
from hydrodamp.vehicle.vehicle import Vehicle

#: Range of a velocity in one log over that in another from which only the first excites it: ten
#: times the quadratic damping.
MAX_RANGE_RATIO = 10.0**0.5

#: Hashes of a segment that are those of training data, least; a single equality may be chance.
MIN_MATCHES = 2

_N_PARTS = 9  # of one recording, of which a third is the test
_TEST_SHARES = (0.15, 0.5)  # of the samples, for a test of whole segments
_MISSING_COST = (
    1e3  # imbalance of a velocity that one side alone excites: more than any sum of ratios
)

#: Correlation times of the velocities before a divergence in which its motion is described.
_RELATIVE_WINDOW = 5.0

#: Largest yaw rate over speed and length, and least correlation time over sqrt(length / gravity);
#: measured logs of ship models, an ROV and an AUV have at most 2.2 and at least 4.9.
_MAX_TURN, _MIN_TIME_SCALE = 4.0, 3.0

Ranges = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Imbalance:
    """Velocities that only the test or only the training data excite, each with its ranges."""

    test_only: Mapping[str, str]
    training_only: Mapping[str, str]

    @property
    def sentences(self) -> tuple[str, ...]:
        """The consequences in sentences."""
        sentences = []
        if texts := ", ".join(self.test_only.values()):
            sentences.append(f"Only the test data excite {texts}: models extrapolate there.")
        if texts := ", ".join(self.training_only.values()):
            sentences.append(f"Only the training data excite {texts}: the test cannot assess them.")
        return tuple(sentences)

    @property
    def untested(self) -> dict[str, str]:
        """The reason why the test does not assess each velocity that only one of both excites."""
        return dict.fromkeys(self.test_only, "not excited in training") | dict.fromkeys(
            self.training_only, "not excited in the test"
        )


def find_shared_segments(fits: Iterable[Fit], log: Log) -> str:
    """Return the segments of a log with data on which fits were trained; empty for none.

    Data that a log repeats, as of a vehicle at rest, prove nothing.
    """
    stored = " ".join(fit.provenance.get("velocity_digests", "") for fit in fits).split()
    trained = np.array([int(text, 16) for text in stored], dtype=np.uint64)
    digests = velocity_digests(log)
    values, counts = np.unique(np.concatenate(digests), return_counts=True)
    repeated, shared, is_partial = values[counts > 1], list[str](), False
    for segment, of_segment in zip(log.segments, digests, strict=True):
        distinct = of_segment[~np.isin(of_segment, repeated)]
        rows = np.flatnonzero(np.isin(distinct, trained))
        shared += [segment.name] * (len(rows) >= MIN_MATCHES)
        steps = np.diff(rows, prepend=-1, append=len(distinct))
        is_partial |= len(distinct) > 0 and max(steps[0], steps[-1]) > steps[1:-1].max(initial=1)
    if shared and not is_partial:
        return ALL_TEST_DATA
    return f"segments {' '.join(shared)}" if shared else ""


def describe_overlap(overlap: str) -> str:
    """Return the consequence of training data among the test data."""
    if overlap == ALL_TEST_DATA:
        return "Errors are those of the training data, not prediction errors."
    return f"Training and test data share {overlap}: errors on training data are optimistic."


def compare_logs(train: Log, test: Log, axes: Sequence[str]) -> Imbalance:
    """Return the velocities of free axes that only one of two logs excites."""
    return compare_excitation(*(velocity_ranges(log.velocity, axes) for log in (train, test)))


def compare_excitation(train: Ranges, test: Ranges) -> Imbalance:
    """Return the velocities that only the training or only the test data excite, by ranges."""
    return Imbalance(dict(_exceedances(test, train)), dict(_exceedances(train, test)))


def propose_split(log: Log, axes: Sequence[str] = AXES) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return training and test data with nearly the same ranges of each velocity.

    The test is about a third: whole segments, or an interval where no segments are that long.
    """
    choices = [*_choices_of_segments(log)] or [*_choices_of_intervals(log)]
    costs = [_imbalance(_select(log, train), _select(log, test), axes) for train, test in choices]
    return choices[int(np.argmin(costs))]


def _choices_of_segments(log: Log) -> Iterator[tuple[tuple[str, ...], tuple[str, ...]]]:
    """Yield choices of segments with a test that is neither short nor most of the log."""
    lengths = {segment.name: len(segment) for segment in log.segments}
    names = [*lengths]
    if len(names) < len(log.segments):
        return
    n = max(len(names) // 3, 1)
    tests = [names[k : k + n] for k in range(len(names) - n, -1, -1)]
    for test in (*tests, *(names[k::3] for k in range(3))):
        share = sum(lengths[name] for name in test) / log.n
        if _TEST_SHARES[0] <= share <= _TEST_SHARES[1]:
            yield tuple(name for name in names if name not in test), tuple(test)


def _choices_of_intervals(log: Log) -> Iterator[tuple[tuple[str, ...], tuple[str, ...]]]:
    end, third = float(log.elapsed[-1]), _N_PARTS // 3
    edges = [f"{each:.3f}" for each in (end * np.arange(_N_PARTS) / _N_PARTS).tolist()]
    edges.append(f"{np.floor(end) + 1.0:.0f}")
    for k in range(_N_PARTS - third, -1, -1):
        sides = [(first, last) for first, last in ((0, k), (k + third, _N_PARTS)) if first < last]
        train = tuple(f"{edges[first]}:{edges[last]}" for first, last in sides)
        yield train, (f"{edges[k]}:{edges[k + third]}",)


def _imbalance(train: Log, test: Log, axes: Sequence[str]) -> float:
    """Return by how much two logs differ in the ranges of their velocities."""
    ranges = [velocity_ranges(log.velocity, axes) for log in (train, test)]
    only = compare_excitation(*ranges)
    sizes = [np.array([np.ptp(each) for each in limits.values()]) for limits in ranges]
    moving = np.minimum(*sizes) > 0.0
    ratios = np.log(sizes[1][moving] / sizes[0][moving])
    return len(only.untested) * _MISSING_COST + float(np.sum(np.abs(ratios)))


def _select(log: Log, names: Iterable[str]) -> Log:
    return concatenate(select_data(log, name) for name in names)


def select_folds(imbalances: Sequence[Imbalance]) -> tuple[bool, ...]:
    """Return whether each fold counts: those in which models extrapolate do not, if others do."""
    counted = tuple(not imbalance.test_only for imbalance in imbalances)
    return counted if any(counted) else (True,) * len(imbalances)


def find_untested(imbalances: Sequence[Imbalance]) -> dict[str, str]:
    """Return the velocities that no fold that counts excites in both data, with the reason.

    A comparison is a single fold.
    """
    counted = compress(imbalances, select_folds(imbalances))
    reasons = [imbalance.untested for imbalance in counted]
    names = set.intersection(*map(set, reasons)) if reasons else set[str]()
    only = {
        name: f"excited in fold {number} only"
        for number, imbalance in enumerate(imbalances, start=1)
        for name in imbalance.test_only
        if len(imbalances) > 1
    }
    return {name: only.get(name, reasons[0][name]) for name in sorted(names)}


def describe_folds(
    imbalances: Sequence[Imbalance], held_out: Iterable[Sequence[str]]
) -> tuple[str, ...]:
    """Return a sentence on each fold that alone excites a velocity."""
    folds = enumerate(zip(imbalances, select_folds(imbalances), held_out, strict=False), start=1)
    return tuple(
        f"Only fold {number} of {len(imbalances)} (segment {' '.join(names)}) excites "
        f"{', '.join(imbalance.test_only.values())}: models extrapolate there"
        + ("." if is_counted else ", so it does not count.")
        for number, (imbalance, is_counted, names) in folds
        if imbalance.test_only
    )


def _exceedances(first: Ranges, second: Ranges) -> Iterator[tuple[str, str]]:
    """Yield the velocities whose range in the first data far exceeds that in the second."""
    for name, limits in first.items():
        larger, smaller = _largest(limits), _largest(second.get(name, limits))
        if larger > MAX_RANGE_RATIO * smaller:
            yield name, f"{name} ({larger:.2g} against {smaller:.2g} {velocity_unit(name)})"


def describe_divergences(trajectory: Trajectory, training: Ranges) -> tuple[str, ...]:
    """Return segment, time and motion of each divergence of a replay."""
    log = trajectory.log
    window = _RELATIVE_WINDOW * log.time_scale
    texts = []
    for name, since in trajectory.diverged:
        segment = next(each for each in log.segments if each.name == name)
        time = log.time[segment.start : segment.stop] - log.time[segment.start]
        is_near = (time >= since - window) & (time <= since)
        speeds = np.abs(log.velocity[segment.start : segment.stop][is_near]).max(axis=0, initial=0)
        motion = _motion(dict(zip(VELOCITIES, speeds.tolist(), strict=True)), training)
        texts.append(f"segment {name} after {since:.3g} s{motion}")
    return tuple(texts)


def _motion(speeds: Mapping[str, float], training: Ranges) -> str:
    """Name the velocity that exceeds its training range most, if any does."""
    ratios = {
        name: speeds[name] / largest
        for name, limits in training.items()
        if name in speeds and (largest := _largest(limits)) > 0.0
    }
    if not ratios:
        return ""
    name = max(ratios, key=ratios.__getitem__)
    if ratios[name] <= 1.0:
        return " within the training range"
    trained = f"{_largest(training[name]):.2g}"
    return f" where {name} reaches {speeds[name]:.2g} {velocity_unit(name)} (training: {trained})"


def _largest(limits: tuple[float, float]) -> float:
    return max(map(abs, limits))


def foreign_motion(vehicle: Vehicle, log: Log) -> str:
    """Return a message if the motion of a log is too quick for the length of a vehicle, else "".

    Times are compared by Froude scaling, and circles with the length.
    """
    length, yaw_rate = estimate_length(vehicle), log.velocity[:, VELOCITIES.index("r")]
    speeds = np.linalg.norm(log.velocity[:, :3], axis=1)
    speed, turn = (float(np.quantile(np.abs(each), 0.9)) for each in (speeds, yaw_rate))
    if not length or not turn * length > _MAX_TURN * speed > 0.0:
        return ""
    if log.time_scale > _MIN_TIME_SCALE * np.sqrt(length / STANDARD_GRAVITY):
        return ""
    return (
        f"its motion is not that of '{vehicle.name}', whose length by its inertia is "
        f"{length:.3g} m: it turns in circles of {speed / turn:.2g} m radius, and its velocities "
        f"change within {log.time_scale:.2g} s. Name the vehicle of the log, such as that of the "
        "model in a tank, by `--vehicle`, or check the units of the log"
    )
