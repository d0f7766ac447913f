"""Recordings, probes and logs of a project, read once for each version of their files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from threading import RLock
from typing import Any, Generic, TypeVar

import numpy as np

from hydrodamp.app.project import MAPPING, MODEL, VEHICLE, Project
from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording
from hydrodamp.errors import HydrodampError, suppress_warnings
from hydrodamp.identification.log_requirements import find_requirements
from hydrodamp.ingest.formats.files import split_joined_paths
from hydrodamp.ingest.inspection.columns import TopicClock, find_clocks
from hydrodamp.ingest.inspection.mapping_editor import parse_content
from hydrodamp.ingest.inspection.probe import Inspection, Probe, inspect, probe
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.mapping.log_mapping import resolve_extends
from hydrodamp.ingest.read import combine_recordings, is_canonical_recording, read_recordings
from hydrodamp.models.files import read_models
from hydrodamp.models.model import DampingModel
from hydrodamp.report.decimation import DecimatedSeries
from hydrodamp.vehicle.file import find_vehicle, parse_vehicle
from hydrodamp.vehicle.vehicle import Vehicle

T = TypeVar("T")


class LatestCache(Generic[T]):
    """The value of the latest key; a second thread waits for the first."""

    def __init__(self) -> None:
        self._lock = RLock()
        self._item: tuple[object, T] | None = None

    def get(self, key: object, compute: Callable[[], T]) -> T:
        """Return the value of a key, computed if it is not the latest."""
        with self._lock:
            if self._item is None or self._item[0] != key:
                self._item = None  # its memory is free before the next value is computed
                self._item = key, compute()
            return self._item[1]


@dataclass(frozen=True, eq=False)
class Files:
    """The recordings of a project."""

    recordings: tuple[Recording, ...]

    @property
    def is_canonical(self) -> bool:
        """Whether no recording needs a mapping."""
        return all(map(is_canonical_recording, self.recordings))

    @cached_property
    def probe(self) -> Probe:
        """What the recordings contain."""
        with suppress_warnings():
            return probe(*self.recordings)

    @cached_property
    def extent(self) -> tuple[float, float]:
        """First and last time of all columns [s]."""
        spans = [each.time[[0, -1]] for each in self.series.values() if len(each.time)]
        return (
            min((float(first) for first, _ in spans), default=0.0),
            max((float(last) for _, last in spans), default=1.0),
        )

    @cached_property
    def clocks(self) -> list[dict[str, TopicClock]]:
        """Clocks of the topics of each recording."""
        return [find_clocks(recording) for recording in self.recordings]

    @cached_property
    def starts(self) -> list[float]:
        """Start of each recording on the common time [s]."""
        return [start for start, _ in self._timed]

    @cached_property
    def series(self) -> dict[str, DecimatedSeries]:
        """All columns, runs one after the other, on a common time from the first sample [s]."""
        pieces: dict[str, list[tuple[FloatArray, FloatArray]]] = {}
        for recording, (_, times) in zip(self.recordings, self._timed, strict=True):
            for name, topic, values in _columns(recording):
                pieces.setdefault(name, []).append((times[topic], values))
        return {name: _join(each) for name, each in pieces.items()}

    @cached_property
    def _timed(self) -> list[tuple[float, dict[str, FloatArray]]]:
        """Start of each recording, and the times of its topics, on the common time [s]."""
        timed, offset = [], 0.0
        for recording, clocks in zip(self.recordings, self.clocks, strict=True):
            times = {
                topic.name: clocks[topic.name].seconds
                if topic.name in clocks
                else np.arange(float(topic.n))
                for topic in recording.topics
            }
            finite = [time[np.isfinite(time)] for time in times.values()]
            first = min((float(each.min()) for each in finite if len(each)), default=0.0)
            last = max((float(each.max()) for each in finite if len(each)), default=first)
            shifted = {
                topic: _non_decreasing(time - first + offset) for topic, time in times.items()
            }
            timed.append((offset, shifted))
            offset += last - first
        return timed


def _columns(recording: Recording) -> Iterator[tuple[str, str, FloatArray]]:
    """Yield name in a mapping, topic and values of each column."""
    for topic in recording.topics:
        for field, values in topic.fields.items():
            yield (f"{topic.name}.{field}" if topic.name else field), topic.name, values


def _non_decreasing(time: FloatArray) -> FloatArray:
    """Return times of which none precedes an earlier one: the largest so far."""
    is_known = np.isfinite(time)
    if is_known.all() and np.all(np.diff(time) >= 0.0):
        return time
    first = time[is_known].min() if is_known.any() else 0.0
    return np.asarray(np.maximum.accumulate(np.where(is_known, time, first)))


def _join(pieces: list[tuple[FloatArray, FloatArray]]) -> DecimatedSeries:
    """Return a series of successive pieces."""
    if len(pieces) == 1:
        return DecimatedSeries.of(*pieces[0])
    time, values = (np.concatenate(each) for each in zip(*pieces, strict=True))
    return DecimatedSeries.of(time, values)


_files, _logs, _inspections = LatestCache[Files](), LatestCache[Log](), LatestCache[Inspection]()


def _stamp(project: Project) -> tuple[object, ...]:
    """Return the logs as they are combined, with sizes and times of their files."""
    logs = project.log_paths
    paths = [Path(each) for log in logs for each in split_joined_paths(log)]
    files = [each for path in paths for each in ([path] if path.is_file() else path.rglob("*"))]
    stats = [(str(each), each.stat()) for each in files if each.is_file()]
    return logs, tuple((name, stat.st_size, stat.st_mtime_ns) for name, stat in stats)


def read_files(project: Project) -> Files:
    """Return the recordings of a project."""
    logs = project.log_paths

    def read() -> Files:
        with suppress_warnings():
            return Files(tuple(read_recordings(logs)))

    return _files.get(_stamp(project), read)


def resolve_content(project: Project, text: str) -> dict[str, Any]:
    """Return the content of the text of a mapping with `extends` resolved."""
    return resolve_extends(parse_content(text, MAPPING), project.path(MAPPING))


def parse_mapping(project: Project, text: str) -> LogMapping | None:
    """Return the mapping of a text, None of an empty one."""
    if not text.strip():
        return None
    return LogMapping.from_dict(parse_content(text, MAPPING), str(project.path(MAPPING)))


def make_log(project: Project, text: str) -> Log:
    """Return the log of the recordings of a project by the text of a mapping."""
    files = read_files(project)
    with suppress_warnings():
        return combine_recordings(files.recordings, parse_mapping(project, text))


def _log_key(project: Project, text: str) -> object:
    return _stamp(project), repr(resolve_content(project, text))


def read_log(project: Project) -> Log:
    """Return the log of a project by its mapping."""
    text = project.text(MAPPING)
    return _logs.get(_log_key(project, text), lambda: make_log(project, text))


def inspect_project(project: Project) -> Inspection:
    """Return the quality report of the log of a project by its mapping."""
    files, text = read_files(project), project.text(MAPPING)
    key, mapping = _log_key(project, text), parse_mapping(project, text)
    vehicle, _ = read_vehicle(project)
    models: tuple[DampingModel, ...] = ()
    if gains := project.text(MODEL).strip():
        with suppress(HydrodampError):  # the command says what is wrong with an edited file
            models = tuple(read_models(project.path(MODEL)))
    requirements = None if vehicle is None else partial(find_requirements, vehicle, models=models)

    def report() -> Inspection:
        with suppress_warnings():
            inspection = inspect(files.probe, files.recordings, mapping, requirements)
        if (log := inspection.log) is not None:
            _logs.get(key, lambda: log)  # one log in memory, not two
        return inspection

    files_key = project.arguments.vehicle, project.text(VEHICLE), gains
    return _inspections.get((key, *files_key), report)


def read_vehicle(project: Project) -> tuple[Vehicle | None, str]:
    """Return the vehicle of a project, or None and the reason."""
    name = project.arguments.vehicle
    if not name:
        return None, ""
    try:
        with suppress_warnings():
            if name == VEHICLE:
                return parse_vehicle(project.text(VEHICLE), source=VEHICLE), ""
            return find_vehicle(name), ""
    except HydrodampError as error:
        return None, str(error)
