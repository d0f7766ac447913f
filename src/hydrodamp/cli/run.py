"""The work of compare and demo: fits, then replays; what is finished outlives Ctrl-C."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from hydrodamp.cli.experiment import Key, fit_all, key_of
from hydrodamp.cli.output import note
from hydrodamp.cli.progress import progress

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Fit, Method
    from hydrodamp.models.model import DampingModel
    from hydrodamp.simulation.replay import AttitudeSource
    from hydrodamp.simulation.score import RateUnit
    from hydrodamp.validation.comparison import Comparison, Row
    from hydrodamp.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Task:
    """What is to be compared.

    Attributes
    ----------
    vehicle : Vehicle
        Everything known.
    train, test : Log
        To identify on, and to replay on.
    models : sequence of DampingModel
        Which terms.
    methods : sequence of Method
        How.
    attitude, rate_unit : str
        Of the scores.
    earlier : mapping of (str, str) to Fit
        Fits by model and method that are there already.
    """

    vehicle: Vehicle
    train: Log
    test: Log
    models: Sequence[DampingModel]
    methods: Sequence[Method]
    attitude: AttitudeSource = "measured"
    rate_unit: RateUnit = "deg"
    earlier: Mapping[Key, Fit] = field(default_factory=dict)

    @property
    def keys(self) -> tuple[Key, ...]:
        """Model and method of every row, in order."""
        return tuple((model.key, method.key) for method in self.methods for model in self.models)


@dataclass(frozen=True)
class Outcome:
    """What came of a task.

    Attributes
    ----------
    comparison : Comparison
        The rows that were finished.
    waiting : tuple of Fit
        Fits without a row.
    wanted : int
        How many rows were asked for.
    """

    comparison: Comparison
    waiting: tuple[Fit, ...]
    wanted: int

    @property
    def finished(self) -> bool:
        """Whether no row is missing."""
        return len(self.comparison.rows) == self.wanted


def carry_out(task: Task) -> Outcome:
    """Identify and replay; after Ctrl-C keep what is finished.

    Ctrl-C while fitting ends the fits, and those that are finished are replayed; once more
    ends the replays too.

    Parameters
    ----------
    task : Task
        What is to be compared.

    Returns
    -------
    outcome : Outcome
        All rows, or those there are.
    """
    fits = _fits(task)
    rows = _rows(task, fits)
    return Outcome(
        comparison=_comparison(task, rows),
        waiting=tuple(fit for fit, row in zip(fits, rows, strict=True) if row is None),
        wanted=len(task.keys),
    )


def _fits(task: Task) -> tuple[Fit, ...]:
    """Return the fits there are, in order."""
    found = {key: task.earlier[key] for key in task.keys if key in task.earlier}

    def keep(fit: Fit) -> None:
        found[key_of(fit)] = fit

    try:
        fit_all(task.vehicle, task.train, task.models, task.methods, keep, task.earlier)
    except KeyboardInterrupt:
        if found:
            note(
                f"interrupted with {len(found)} of {len(task.keys)} fits: replaying those. "
                "Ctrl-C again leaves that out."
            )
    return tuple(found[key] for key in task.keys if key in found)


def _rows(task: Task, fits: Sequence[Fit]) -> tuple[Row | None, ...]:
    """Return the row of each fit, None where it was not replayed."""
    from hydrodamp.validation.compare import compare

    found: dict[Key, Row] = {}
    if not fits:
        return ()
    try:
        with progress("replaying", len(fits)) as step:

            def keep(row: Row) -> None:
                found[key_of(row.fit)] = row
                step()

            compare(
                fits,
                task.vehicle,
                task.test,
                attitude=task.attitude,
                rate_unit=task.rate_unit,
                done=keep,
            )
    except KeyboardInterrupt:
        note(f"interrupted with {len(found)} of {len(fits)} replays")
    return tuple(found.get(key_of(fit)) for fit in fits)


def _comparison(task: Task, rows: Sequence[Row | None]) -> Comparison:
    from hydrodamp.report.unfinished import unfinished
    from hydrodamp.validation.compare import origin
    from hydrodamp.validation.comparison import Comparison

    there = tuple(row for row in rows if row is not None)
    whole = Comparison(
        rows=there,
        rate_unit=task.rate_unit,
        attitude=task.attitude,
        provenance=origin([row.fit for row in there], task.vehicle, task.test),
    )
    return whole if len(there) == len(task.keys) else unfinished(whole, len(task.keys))
