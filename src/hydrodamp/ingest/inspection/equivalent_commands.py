"""Command channels that record the same signal: pulse width and force, demand and feedback.

Command b follows command a if a monotone curve of a, after a first-order lag and a dead time,
leaves a small share of the variance of b: ``b(t) = f(a_T(t - d)) + e``, with f by isotonic
regression. Names that differ only in the representation (`left_pwm`, `left_force`) may leave the
noise of a sensor; other names only rounding: surfaces of different deflections stay separate.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.conditioning.consistency import Fix, QualityIssue
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording
from hydrodamp.ingest.inspection.columns import TopicClock, synchronise, topic_series
from hydrodamp.ingest.inspection.delay import resample
from hydrodamp.ingest.inspection.names import WORDS, words

_MIN_CORRELATION = 0.8  # of a pair, before the curve is fitted
_MIN_INSTANT_CORRELATION = 0.3  # of a pair without a lag; less is not searched
_MAX_RESIDUAL_SHARE, _MAX_SENSOR_NOISE_SHARE = 1e-3, 0.05
_MIN_CHANGES, _MIN_SAMPLES = 4, 60
_MAX_SAMPLES = 20_000
_MAX_LAG_SAMPLES = 100
_RELATIVE_LAGS = (0.0, 0.125, 0.25, 0.5)  # first-order lags over the correlation time
_LATER_SAMPLES = 0.5  # from which one command is later than another

#: Reason for commands that actuators take, and reservation where these are unknown.
_TAKEN = "the vehicle's actuators take no other"
_UNLESS_TAKEN = ", unless the vehicle's actuators take them"

_KINDS = ("actuator_force", "actuator_feedback", "actuator_demand", "actuator_kind")


@dataclass(frozen=True)
class EquivalentCommands:
    """Commands of one signal: the one to use, those to omit, and the reason."""

    selected: str
    omitted: tuple[str, ...]
    evidence: str
    reason: str

    def __str__(self) -> str:
        """Return why the others are omitted."""
        return f"records the same signal as {self.selected} ({self.evidence}); {self.reason}"

    def prefer(self, taken: Collection[str]) -> EquivalentCommands:
        """Return the group with those of its commands that actuators of a vehicle take."""
        members = (self.selected, *self.omitted)
        if not (used := [name for name in members if name in taken]):
            return self
        omitted = tuple(name for name in members if name not in taken)
        return replace(self, selected=" ".join(used), omitted=omitted, reason=_TAKEN)

    def issue(self) -> QualityIssue:
        """Return the issue with its remedy."""
        names = " ".join((self.selected, *self.omitted))
        remedy = (
            f"use {self.selected} only, since {self.reason}: omit {' '.join(self.omitted)} from "
            f"`commands` of the mapping{'' if self.reason == _TAKEN else _UNLESS_TAKEN}"
        )
        problem = "are recordings of the same signal, whose gains cannot be separated"
        fix = Fix("omit", " ".join(self.omitted))
        return QualityIssue(names, problem, self.evidence, remedy=remedy, is_minor=True, fix=fix)


@dataclass(frozen=True)
class _Relation:
    """How one command follows another."""

    first: int
    second: int
    explained: float
    lag: float  # samples; negative if the second precedes the first


def find_equivalent_commands(
    names: Sequence[str], commands: FloatArray
) -> tuple[EquivalentCommands, ...]:
    """Group commands (n, k) on an even clock, with NaN rows between segments, by their signal."""
    values = commands[np.isfinite(commands).all(axis=1)]
    values = values[:_MAX_SAMPLES]
    if len(values) < _MIN_SAMPLES:
        return ()
    changes = np.count_nonzero(np.diff(values, axis=0), axis=0)
    varying = np.flatnonzero(changes >= _MIN_CHANGES).tolist()
    groups: list[list[int]] = []
    relations: dict[frozenset[int], _Relation] = {}
    for second in varying:
        for group in groups:
            relation = _relate(names, values, group[0], second)
            if relation is not None:
                relations[frozenset((group[0], second))] = relation
                group.append(second)
                break
        else:
            groups.append([second])
    return tuple(
        _choose(names, group, [relations[frozenset((group[0], each))] for each in group[1:]])
        for group in groups
        if len(group) > 1
    )


def equivalent_commands(
    log: Log, among: Collection[str] | None = None
) -> tuple[EquivalentCommands, ...]:
    """Group the commands of a log, or some of them, by their signal."""
    names = [name for name in log.command_names if among is None or name in among]
    if len(names) < 2:
        return ()
    _, _, commands = resample(log, np.column_stack([log.command(name) for name in names]))
    return find_equivalent_commands(names, commands)


def find_equivalent_columns(
    recording: Recording, clocks: Mapping[str, TopicClock], columns: Collection[str]
) -> dict[str, str]:
    """Return, by column of a command to omit, the reason."""
    series = [
        item
        for topic in recording.topics
        if topic.name in clocks
        for item in topic_series(topic, clocks[topic.name])
        if item.column in columns
    ]
    if len(series) < 2:
        return {}
    groups = find_equivalent_commands([item.column for item in series], synchronise(series)[1])
    return {name: str(group) for group in groups for name in group.omitted}


def _choose(
    names: Sequence[str], group: Sequence[int], relations: Sequence[_Relation]
) -> EquivalentCommands:
    """Return the group with the command closest to a force, else the latest in the chain."""
    delays = {group[0]: 0.0} | {each.second: each.lag for each in relations}
    ranks = {index: rank_actuation(names[index]) for index in group}
    best = max(group, key=lambda index: (ranks[index], round(delays[index] / _LATER_SAMPLES)))
    if ranks[best] > min(ranks.values()):
        rank = ranks[best]
        kind = "a force" if rank > 1 else "a feedback" if rank > 0 else "not only a demand"
        reason = f"{names[best]} is {kind} by its name"
    elif delays[best] - min(delays.values()) >= _LATER_SAMPLES:
        reason = f"{names[best]} is the later in the chain"
    else:
        reason = f"{names[best]} is the first in the log, and neither is later"
    explained = 100.0 * min(each.explained for each in relations)
    lag = max(delays.values()) - min(delays.values())
    later = f", {lag:.2g} samples later" if lag >= _LATER_SAMPLES else ""
    evidence = f"a monotone curve explains {explained:.4g} % of the variance{later}"
    omitted = tuple(names[index] for index in group if index != best)
    return EquivalentCommands(names[best], omitted, evidence, reason)


def rank_actuation(name: str) -> float:
    """Return how close a command is to what acts: near 2 a force, 1 a feedback, -1 a demand."""
    name_words = {*_representation(name)[1]}
    is_feedback, is_demand = (
        bool(name_words & WORDS[kind]) for kind in ("actuator_feedback", "actuator_demand")
    )
    if name_words & WORDS["actuator_force"]:
        return 2.0 + 0.25 * (is_feedback - is_demand)
    return 1.0 if is_feedback else -1.0 if is_demand else 0.0


def _representation(name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the words of a name that say which actuator, and those that say what of it."""
    kinds = frozenset[str]().union(*(WORDS[kind] for kind in _KINDS))
    every = [element for word in words(name) for element in _split_number(word)]
    actuator = tuple(sorted(word for word in every if word not in kinds))
    return actuator, tuple(word for word in every if word in kinds)


def _split_number(word: str) -> Iterator[str]:
    stem = word.rstrip("0123456789")
    yield from filter(None, (stem, word[len(stem) :]))


def _relate(names: Sequence[str], values: FloatArray, first: int, second: int) -> _Relation | None:
    """Return how two commands follow each other, or None if they are different signals."""
    if abs(_correlate(values[:, first], values[:, second], 0)) < _MIN_INSTANT_CORRELATION:
        return None
    (actuator, kind), (second_actuator, second_kind) = (
        _representation(names[index]) for index in (first, second)
    )
    is_named = bool(actuator) and actuator == second_actuator and kind != second_kind
    limit = _MAX_SENSOR_NOISE_SHARE if is_named else _MAX_RESIDUAL_SHARE
    best: _Relation | None = None
    for source, target, direction in ((first, second, 1.0), (second, first, -1.0)):
        for explained, lag in _responses(values[:, source], values[:, target]):
            if 1.0 - explained <= limit and (best is None or explained > best.explained):
                best = _Relation(first, second, explained, direction * lag)
    return best


def _responses(source: FloatArray, target: FloatArray) -> Iterator[tuple[float, float]]:
    """Yield the share that a curve of the lagged source explains, and its lag in samples."""
    from scipy.signal import lfilter

    limit = _correlation_time(source)
    for relative in _RELATIVE_LAGS:
        constant = relative * limit
        factor = np.exp(-1.0 / constant) if constant > 0.0 else 0.0
        state = [factor * source[0]]
        lagged = np.asarray(lfilter([1.0 - factor], [1.0, -factor], source, zi=state)[0])
        correlations = [abs(_correlate(lagged, target, lag)) for lag in range(limit + 1)]
        lag = int(np.argmax(correlations))
        if correlations[lag] >= _MIN_CORRELATION:
            yield _explained_by_curve(lagged[: len(lagged) - lag], target[lag:]), lag + constant


def _correlation_time(values: FloatArray) -> int:
    """Return the lag at which the autocorrelation of a command is one half, in samples."""
    largest = min(_MAX_LAG_SAMPLES, len(values) // 4)
    lags = range(1, largest + 1)
    return next((lag for lag in lags if _correlate(values, values, lag) < 0.5), largest)


def _correlate(first: FloatArray, second: FloatArray, lag: int) -> float:
    """Return the correlation of two signals, the second by a lag later."""
    a, b = first[: len(first) - lag], second[lag:]
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else 0.0


def _explained_by_curve(source: FloatArray, target: FloatArray) -> float:
    """Return the share of the variance that a monotone curve explains."""
    from scipy.optimize import isotonic_regression

    levels, index, counts = np.unique(source, return_inverse=True, return_counts=True)
    means = np.bincount(index, target, len(levels)) / counts
    increasing = _correlate(source, target, 0) > 0.0
    curve = isotonic_regression(means, weights=counts, increasing=increasing).x
    variance = float(np.sum((target - target.mean()) ** 2))
    return 1.0 - float(np.sum((target - curve[index]) ** 2)) / variance if variance else 0.0
