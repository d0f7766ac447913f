"""Batch identification: a fit for each group of logs, and change points between the groups."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.batch.cache import StatisticsCache
from hydrodamp.batch.discovery import ResolvedMapping, digest_of_recording, expand_addresses
from hydrodamp.batch.executor import Failure, Pool, open_pool
from hydrodamp.batch.groups import (
    DATES,
    ChangePoint,
    Group,
    assign_group,
    assign_vehicle,
    check_grouping,
    find_change_points,
    group_order,
    group_reasons,
    sort_groups,
)
from hydrodamp.batch.reading import read_start
from hydrodamp.batch.sufficient_statistics import (
    LogStatistics,
    grade_statistics,
    identify_logs,
    replay_log,
    solve_model,
)
from hydrodamp.errors import ProblemError, demand
from hydrodamp.identification.fit import Fit, Method
from hydrodamp.identification.grades import Grade
from hydrodamp.identification.least_squares import LeastSquares, WeakForm
from hydrodamp.identification.methods import find_method
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle

#: Methods with sufficient statistics.
SummarisingMethod = LeastSquares | WeakForm

Fits = tuple[Fit | None, ...]


@dataclass(frozen=True)
class GroupFit:
    """One model identified from the logs of one group.

    Attributes
    ----------
    group : tuple of str
        A label for each grouping key.
    start : float
        Clock time of the first sample [s].
    n_logs : int
        Number of logs.
    fit : Fit
        Estimate from all of them.
    rms : float or None
        RMS error (equation 24) of a replay of the first log with a fit to the others; None for a
        single log or a divergence.
    grades : tuple of Grade
        Grade of each coefficient; empty where the logs are too short.
    """

    group: Group
    start: float
    n_logs: int
    fit: Fit
    rms: float | None = None
    grades: tuple[Grade, ...] = ()


@dataclass(frozen=True)
class BatchResult:
    """The fits of all groups.

    Attributes
    ----------
    by : tuple of str
        Grouping keys.
    fits : tuple of GroupFit
        By group, in the order of ``order``, and by model.
    failed : dict of str to str
        Logs that could not be used, each with the reason.
    n_cached : int
        Number of logs whose statistics were in the cache.
    duplicates : dict of str to str
        Logs that are omitted, each with the log of the same group and content.
    outliers : tuple of str
        Implausible samples that are left out: file, channel, number, values and times.
    """

    by: tuple[str, ...]
    fits: tuple[GroupFit, ...]
    failed: dict[str, str]
    n_cached: int = 0
    duplicates: dict[str, str] = field(default_factory=dict)
    outliers: tuple[str, ...] = ()

    @cached_property
    def order(self) -> str:
        """The key that orders the groups: `date`, `clock`, or `name` if clocks count from boot."""
        return group_order(self.by, [fit.start for fit in self.fits])

    @cached_property
    def time_series(self) -> dict[str, tuple[GroupFit, ...]]:
        """The fits of a model in the order of time, for each combination of the other keys."""
        timed = not DATES.isdisjoint(self.by)
        series = dict[str, tuple[GroupFit, ...]]()
        for group_fit in self.fits:
            pairs = zip(self.by, group_fit.group, strict=True)
            labels = [label for key, label in pairs if timed and key not in DATES]
            name = " ".join((group_fit.fit.model.key, *labels))
            series[name] = (*series.get(name, ()), group_fit)
        return series

    @cached_property
    def changes(self) -> dict[str, tuple[ChangePoint, ...]]:
        """The change points of each time series of days or months."""
        if DATES.isdisjoint(self.by):
            return {}
        return {
            name: find_change_points([each.fit for each in series])
            for name, series in self.time_series.items()
        }


def batch(
    logs: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    vehicle: Vehicle | Iterable[Vehicle],
    models: DampingModel | Iterable[DampingModel],
    method: str | Method = "weak",
    *,
    by: Sequence[str] = ("day",),
    mapping: str | None = None,
    client: Any = None,
    workers: int | None = None,
    cache: str | os.PathLike[str] | None = None,
    timeout: float = 3600.0,
    exclude: str | os.PathLike[str] | None = None,
) -> BatchResult:
    """Identify models from many logs, group by group.

    Parameters
    ----------
    logs : str, path, or iterable of them
        Files, folders with their subfolders, patterns, or URLs that fsspec supports.
    vehicle : Vehicle or iterable of Vehicle
        Known parameters. With several vehicles, the path of each log must contain the name of
        one, and ``by`` must contain ``vehicle``.
    models : DampingModel or iterable of DampingModel
        Damping models.
    method : str or Method
        ``weak`` and ``ls`` reduce each log to sufficient statistics; other methods read all logs
        of a group at once.
    by : sequence of str
        ``vehicle``, ``day``, ``month`` (of the clock, else of the path), ``folder``, or regular
        expressions for the path, of which the first group is the label.
    mapping : str, optional
        As for :func:`read_log`.
    client : Executor or distributed.Client, optional
        Executor of the work; by default local processes.
    workers : int, optional
        Number of local processes.
    cache : str or path, optional
        Folder of cached statistics: each log is reduced once.
    timeout : float
        Longest work on one log, from its start on a worker [s].
    exclude : str or path, optional
        Folder whose files are not logs, such as that of the results.

    Returns
    -------
    result : BatchResult
        The fits, and the logs that could not be used.

    Raises
    ------
    FileError
        If an address matches no log, or its store is unreachable.
    LogError
        If the mapping is wrong.
    MethodError
        If a method or grouping key is unknown, or ``timeout`` is not positive.
    ProblemError
        If no log could be used.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from tempfile import TemporaryDirectory
    >>> import hydrodamp as hd
    >>> dives, folder = hd.reenact(duration=60.0), TemporaryDirectory()
    >>> hd.write_log(dives.train, f"{folder.name}/dive-2026-05-01.csv")
    >>> with ThreadPoolExecutor(1) as executor:
    ...     result = batch(folder.name, dives.vehicle, hd.catalog["linear"], client=executor)
    >>> result.fits[0].group, result.fits[0].n_logs
    (('2026-05-01',), 1)
    >>> folder.cleanup()
    """
    identifier = find_method(method)
    model_list = (models,) if isinstance(models, DampingModel) else tuple(models)
    vehicles = (vehicle,) if isinstance(vehicle, Vehicle) else tuple(vehicle)
    check_grouping(by, vehicles)
    demand(timeout > 0.0, "timeout", "positive", timeout)
    log_list = [logs] if isinstance(logs, str | os.PathLike) else logs
    resolved = ResolvedMapping.of(mapping)
    addresses = expand_addresses(map(str, log_list), resolved, exclude)
    folder = None if cache is None else Path(cache)
    caches = {
        each.name: StatisticsCache(folder, each, model_list, identifier, resolved)
        for each in vehicles
    }
    with open_pool(client, workers, timeout) as pool:
        groups = _read_groups(addresses, caches, tuple(by), pool)
        fits = _fit_groups(groups, model_list, identifier, pool)
    failed = {log: reason.removeprefix(f"{log}: ") for log, reason in groups.failed.items()}
    if not fits:
        raise ProblemError(
            f"none of {len(addresses)} logs could be used. {'; '.join(group_reasons(failed))}"
        )
    return BatchResult(tuple(by), fits, failed, groups.n_cached, groups.duplicates, groups.outliers)


@dataclass
class _Group:
    """Logs of a group; the statistics of all but the first are merged in a binary tree."""

    cache: StatisticsCache
    logs: list[str] = field(default_factory=list)
    start: float = np.inf
    first: LogStatistics | None = None
    tree: list[LogStatistics | None] = field(default_factory=list)

    def add(self, log: str, start: float, statistics: LogStatistics | None) -> None:
        """Add a log; merge statistics of equal numbers of logs, as a binary counter carries."""
        self.logs.append(log)
        self.start = min(self.start, start)
        if statistics is None or len(self.logs) == 1:
            self.first = statistics
            return
        for level, merged in enumerate(self.tree):
            if merged is None:
                self.tree[level] = statistics
                return
            statistics, self.tree[level] = merged.merge(statistics), None
        self.tree.append(statistics)

    @property
    def without_first(self) -> LogStatistics | None:
        """Statistics of all logs but the first; None for a single log."""
        merged: LogStatistics | None = None
        for statistics in filter(None, self.tree):
            merged = statistics if merged is None else statistics.merge(merged)
        return merged

    @property
    def statistics(self) -> LogStatistics | None:
        """Statistics of all logs; None for methods without."""
        later = self.without_first
        return self.first if later is None or self.first is None else self.first.merge(later)


@dataclass
class _Groups:
    """The groups in their order, and the logs that are in none."""

    groups: dict[Group, _Group] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)
    duplicates: dict[str, str] = field(default_factory=dict)
    n_cached: int = 0
    outliers: tuple[str, ...] = ()


def _read_groups(
    addresses: Sequence[str],
    caches: dict[str, StatisticsCache],
    by: Sequence[str],
    pool: Pool,
) -> _Groups:
    """Compute the statistics of each log, or read its start, and assign it to its group."""
    result, groups = _Groups(), dict[Group, _Group]()
    first_logs: dict[tuple[Group, str], str] = {}
    answers = pool.map(_read_log, [(caches, by, log) for log in addresses], "reading logs")
    for log, answer in zip(addresses, answers, strict=True):
        if isinstance(answer, Failure):
            result.failed[log] = answer
        elif (first := first_logs.setdefault((answer.group, answer.digest), log)) != log:
            result.duplicates[log] = first
        else:
            result.n_cached += answer.is_cached
            result.outliers += tuple(f"{log}: {text}" for text in answer.outliers)
            group = groups.setdefault(answer.group, _Group(caches[answer.vehicle]))
            group.add(log, answer.start, answer.statistics)
    order = sort_groups(by, {name: group.start for name, group in groups.items()})
    result.groups = {name: groups[name] for name in order}
    return result


class _LogResult(NamedTuple):
    vehicle: str
    group: Group
    start: float
    statistics: LogStatistics | None  # None for methods without
    digest: str
    is_cached: bool
    outliers: tuple[str, ...]


def _read_log(caches: dict[str, StatisticsCache], by: Sequence[str], log: str) -> _LogResult:
    cache = caches[vehicle := assign_vehicle(log, [*caches])]
    if isinstance(cache.method, SummarisingMethod):
        statistics, digest, is_cached = cache.summarise(log)
        start, outliers = statistics.start, statistics.outliers
    else:
        statistics, digest, is_cached = None, digest_of_recording(log, cache.mapping), False
        start, outliers = read_start(log, cache.mapping), ()
    group = assign_group(by, log, vehicle, start)
    return _LogResult(vehicle, group, start, statistics, digest, is_cached, outliers)


def _fit_groups(
    groups: _Groups, models: tuple[DampingModel, ...], method: Method, pool: Pool
) -> tuple[GroupFit, ...]:
    """Fit each group; replay its first log with a fit to the others."""
    several = {name: group for name, group in groups.groups.items() if len(group.logs) > 1}
    if isinstance(method, SummarisingMethod):
        fits = {k: _solve(x, x.statistics, groups.failed) for k, x in groups.groups.items()}
        test_fits = {k: _solve(x, x.without_first, {}) for k, x in several.items()}
    else:
        fits = _identify({k: x.logs for k, x in groups.groups.items()}, groups, pool)
        test_logs = {k: x.logs[1:] for k, x in several.items()}
        test_fits = _identify(test_logs, _Groups(groups.groups), pool)
    replays = [
        (group.logs[0], group.cache.vehicle, test_fits[name], group.cache.mapping)
        for name, group in several.items()
        if name in test_fits
    ]
    none = (None,) * len(models)
    errors = {
        name: none if isinstance(answer, Failure) else answer
        for name, answer in zip(test_fits, pool.map(replay_log, replays, "replaying"), strict=True)
    }
    return tuple(
        GroupFit(
            name, group.start, len(group.logs), fit, rms, grade_statistics(group.statistics, fit)
        )
        for name, group in groups.groups.items()
        if name in fits
        for fit, rms in zip(fits[name], errors.get(name, none), strict=True)
        if fit is not None
    )


def _solve(group: _Group, statistics: LogStatistics | None, failed: dict[str, str]) -> Fits:
    """Solve each model; where the estimate is not finite, None, and the logs fail."""
    if statistics is None:
        return ()
    fits: list[Fit | None] = []
    for model in group.cache.models:
        try:
            fits.append(solve_model(statistics, group.cache.vehicle, model, group.cache.method))
        except ProblemError as error:
            fits.append(None)
            failed |= dict.fromkeys(group.logs, str(error))
    return tuple(fits)


def _identify(logs: dict[Group, list[str]], groups: _Groups, pool: Pool) -> dict[Group, Fits]:
    """Identify from all logs of each group at once; the logs of a group fail together."""
    calls = []
    for name, paths in logs.items():
        cache = groups.groups[name].cache
        calls.append((paths, cache.vehicle, cache.models, cache.method, cache.mapping))
    fits: dict[Group, Fits] = {}
    answers = pool.map(identify_logs, calls, "identifying")
    for (name, paths), answer in zip(logs.items(), answers, strict=True):
        if isinstance(answer, Failure):
            groups.failed |= dict.fromkeys(paths, answer)
            continue
        groups.outliers += answer[1]
        is_finite = [np.isfinite(fit.damping.coefficients).all() for fit in answer[0]]
        fits[name] = tuple(f if ok else None for f, ok in zip(answer[0], is_finite, strict=True))
        for fit in itertools.compress(answer[0], np.logical_not(is_finite)):
            reason = f"the estimate of model '{fit.model.key}' is not finite."
            groups.failed |= dict.fromkeys(paths, reason)
    return fits
