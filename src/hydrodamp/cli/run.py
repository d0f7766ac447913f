"""The work of compare and demo: fits, then replays; what is finished outlives what goes wrong."""

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
    """What is to be compared."""

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
    """What came of a task."""

    comparison: Comparison
    waiting: tuple[Fit, ...]
    wanted: int
    failure: Exception | None = None

    @property
    def finished(self) -> bool:
        """Whether no row is missing."""
        return len(self.comparison.rows) == self.wanted


def carry_out(task: Task) -> Outcome:
    """Identify and replay; after Ctrl-C or a failure keep what is finished."""
    import hydrodamp.report.files  # noqa: F401  # before the work: nothing is to load after Ctrl-C

    fits = {key: task.earlier[key] for key in task.keys if key in task.earlier}
    rows: dict[Key, Row] = {}
    failures: list[Exception] = []
    try:
        _fit_and_replay(task, fits, rows, failures)
    except KeyboardInterrupt:
        if fits:
            note(f"interrupted with {len(rows)} of {len(fits)} replays")
    except Exception as error:
        failures.append(error)
    failure = failures[0] if failures else None
    if failure is not None and not fits:
        raise failure
    return Outcome(
        comparison=_comparison(task, [rows[key] for key in task.keys if key in rows], failure),
        waiting=tuple(fits[key] for key in task.keys if key in fits and key not in rows),
        wanted=len(task.keys),
        failure=failure,
    )


def _fit_and_replay(
    task: Task, fits: dict[Key, Fit], rows: dict[Key, Row], failures: list[Exception]
) -> None:
    """Fit what is missing, then replay what there is, whatever ended the fits."""

    def keep(fit: Fit) -> None:
        fits[key_of(fit)] = fit

    try:
        fit_all(task.vehicle, task.train, task.models, task.methods, keep, task.earlier)
    except KeyboardInterrupt:
        if fits:
            note(
                f"interrupted with {len(fits)} of {len(task.keys)} fits: replaying those. "
                "Ctrl-C again leaves that out."
            )
    except Exception as error:
        failures.append(error)
        if fits:
            note(f"failed with {len(fits)} of {len(task.keys)} fits: replaying those.")
    if fits:
        _replay(task, [fits[key] for key in task.keys if key in fits], rows)


def _replay(task: Task, fits: Sequence[Fit], rows: dict[Key, Row]) -> None:
    from hydrodamp.validation.compare import compare

    with progress("replaying", len(fits)) as step:

        def keep(row: Row) -> None:
            rows[key_of(row.fit)] = row
            step()

        compare(
            fits,
            task.vehicle,
            task.test,
            attitude=task.attitude,
            rate_unit=task.rate_unit,
            done=keep,
        )


def _comparison(task: Task, rows: Sequence[Row], failure: Exception | None) -> Comparison:
    from hydrodamp.report.unfinished import unfinished
    from hydrodamp.validation.compare import origin
    from hydrodamp.validation.comparison import Comparison

    there = Comparison(
        rows=tuple(rows),
        rate_unit=task.rate_unit,
        attitude=task.attitude,
        provenance=origin([row.fit for row in rows], task.vehicle, task.test),
    )
    if len(rows) == len(task.keys):
        return there
    why = "interrupted" if failure is None else f"ended by an error ({type(failure).__name__})"
    return unfinished(there, len(task.keys), why)
