"""The verb: many logs in, a fit for each group out, and what has changed between them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.batch.cache import StatisticsCache
from hydrodamp.batch.changepoints import ChangePoint, find_change_points
from hydrodamp.batch.discovery import digest_of_recording, expand_addresses
from hydrodamp.batch.executor import Failure, WorkerPool, open_pool
from hydrodamp.batch.grouping import (
    DATES,
    Group,
    assign_group,
    assign_vehicle,
    check_grouping,
    group_order,
    sort_groups,
)
from hydrodamp.batch.recordings import ResolvedMapping
from hydrodamp.batch.sufficient_statistics import (
    LogStatistics,
    grade_statistics,
    identify_logs,
    read_start,
    replay_log,
    solve_model,
)
from hydrodamp.errors import HydrodampError, ProblemError, demand
from hydrodamp.identification.fit import Fit, Method
from hydrodamp.identification.identifiability import Grade
from hydrodamp.identification.least_squares import LeastSquares, WeakForm
from hydrodamp.identification.methods import find_method
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle

#: Methods of which a log leaves triangles.
SUMMARISING = LeastSquares | WeakForm

Fits = tuple[Fit | None, ...]


@dataclass(frozen=True)
class GroupFit:
    """One model identified from the logs of one group.

    Attributes
    ----------
    group : tuple of str
        What its logs have in common, a word for each way of grouping.
    start : float
        When the first of them begins, by its clock [s].
    n_logs : int
        How many there are.
    fit : Fit
        Of all of them.
    rms : float or None
        Error of equation 24 of a replay of the first log with a fit to the others; None where
        there are no others, or it diverged.
    grades : tuple of Grade
        How well each coefficient is determined; empty where logs are not folded.
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
        How logs were grouped.
    fits : tuple of GroupFit
        Group by group in the order of ``order``, model by model.
    failed : dict of str to str
        Logs that a fit lacks, each with the reason.
    n_cached : int
        How many logs were folded in an earlier run.
    duplicates : dict of str to str
        Logs that are left out, as their group has another log with the same content: which.
    """

    by: tuple[str, ...]
    fits: tuple[GroupFit, ...]
    failed: dict[str, str]
    n_cached: int = 0
    duplicates: dict[str, str] = field(default_factory=dict)

    @cached_property
    def order(self) -> str:
        """What orders the groups: `date`, `clock`, or `name` where clocks count from boot."""
        return group_order(self.by, [one.start for one in self.fits])

    @cached_property
    def time_series(self) -> dict[str, tuple[GroupFit, ...]]:
        """The fits of a model in the order of time, of groups alike but for their day or month."""
        timed = not DATES.isdisjoint(self.by)
        found = dict[str, tuple[GroupFit, ...]]()
        for one in self.fits:
            pairs = zip(self.by, one.group, strict=True)
            alike = [part for way, part in pairs if timed and way not in DATES]
            name = " ".join((one.fit.model.key, *alike))
            found[name] = (*found.get(name, ()), one)
        return found

    @cached_property
    def changes(self) -> dict[str, tuple[ChangePoint, ...]]:
        """What changed for good between the days or months of each course."""
        if DATES.isdisjoint(self.by):
            return {}
        return {
            name: find_change_points([one.fit for one in its])
            for name, its in self.time_series.items()
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
        Files, folders with all logs beneath them, patterns, or URLs that fsspec knows.
    vehicle : Vehicle or iterable of Vehicle
        Everything known. Of several, a log is of the one whose name its path holds, and ``by``
        must hold ``vehicle``.
    models : DampingModel or iterable of DampingModel
        Which terms.
    method : str or Method
        ``weak`` and ``ls`` fold each log into triangles; every other method reads the logs of a
        group together.
    by : sequence of str
        ``vehicle``, ``day``, ``month`` (of the clock, else of the path), ``folder``, or patterns
        that the path holds: regular expressions, of which the first group counts.
    mapping : str, optional
        As for :func:`read_log`.
    client : Executor or distributed.Client, optional
        Where the work is done; by default processes of this machine.
    workers : int, optional
        How many of those.
    cache : str or path, optional
        Folder of the folds of logs: a log is folded once.
    timeout : float
        How long the work on one log may take from its start on a worker [s].
    exclude : str or path, optional
        Folder whose files are no logs, such as that of the results.

    Returns
    -------
    season : Season
        The fits, and the logs that are in none of them.

    Raises
    ------
    FileError
        If an address matches no log, or its store cannot be reached.
    LogError
        If the mapping is wrong.
    MethodError
        If there is no such method or way of grouping, or ``timeout`` is not positive.
    ProblemError
        If no log could be used.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from tempfile import TemporaryDirectory
    >>> import hydrodamp as hd
    >>> dives, where = hd.reenact(duration=60.0), TemporaryDirectory()
    >>> hd.write_log(dives.train, f"{where.name}/dive-2026-05-01.csv")
    >>> with ThreadPoolExecutor(1) as here:
    ...     season = batch(where.name, dives.vehicle, hd.catalog["linear"], client=here)
    >>> season.fits[0].group, season.fits[0].n_logs
    (('2026-05-01',), 1)
    >>> where.cleanup()
    """
    way = find_method(method) if isinstance(method, str) else method
    asked = (models,) if isinstance(models, DampingModel) else tuple(models)
    crafts = (vehicle,) if isinstance(vehicle, Vehicle) else tuple(vehicle)
    check_grouping(by, crafts)
    demand(timeout > 0.0, "timeout", "positive", timeout)
    given = [logs] if isinstance(logs, str | os.PathLike) else logs
    resolved = ResolvedMapping.of(mapping)
    addresses = expand_addresses((str(each) for each in given), resolved, exclude)
    folder = None if cache is None else Path(cache)
    caches = {each.name: StatisticsCache(folder, each, asked, way, resolved) for each in crafts}
    with open_pool(client, workers, timeout) as pool:
        groups = _read_groups(addresses, caches, tuple(by), pool)
        fits = _fit_groups(groups, asked, way, pool)
    if not fits:
        reasons = "; ".join(f"{log}: {why}" for log, why in [*groups.failed.items()][:3])
        raise ProblemError(f"none of {len(addresses)} logs could be used. {reasons}")
    return BatchResult(tuple(by), fits, groups.failed, groups.n_cached, groups.duplicates)


@dataclass
class _Group:
    """Logs of a group so far; the folds of all but the first are a tree, in their order."""

    cache: StatisticsCache
    logs: list[str] = field(default_factory=list)
    start: float = np.inf
    first: LogStatistics | None = None
    tree: list[LogStatistics | None] = field(default_factory=list)

    def add(self, log: str, start: float, folded: LogStatistics | None) -> None:
        """Add a log; its fold is carried up as in a binary counter, whoever was faster."""
        self.logs.append(log)
        self.start = min(self.start, start)
        if folded is None or len(self.logs) == 1:
            self.first = folded
            return
        for level, there in enumerate(self.tree):
            if there is None:
                self.tree[level] = folded
                return
            folded, self.tree[level] = there.merge(folded), None
        self.tree.append(folded)

    @property
    def others(self) -> LogStatistics | None:
        """All but the first."""
        found: LogStatistics | None = None
        for one in filter(None, self.tree):
            found = one if found is None else one.merge(found)
        return found

    @property
    def folded(self) -> LogStatistics | None:
        """All logs; None where they are not folded."""
        rest = self.others
        return self.first if rest is None or self.first is None else self.first.merge(rest)


@dataclass
class _Groups:
    """The groups in their order, and the logs that are in none."""

    groups: dict[Group, _Group] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)
    duplicates: dict[str, str] = field(default_factory=dict)
    n_cached: int = 0


def _read_groups(
    addresses: Sequence[str],
    caches: dict[str, StatisticsCache],
    by: tuple[str, ...],
    pool: WorkerPool,
) -> _Groups:
    """Fold each log, or read its start, and add it to its group."""
    found, groups, own = _Groups(), dict[Group, _Group](), dict[str, StatisticsCache]()
    first_logs: dict[tuple[Group, str], str] = {}
    for log in addresses:
        try:
            own[log] = caches[assign_vehicle(log, [*caches])]
        except HydrodampError as error:
            found.failed[log] = str(error)
    calls = [(cache, log) for log, cache in own.items()]
    results: Any = pool.map(_read_log, calls, "reading logs")
    for (log, cache), result in zip(own.items(), results, strict=True):
        if isinstance(result, Failure):
            found.failed[log] = result
            continue
        start, folded, digest, is_cached = result
        try:
            group = assign_group(by, log, cache.vehicle.name, start)
        except HydrodampError as error:
            found.failed[log] = str(error)
            continue
        if (first := first_logs.setdefault((group, digest), log)) != log:
            found.duplicates[log] = first
            continue
        found.n_cached += is_cached
        groups.setdefault(group, _Group(cache)).add(log, start, folded)
    order = sort_groups(by, {group: one.start for group, one in groups.items()})
    found.groups = {group: groups[group] for group in order}
    return found


def _read_log(cache: StatisticsCache, log: str) -> tuple[float, LogStatistics | None, str, bool]:
    """Return start, fold (None where methods fold nothing), digest, and if the cache had it."""
    if not isinstance(cache.method, SUMMARISING):
        digest = digest_of_recording(log, cache.mapping)
        return read_start(log, cache.mapping), None, digest, False
    folded, digest, is_cached = cache.summarise(log)
    return folded.start, folded, digest, is_cached


def _fit_groups(
    found: _Groups, models: tuple[DampingModel, ...], method: Method, pool: WorkerPool
) -> tuple[GroupFit, ...]:
    """Fit each group; replay its first log with a fit to the others."""
    several = {group: one for group, one in found.groups.items() if len(one.logs) > 1}
    if isinstance(method, SUMMARISING):
        failed = found.failed
        whole = {name: _solve(one, one.folded, failed) for name, one in found.groups.items()}
        others = {name: _solve(one, one.others, None) for name, one in several.items()}
    else:
        logs = {name: one.logs for name, one in found.groups.items()}
        whole = _identify(logs, found, pool)
        others = _identify({name: one.logs[1:] for name, one in several.items()}, found, pool)
    replays = [
        (one.logs[0], one.cache.vehicle, others[name], one.cache.mapping)
        for name, one in several.items()
        if name in others
    ]
    results = pool.map(replay_log, replays, "replaying")
    none = (None,) * len(models)
    errors = {
        name: none if isinstance(one, Failure) else one
        for name, one in zip(others, results, strict=True)
    }
    return tuple(
        GroupFit(name, one.start, len(one.logs), fit, rms, grade_statistics(one.folded, fit))
        for name, one in found.groups.items()
        if name in whole
        for fit, rms in zip(whole[name], errors.get(name, none), strict=True)
        if fit is not None
    )


def _solve(group: _Group, folded: LogStatistics | None, failed: dict[str, str] | None) -> Fits:
    """Solve each model; None, and the logs among those that failed, where that is not finite."""
    if folded is None:
        return ()
    fits: list[Fit | None] = []
    for model in group.cache.models:
        try:
            fits.append(solve_model(folded, group.cache.vehicle, model, group.cache.method))
        except ProblemError as error:
            fits.append(None)
            if failed is not None:
                failed |= dict.fromkeys(group.logs, str(error))
    return tuple(fits)


def _identify(logs: dict[Group, list[str]], found: _Groups, pool: WorkerPool) -> dict[Group, Fits]:
    """Identify from all logs of each group at once; a group that fails, fails with its logs."""
    caches = {name: found.groups[name].cache for name in logs}
    calls = [
        (logs[name], own.vehicle, own.models, own.method, own.mapping)
        for name, own in caches.items()
    ]
    fits: dict[Group, Fits] = {}
    results: Any = pool.map(identify_logs, calls, "identifying")
    for name, result in zip(logs, results, strict=True):
        if isinstance(result, Failure):
            found.failed |= dict.fromkeys(logs[name], result)
        else:
            fits[name] = tuple(_check_finite(fit, logs[name], found.failed) for fit in result)
    return fits


def _check_finite(fit: Fit, logs: Sequence[str], failed: dict[str, str]) -> Fit | None:
    if np.isfinite(fit.damping.coefficients).all():
        return fit
    why = f"the estimate of model '{fit.model.key}' is not finite."
    failed |= dict.fromkeys(logs, why)
    return None
