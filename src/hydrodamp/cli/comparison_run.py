"""Run of compare and demo: fits, each saved when it is finished, then replays."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Container, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import typer

import hydrodamp as hd
from hydrodamp.cli.output import INTERRUPTED, collected_warnings, emit, fail, note, print_results
from hydrodamp.cli.report import write_diagnostics
from hydrodamp.errors import HydrodampWarning, ProblemError
from hydrodamp.progress import progress

Models = Sequence[hd.DampingModel]
Key = tuple[str, str]


@dataclass(frozen=True)
class Task:
    """Input, settings and output folder of a comparison."""

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
        """Model and method of each requested row."""
        return [(model.key, method.key) for method in self.methods for model in self.models]


def check_log(
    vehicle: hd.Vehicle, log: hd.Log, models: Models, reference: hd.Log | None = None
) -> None:
    """Raise on an unsuitable log; warn of unused commands and of quality issues."""
    from hydrodamp.cli.data_split import warn_quality_issues
    from hydrodamp.simulation import checks

    checks.check_log(vehicle, log, [model.restricted_to(vehicle.axes) for model in models])
    for issue in checks.unused_commands(vehicle, log, models):
        warnings.warn(f"{log.source or 'log'}: {issue}", HydrodampWarning, stacklevel=2)
    warn_quality_issues(log, checks.estimate_length(vehicle), reference)


def check_training(vehicle: hd.Vehicle, log: hd.Log, models: Models) -> None:
    """Check a log; warn of models that it cannot excite; raise if it is too short for all."""
    from hydrodamp.conditioning.current import current_warning
    from hydrodamp.simulation.checks import missing_actuation

    check_log(vehicle, log, models)
    if carried := current_warning(log):
        warnings.warn(f"{log.source or 'log'}: {carried}", HydrodampWarning, stacklevel=2)
    free = [model.restricted_to(vehicle.axes) for model in models]
    for model in free:
        if refusal := missing_actuation(vehicle, log, (model,)):
            warnings.warn(f"'{model.key}' is refused: {refusal}", HydrodampWarning, stacklevel=2)
    needed = [max(map(len, model.terms), default=0) for model in free]
    if log.n < min(needed):
        raise ProblemError(
            f"{log.source or 'log'}: {log.n} samples are fewer than the terms of an axis; the "
            f"smallest model needs {min(needed)}. Use a longer log."
        )


def fit_all(
    problem: hd.Problem,
    models: Models,
    methods: Sequence[hd.Method],
    save: Callable[[hd.Fit], None] = lambda _: None,
    finished: Container[Key] = (),
) -> tuple[hd.Fit, ...]:
    """Compute the missing fits, with a progress bar per method."""
    fits: tuple[hd.Fit, ...] = ()
    for number, method in enumerate(methods, start=1):
        missing = [model for model in models if (model.key, method.key) not in finished]
        counter = f" ({number} of {len(methods)})" if len(methods) > 1 else ""
        with progress(f"identifying by {method.key}{counter}", len(missing)) as step:

            def record_fit(fit: hd.Fit, step: Callable[..., None] = step) -> None:
                save(fit)
                step()

            fits += hd.identify_all(problem, missing, method, record_fit) if missing else ()
    return fits


def run_comparison(task: Task, provenance: dict[str, str], resume: bool, json: bool) -> None:
    """Identify, replay, write and print; after Ctrl-C with the finished rows and status 130."""
    from hydrodamp.report.comparison_tables import detail_tables, summary_tables
    from hydrodamp.report.documents import comparison_document

    if task.out is not None and (task.out / "comparison.json").is_file():
        suffix = "; finished fits are reused" if resume else ""
        note(f"{task.out} contains an earlier comparison, which is overwritten{suffix}.")
    comparison = compare_task(task, provenance, resume)
    n_rows, n_requested = len(comparison.rows), len(task.rows)
    if n_rows:
        if task.out is not None:
            hd.write_comparison(comparison, task.out)
        if json:
            emit(comparison_document(comparison))
        else:
            print_results(*detail_tables(comparison), *summary_tables(comparison))
    if n_rows < n_requested:
        suffix = "With `--out DIR`" if task.out is None else f"In {task.out / 'fits'}"
        note(
            f"interrupted: {n_rows} of {n_requested} rows. {suffix} finished fits are kept; the "
            "same command with `--resume` continues with the others."
        )
        raise typer.Exit(INTERRUPTED)
    if task.out is None:
        note("Use `--out DIR` to write fits, tables, pictures and a report.")
    else:
        write_diagnostics(comparison, task.vehicle, task.train, task.out)
    if all(row.rms is None for row in comparison.rows):
        outcomes = dict.fromkeys(row.status.word for row in comparison.rows)
        fail(
            f"no row has an RMS error ({', '.join(outcomes)}): check units, axes and signs "
            "(`hydrodamp probe`), then try models with fewer terms, another method, or a log with "
            "richer excitation."
        )


def compare_task(task: Task, provenance: dict[str, str], resume: bool) -> hd.Comparison:
    """Return the comparison; after Ctrl-C only the finished rows."""
    from hydrodamp.report.narrative import RESUMED, UNFINISHED
    from hydrodamp.validation.compare import comparison_provenance

    fits_by_key: dict[Key, hd.Fit] = {}
    replayed: dict[Key, hd.Row] = {}
    try:
        earlier = fit_missing(task, fits_by_key, resume)
        if resume:
            provenance[RESUMED] = f"{earlier} of {len(task.rows)} fits from an earlier run"
    except KeyboardInterrupt:
        note(f"interrupted with {len(fits_by_key)} of {len(task.rows)} fits, which are replayed.")
    fits = [fits_by_key[key] for key in task.rows if key in fits_by_key]
    if fits:
        with suppress(KeyboardInterrupt):
            replay_fits(task, fits, replayed)
    rows = tuple(replayed[key] for key in task.rows if key in replayed)
    words = {
        **comparison_provenance(fits, task.vehicle, task.test),
        **provenance,
        **collected_warnings(),
    }
    if len(rows) < len(task.rows):
        words[UNFINISHED] = f"{len(rows)} of {len(task.rows)} rows: interrupted"
    return hd.Comparison(rows, task.rate_unit, task.attitude, words)


def fit_missing(task: Task, fits_by_key: dict[Key, hd.Fit], resume: bool) -> int:
    """Compute the missing fits; return the number of reused ones."""
    from hydrodamp.identification.fit import digest
    from hydrodamp.report.files import read_finished_fit, write_fit

    problem = hd.prepare(task.vehicle, task.train, task.models)
    if resume and task.out is not None:
        for method in task.methods:
            for model in task.models:
                name = model.key, method.key, digest(problem, model, method)
                if earlier_fit := read_finished_fit(task.out, *name):
                    fits_by_key[model.key, method.key] = earlier_fit
    n_reused = len(fits_by_key)

    def save(fit: hd.Fit) -> None:
        fits_by_key[fit.model.key, fit.method] = fit
        if task.out is not None and fit.status.usable:
            write_fit(fit, task.out)

    fit_all(problem, task.models, task.methods, save, tuple(fits_by_key))
    return n_reused


def replay_fits(task: Task, fits: Sequence[hd.Fit], replayed: dict[Key, hd.Row]) -> None:
    with progress("replaying", len(fits)) as step:

        def collect(row: hd.Row) -> None:
            replayed[row.model, row.method] = row
            step()

        hd.compare(
            fits,
            task.vehicle,
            task.test,
            attitude=task.attitude,
            rate_unit=task.rate_unit,
            horizon=task.horizon,
            done=collect,
        )
