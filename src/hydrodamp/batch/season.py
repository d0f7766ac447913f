"""The verb: many logs in, a fit for each group out, and what has changed between them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.batch.addresses import check_by, craft_of, expanded, group_of
from hydrodamp.batch.crew import Crew, Failed, crew
from hydrodamp.batch.drift import Change, changes
from hydrodamp.batch.folding import Folded, begins, graded, identified, replayed, solved
from hydrodamp.batch.keeping import Kept
from hydrodamp.errors import HydrodampError, ProblemError
from hydrodamp.identification.fit import Fit, Method
from hydrodamp.identification.grades import Grade
from hydrodamp.identification.linear import LeastSquares, WeakForm
from hydrodamp.identification.methods import find_method
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle

#: Methods of which a log leaves triangles.
FOLDING = LeastSquares | WeakForm

#: Ways of grouping that tell the time.
_TIMES = {"day", "month"}

Name = tuple[str, ...]
Fits = tuple[Fit, ...]


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

    group: Name
    start: float
    n_logs: int
    fit: Fit
    rms: float | None = None
    grades: tuple[Grade, ...] = ()


@dataclass(frozen=True)
class Season:
    """The fits of all groups.

    Attributes
    ----------
    by : tuple of str
        How logs were grouped.
    fits : tuple of GroupFit
        Group by group in the order of time, model by model.
    failed : dict of str to str
        Logs that are in no fit, each with the reason.
    n_kept : int
        How many logs had been folded in an earlier run.
    """

    by: tuple[str, ...]
    fits: tuple[GroupFit, ...]
    failed: dict[str, str]
    n_kept: int = 0

    @cached_property
    def courses(self) -> dict[str, tuple[GroupFit, ...]]:
        """The fits of a model in the order of time, of groups alike but for their day or month."""
        timed = not _TIMES.isdisjoint(self.by)
        found = dict[str, tuple[GroupFit, ...]]()
        for one in self.fits:
            pairs = zip(self.by, one.group, strict=True)
            alike = [part for way, part in pairs if timed and way not in _TIMES]
            name = " ".join((one.fit.model.key, *alike))
            found[name] = (*found.get(name, ()), one)
        return found

    @cached_property
    def changes(self) -> dict[str, tuple[Change, ...]]:
        """What changed for good between the days or months of each course."""
        if _TIMES.isdisjoint(self.by):
            return {}
        return {name: changes([one.fit for one in its]) for name, its in self.courses.items()}


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
    patience: float = 3600.0,
) -> Season:
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
        Folder where the folds of logs are kept: a log is folded once.
    patience : float
        How long one log may take before it is given up [s].

    Returns
    -------
    season : Season
        The fits, and the logs that are in none of them.

    Raises
    ------
    FileError
        If an address matches no log.
    MethodError
        If there is no such method or way of grouping.
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
    check_by(by, crafts)
    given = [logs] if isinstance(logs, str | os.PathLike) else logs
    places = expanded(str(one) for one in given)
    folder = None if cache is None else Path(cache)
    kept = {one.name: Kept(folder, one, asked, way, mapping) for one in crafts}
    with crew(client, workers, patience) as team:
        found = _sorted(places, kept, tuple(by), team)
        fits = _fits(found, asked, way, team)
    if not fits:
        told = "; ".join(f"{place}: {why}" for place, why in [*found.failed.items()][:3])
        raise ProblemError(f"none of {len(places)} logs could be used. {told}")
    return Season(tuple(by), fits, found.failed, found.n_kept)


@dataclass
class _Group:
    """Logs of a group so far; the folds of all but the first are a tree, in their order."""

    kept: Kept
    logs: list[str] = field(default_factory=list)
    start: float = np.inf
    first: Folded | None = None
    tree: list[Folded | None] = field(default_factory=list)

    def add(self, log: str, start: float, folded: Folded | None) -> None:
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
            folded, self.tree[level] = there.merged(folded), None
        self.tree.append(folded)

    @property
    def others(self) -> Folded | None:
        """All but the first."""
        found: Folded | None = None
        for one in filter(None, self.tree):
            found = one if found is None else one.merged(found)
        return found

    @property
    def folded(self) -> Folded | None:
        """All logs; None where they are not folded."""
        rest = self.others
        return self.first if rest is None or self.first is None else self.first.merged(rest)


@dataclass
class _Sorted:
    """What has come of the logs: groups in the order of time, and those that failed."""

    groups: dict[Name, _Group] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)
    n_kept: int = 0


def _sorted(
    places: Sequence[str], kept: dict[str, Kept], by: tuple[str, ...], team: Crew
) -> _Sorted:
    """Fold each log, or ask when it begins, and put it into its group."""
    found, groups, own = _Sorted(), dict[Name, _Group](), dict[str, Kept]()
    for place in places:
        try:
            own[place] = kept[craft_of(place, [*kept])]
        except HydrodampError as error:
            found.failed[place] = str(error)
    made: Any = team.each(_begun, [(one, place) for place, one in own.items()], "reading logs")
    for (place, one), result in zip(own.items(), made, strict=True):
        if isinstance(result, Failed):
            found.failed[place] = result
            continue
        start, folded, is_kept = result
        found.n_kept += is_kept
        try:
            name = group_of(by, place, one.vehicle.name, start)
        except HydrodampError as error:
            found.failed[place] = str(error)
            continue
        groups.setdefault(name, _Group(one)).add(place, start, folded)
    order = sorted(groups, key=lambda name: (groups[name].start, name))
    found.groups = {name: groups[name] for name in order}
    return found


def _begun(kept: Kept, place: str) -> tuple[float, Folded | None, bool]:
    """Return when a log begins, its fold where its method folds, and whether it was there."""
    if not isinstance(kept.method, FOLDING):
        return begins(place, kept.mapping), None, False
    folded, is_kept = kept.fold(place)
    return folded.start, folded, is_kept


def _fits(
    found: _Sorted, models: tuple[DampingModel, ...], method: Method, team: Crew
) -> tuple[GroupFit, ...]:
    """Fit each group; replay its first log with a fit to the others."""
    more = {name: one for name, one in found.groups.items() if len(one.logs) > 1}
    if isinstance(method, FOLDING):
        whole = {name: _solved(one.kept, one.folded) for name, one in found.groups.items()}
        rest = {name: _solved(one.kept, one.others) for name, one in more.items()}
    else:
        whole = _identified({name: one.logs for name, one in found.groups.items()}, found, team)
        rest = _identified({name: one.logs[1:] for name, one in more.items()}, found, team)
    own = {name: found.groups[name] for name in rest}
    replays = [
        (one.logs[0], one.kept.vehicle, rest[name], one.kept.mapping) for name, one in own.items()
    ]
    made = team.each(replayed, replays, "replaying")
    none = (None,) * len(models)
    errors = {
        name: none if isinstance(one, Failed) else one for name, one in zip(rest, made, strict=True)
    }
    return tuple(
        GroupFit(name, one.start, len(one.logs), fit, rms, graded(one.folded, fit))
        for name, one in found.groups.items()
        if name in whole
        for fit, rms in zip(whole[name], errors.get(name, none), strict=True)
    )


def _solved(kept: Kept, folded: Folded | None) -> Fits:
    if folded is None:
        return ()
    return tuple(solved(folded, kept.vehicle, model, kept.method) for model in kept.models)


def _identified(groups: dict[Name, list[str]], found: _Sorted, team: Crew) -> dict[Name, Fits]:
    """Identify from all logs of each group at once; a group that fails, fails with its logs."""
    own = {name: found.groups[name].kept for name in groups}
    asked = [
        (logs, own[name].vehicle, own[name].models, own[name].method, own[name].mapping)
        for name, logs in groups.items()
    ]
    fits = {}
    for name, one in zip(groups, team.each(identified, asked, "identifying"), strict=True):
        if isinstance(one, Failed):
            found.failed |= dict.fromkeys(groups[name], one)
        else:
            fits[name] = one
    return fits
