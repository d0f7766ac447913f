"""The work of compare and demo: fits, each kept as it comes, then replays."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Container, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import typer

import hydrodamp as hd
from hydrodamp.cli.output import INTERRUPTED, emit, fail, note, show, warned
from hydrodamp.cli.report import illustrate
from hydrodamp.errors import HydrodampWarning, ProblemError
from hydrodamp.progress import progress

Models = Sequence[hd.DampingModel]
Key = tuple[str, str]


@dataclass(frozen=True)
class Task:
    """What is to be compared, and where results go."""

    vehicle: hd.Vehicle
    train: hd.Log
    test: hd.Log
    models: Models
    methods: Sequence[hd.Method]
    out: Path | None
    attitude: Literal["measured", "simulated"] = "measured"
    rate_unit: Literal["deg", "rad"] = "deg"
    horizon: float | None = None

    @property
    def rows(self) -> list[Key]:
        """Model and method of each row that there shall be."""
        return [(model.key, method.key) for method in self.methods for model in self.models]


def check_log(
    vehicle: hd.Vehicle, log: hd.Log, models: Models, after: hd.Log | None = None
) -> None:
    """Refuse a log that cannot serve; say what nothing uses and what looks wrong."""
    from hydrodamp.cli.data_split import suspect
    from hydrodamp.simulation import checks

    checks.check_log(vehicle, log, [model.restricted_to(vehicle.axes) for model in models])
    for one in checks.unused(vehicle, log, models):
        warnings.warn(f"{log.source or 'log'}: {one}", HydrodampWarning, stacklevel=2)
    suspect(log, checks.length_of(vehicle), after)


def check_training(vehicle: hd.Vehicle, log: hd.Log, models: Models) -> None:
    """Check a log as any, name models that nothing drives, refuse too few samples for all."""
    from hydrodamp.conditioning.current import current_warning
    from hydrodamp.simulation.checks import nothing_drives

    check_log(vehicle, log, models)
    if carried := current_warning(log):
        warnings.warn(f"{log.source or 'log'}: {carried}", HydrodampWarning, stacklevel=2)
    free = [model.restricted_to(vehicle.axes) for model in models]
    for model in free:
        if told := nothing_drives(vehicle, log, (model,)):
            warnings.warn(f"'{model.key}' is refused: {told}", HydrodampWarning, stacklevel=2)
    needed = [max(map(len, model.terms), default=0) for model in free]
    if log.n < min(needed):
        raise ProblemError(
            f"{log.source or 'log'}: {log.n} samples are fewer than the largest axis of every "
            f"model asked for; the smallest needs {min(needed)}. Give a longer log."
        )


def fit_all(
    problem: hd.Problem,
    models: Models,
    methods: Sequence[hd.Method],
    keep: Callable[[hd.Fit], None] = lambda _: None,
    there: Container[Key] = (),
) -> tuple[hd.Fit, ...]:
    """Ask the actuation, and make the fits that are not there, with a bar a method."""
    from hydrodamp.validation.actuator_check import doubts

    for doubt in doubts(problem, models):
        warnings.warn(str(doubt), HydrodampWarning, stacklevel=2)
    fits: tuple[hd.Fit, ...] = ()
    for place, method in enumerate(methods, start=1):
        missing = [model for model in models if (model.key, method.key) not in there]
        which = f" ({place} of {len(methods)})" if len(methods) > 1 else ""
        with progress(f"identifying by {method.key}{which}", len(missing)) as step:

            def done(fit: hd.Fit, step: Callable[..., None] = step) -> None:
                keep(fit)
                step()

            fits += hd.identify_all(problem, missing, method, done) if missing else ()
    return fits


def carry_out(task: Task, said: dict[str, str], resume: bool, json: bool) -> None:
    """Identify, replay, write and print; after Ctrl-C with what is finished and status 130."""
    from hydrodamp.report.comparison_tables import detail_tables, summary_tables
    from hydrodamp.report.documents import comparison_document

    if task.out is not None and (task.out / "comparison.json").is_file():
        kept = "; finished fits stay" if resume else ""
        note(f"{task.out} holds an earlier comparison, which this one replaces{kept}.")
    comparison = _compared(task, said, resume)
    found, asked = len(comparison.rows), len(task.rows)
    if found:
        if task.out is not None:
            hd.write_comparison(comparison, task.out)
        if json:
            emit(comparison_document(comparison))
        else:
            show(*detail_tables(comparison), *summary_tables(comparison))
    if found < asked:
        kept = "With `--out DIR`" if task.out is None else f"In {task.out / 'fits'}"
        note(
            f"interrupted: {found} of {asked} rows. {kept} finished fits are kept, and the same "
            "command with `--resume` makes the rest."
        )
        raise typer.Exit(INTERRUPTED)
    if task.out is None:
        note("Nothing is kept: with `--out DIR` come the fits, tables, pictures and a report.")
    else:
        illustrate(comparison, task.vehicle, task.train, task.out)
    if all(row.rms is None for row in comparison.rows):
        outcomes = dict.fromkeys(row.status.word for row in comparison.rows)
        fail(
            f"no row has an RMS error ({', '.join(outcomes)}): check units, axes and signs first "
            "(`hydrodamp probe`), then try models with fewer terms, another method, or a log with "
            "richer manoeuvres."
        )


def _compared(task: Task, said: dict[str, str], resume: bool) -> hd.Comparison:
    """Return the comparison, or after Ctrl-C the rows that are finished."""
    from hydrodamp.report.narrative import RESUMED, UNFINISHED
    from hydrodamp.validation.compare import origin

    made: dict[Key, hd.Fit] = {}
    replayed: dict[Key, hd.Row] = {}
    try:
        earlier = _fit(task, made, resume)
        if resume:
            said[RESUMED] = f"{earlier} of {len(task.rows)} fits are of an earlier run"
    except KeyboardInterrupt:
        note(f"interrupted with {len(made)} of {len(task.rows)} fits: replaying those.")
    fits = [made[key] for key in task.rows if key in made]
    if fits:
        with suppress(KeyboardInterrupt):
            _replay(task, fits, replayed)
    rows = tuple(replayed[key] for key in task.rows if key in replayed)
    words = {**origin(fits, task.vehicle, task.test), **said, **warned()}
    if len(rows) < len(task.rows):
        words[UNFINISHED] = f"{len(rows)} of {len(task.rows)} rows: interrupted"
    return hd.Comparison(rows, task.rate_unit, task.attitude, words)


def _fit(task: Task, made: dict[Key, hd.Fit], resume: bool) -> int:
    """Make the fits that are missing; return how many an earlier run had made."""
    from hydrodamp.identification.fit import digest
    from hydrodamp.report.files import kept_fit, write_fit

    problem = hd.prepare(task.vehicle, task.train, task.models)
    if resume and task.out is not None:
        for method in task.methods:
            for model in task.models:
                name = model.key, method.key, digest(problem, model, method)
                if kept := kept_fit(task.out, *name):
                    made[model.key, method.key] = kept
    n_kept = len(made)

    def keep(fit: hd.Fit) -> None:
        made[fit.model.key, fit.method] = fit
        if task.out is not None and fit.status.usable:
            write_fit(fit, task.out)

    fit_all(problem, task.models, task.methods, keep, tuple(made))
    return n_kept


def _replay(task: Task, fits: Sequence[hd.Fit], replayed: dict[Key, hd.Row]) -> None:
    with progress("replaying", len(fits)) as step:

        def keep(row: hd.Row) -> None:
            replayed[row.model, row.method] = row
            step()

        hd.compare(
            fits,
            task.vehicle,
            task.test,
            attitude=task.attitude,
            rate_unit=task.rate_unit,
            horizon=task.horizon,
            done=keep,
        )
