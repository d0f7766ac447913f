"""The work of compare and demo: fits, each kept as it comes, then replays."""

from __future__ import annotations

import shlex
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from hydrodamp.cli.output import INTERRUPTED, WORK_FAILED, emit, fail, note, results, warned
from hydrodamp.errors import HydrodampError, HydrodampWarning, ProblemError
from hydrodamp.progress import progress

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Fit, Method
    from hydrodamp.models.model import DampingModel
    from hydrodamp.simulation.problem import Problem
    from hydrodamp.simulation.replay import AttitudeSource
    from hydrodamp.simulation.score import RateUnit
    from hydrodamp.validation.compare import Comparison, Row
    from hydrodamp.vehicle.vehicle import Vehicle

Key = tuple[str, str]


@dataclass(frozen=True)
class Task:
    """What is to be compared, and where results go."""

    vehicle: Vehicle
    train: Log
    test: Log
    models: Sequence[DampingModel]
    methods: Sequence[Method]
    out: Path | None
    attitude: AttitudeSource = "measured"
    rate_unit: RateUnit = "deg"

    @property
    def size(self) -> int:
        """How many rows there shall be."""
        return len(self.models) * len(self.methods)


def check_log(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> None:
    """Refuse a log that cannot serve, or has a column that nothing uses; say what looks wrong."""
    from hydrodamp.conditioning.suspicions import suspicions
    from hydrodamp.simulation import checks

    free = tuple(model.restricted_to(vehicle.axes) for model in models)
    faults: list[HydrodampError] = []
    for check, asked in ((checks.check_log, free), (checks.check_columns_used, models)):
        try:
            check(vehicle, log, asked)
        except HydrodampError as error:
            faults.append(error)
    if len(faults) == 1:
        raise faults[0]
    if faults:
        raise ProblemError("\n".join(map(str, faults)))
    for one in suspicions(log):
        if one.channel not in log.command_names:  # the vehicle says what its commands are
            warnings.warn(f"{log.source or 'log'}: {one}", HydrodampWarning, stacklevel=2)


def check_training(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> None:
    """Refuse what :func:`check_log` does, and fewer samples than every model needs."""
    check_log(vehicle, log, models)
    needed = [max(map(len, model.restricted_to(vehicle.axes).terms), default=0) for model in models]
    if log.n < min(needed):
        raise ProblemError(
            f"{log.source or 'log'}: {log.n} samples are fewer than the largest axis of every "
            f"model asked for; the smallest needs {min(needed)}. Give a longer log."
        )


def check_attitude(attitude: str, log: Log) -> None:
    """Refuse to simulate an attitude that the log does not begin with."""
    if attitude == "simulated" and log.attitude is None:
        raise ProblemError(
            f"{log.source or 'log'}: a simulated attitude starts from a recorded one, and the log "
            "has none: leave out `--attitude simulated`, or record roll pitch yaw."
        )


def fit_all(
    problem: Problem,
    models: Sequence[DampingModel],
    methods: Sequence[Method],
    fits: dict[Key, Fit],
    keep: Callable[[Fit], None] = lambda _: None,
) -> None:
    """Add the fits that are missing, with a bar a method: their rates differ much."""
    from hydrodamp.identification.methods import identify_all

    for place, method in enumerate(methods, start=1):
        missing = [model for model in models if (model.key, method.key) not in fits]
        which = f" ({place} of {len(methods)})" if len(methods) > 1 else ""
        with progress(f"identifying by {method.key}{which}", len(missing)) as step:

            def kept(fit: Fit, step: Callable[..., None] = step) -> None:
                fits[fit.model.key, fit.method] = fit
                keep(fit)
                step()

            if missing:
                identify_all(problem, missing, method, kept)


def carry_out(task: Task, said: dict[str, str], resume: bool, json: bool) -> None:
    """Identify, replay, write and print; after Ctrl-C with what is finished and status 130."""
    from hydrodamp.report.comparison_tables import comparison_grids
    from hydrodamp.report.documents import comparison_document
    from hydrodamp.report.files import WRITTEN, write_comparison
    from hydrodamp.report.grid import show

    if task.out is not None and not resume and (task.out / "comparison.json").is_file():
        note(f"{task.out} holds an earlier comparison, which this one replaces.")
    comparison = _compared(task, said, resume)
    finished = len(comparison.rows) == task.size
    if comparison.rows:
        if json:
            emit(comparison_document(comparison))
        else:
            show(results(), *comparison_grids(comparison))
        if task.out is not None:
            write_comparison(comparison, task.out)
    if not finished:
        note(f"interrupted: {len(comparison.rows)} of {task.size} rows. {_how_to_go_on(task.out)}")
        raise typer.Exit(INTERRUPTED)
    if task.out is not None:
        from hydrodamp.cli.report import illustrate

        also = illustrate(comparison, task.vehicle, task.train, task.out)
        note(f"written to {task.out}: {', '.join((WRITTEN, *also))}")
    if all(row.rms is None for row in comparison.rows):
        outcomes = dict.fromkeys(row.status.word for row in comparison.rows)
        fail(
            f"no row has an RMS error ({', '.join(outcomes)}): check units, axes and signs first "
            "(`hydrodamp probe`), then try models with fewer terms, another method, or a log with "
            "richer manoeuvres.",
            WORK_FAILED,
        )


def _compared(task: Task, said: dict[str, str], resume: bool) -> Comparison:
    """Return the comparison, or after Ctrl-C the rows that are finished."""
    from hydrodamp.report.words import UNFINISHED
    from hydrodamp.validation.compare import Comparison, origin

    fits: dict[Key, Fit] = {}
    rows: list[Row] = []
    try:
        earlier = _fit(task, fits, resume)
        if earlier:
            said["resumed"] = f"{earlier} of {task.size} fits are of an earlier run"
    except KeyboardInterrupt:
        if fits:
            note(f"interrupted with {len(fits)} of {task.size} fits: replaying those.")
    ordered = [
        fits[model.key, method.key]
        for method in task.methods
        for model in task.models
        if (model.key, method.key) in fits
    ]
    try:
        _replay(task, ordered, rows)
    except KeyboardInterrupt:
        note(f"interrupted with {len(rows)} of {len(fits)} replays")
    done = {id(row.fit): row for row in rows}
    finished = [done[id(fit)] for fit in ordered if id(fit) in done]
    words = {**origin(ordered, task.vehicle, task.test), **said}
    if len(finished) < task.size:
        words[UNFINISHED] = f"{len(finished)} of {task.size} rows: interrupted"
    if lines := warned():
        words["warnings"] = "\n".join(lines)
    return Comparison(tuple(finished), task.rate_unit, task.attitude, words)


def _fit(task: Task, fits: dict[Key, Fit], resume: bool) -> int:
    """Make the fits that are missing; return how many an earlier run had made."""
    from hydrodamp.identification.fit import digest
    from hydrodamp.report.files import kept_fits, write_fit
    from hydrodamp.simulation.problem import prepare

    problem = prepare(task.vehicle, task.train, task.models)
    there = kept_fits(task.out) if resume and task.out is not None else {}
    for method in task.methods:
        for model in problem.models:
            if kept := there.get(digest(problem, model, method)):
                fits[model.key, method.key] = kept
    n_kept = len(fits)

    def keep(fit: Fit) -> None:
        if task.out is not None and fit.status.usable:
            write_fit(fit, task.out)

    fit_all(problem, task.models, task.methods, fits, keep)
    return n_kept


def _replay(task: Task, fits: Sequence[Fit], rows: list[Row]) -> None:
    from hydrodamp.validation.compare import compare

    if fits:
        with progress("replaying", len(fits)) as step:

            def keep(row: Row) -> None:
                rows.append(row)
                step()

            compare(
                fits,
                task.vehicle,
                task.test,
                attitude=task.attitude,
                rate_unit=task.rate_unit,
                done=keep,
            )


def _how_to_go_on(out: Path | None) -> str:
    if out is None:
        return "With `--out DIR` finished fits are kept, and `--resume` does the rest."
    words = sys.argv[1:]
    if "--resume" not in words:
        words.insert(1, "--resume")
    return f"Finished fits are kept in {out / 'fits'}. To do the rest: " + shlex.join(
        ["hydrodamp", *words]
    )
