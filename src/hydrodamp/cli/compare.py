"""Commands ``compare`` and ``demo``: identify models by several methods and rank them by error."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

import hydrodamp as hd
from hydrodamp.cli import inputs, log_checks, parameters
from hydrodamp.cli.output import (
    INTERRUPTED,
    check_out_folder,
    collected_warnings,
    fail,
    note,
    print_output,
    print_results,
    run_provenance,
)
from hydrodamp.cli.report import write_results
from hydrodamp.errors import demand
from hydrodamp.progress import progress
from hydrodamp.results import check_results

if TYPE_CHECKING:
    from hydrodamp.report.table import Table

Key = tuple[str, str]

#: The two methods of the paper, the second also with a memory, and the default method.
DEMO_METHODS = "ls,ai,ai-composite,recommended"


@dataclass(frozen=True)
class Task:
    """Input, output folder and settings of the replays of a comparison."""

    vehicle: hd.Vehicle
    train: hd.Log
    test: hd.Log
    models: Sequence[hd.DampingModel]
    methods: Sequence[hd.Method]
    out: Path | None
    settings: Mapping[str, Any]
    verbose: bool
    resume: bool
    force: bool
    mapping: str | None = None

    @property
    def rows(self) -> list[Key]:
        """Model and method of each requested row."""
        return [(model.key, method.key) for method, model in product(self.methods, self.models)]


def compare(
    vehicle: str = "",
    logs: list[str] | None = None,
    train: list[str] | None = None,
    test: list[str] | None = None,
    models: str | None = None,
    methods: str = "recommended",
    mapping: str | None = None,
    estimate: str | None = None,
    attitude: Literal["measured", "simulated"] = "measured",
    rate_unit: Literal["deg", "rad"] = "deg",
    horizon: float | None = None,
    out: Path | None = None,
    resume: bool = False,
    force: bool = False,
    verbose: bool = False,
    json: bool = False,
) -> None:
    """Identify models on training data, replay them on test data and rank them by RMS error."""
    from hydrodamp.validation.excitation import compare_logs

    logs, train, test = logs or [], train or [], test or []
    files = (*logs, *train, *test, *inputs.model_files(models), vehicle, mapping)
    check_out_folder(out, resume, force)
    craft, listed = hd.find_vehicle(vehicle), inputs.list_models(models)
    method_list, provenance = inputs.list_methods(methods), run_provenance(files)
    train_log, test_log, overlap = inputs.train_and_test(logs, train, test, mapping)
    if horizon is not None:
        runs = [test_log.time[segment.start : segment.stop] for segment in test_log.segments]
        longest = max(run[-1] - run[0] for run in runs)
        bounds = f"positive and at most {longest:.4g} s, the longest segment of the test data"
        demand(0.0 < horizon <= longest, "--horizon", bounds, f"{horizon:g}")
    log_checks.check_training(craft, train_log, listed.candidates(craft, train_log))
    log_checks.check_log(craft, test_log, listed.candidates(craft, test_log), train_log)
    for sentence in compare_logs(train_log, test_log, craft.axes).sentences:
        warnings.warn(sentence, hd.HydrodampWarning, stacklevel=2)
    names = parameters.list_parameters(estimate, craft)
    fitted_models = listed.complete(craft, train_log, parameters.GAINS in names)
    if response := parameters.estimate_response(craft, train_log, fitted_models, names):
        train_log, test_log = response.apply(train_log), response.apply(test_log)
    method_list = parameters.set_options(method_list, names, estimate, "--methods")
    log_checks.warn_wrong_gains(hd.prepare(craft, train_log, fitted_models), fitted_models)
    settings = {"attitude": attitude, "rate_unit": rate_unit, "horizon": horizon}
    options = settings, verbose, resume, force, mapping
    task = Task(craft, train_log, test_log, fitted_models, method_list, out, *options)
    run_comparison(task, overlap | provenance, json)


def demo(
    out: Path | None = None,
    seed: int = 0,
    truth: str = "sname",
    resume: bool = False,
    force: bool = False,
    verbose: bool = False,
    json: bool = False,
) -> None:
    """Simulate the experiment of the paper, identify all models and print Table I."""
    check_out_folder(out, resume, force)
    campaign = hd.reenact(seed=seed, truth=truth)
    if not json:
        train, test = (
            ", ".join(segment.name for segment in log.segments)
            for log in (campaign.train, campaign.test)
        )
        print_results(
            f"The paper's campaign, re-enacted on a simulated {campaign.vehicle.name} (seed "
            f"{seed}).\nTruth '{campaign.truth}': {campaign.note}\n"
            f"Identified on {train}; replayed on {test}.\n"
        )
    models, methods = inputs.list_models(None).models, inputs.list_methods(DEMO_METHODS)
    settings, switches = {"attitude": "measured", "rate_unit": "deg"}, (verbose, resume, force)
    craft, train_log, test_log = campaign.vehicle, campaign.train, campaign.test
    task = Task(craft, train_log, test_log, models, methods, out, settings, *switches)
    words = {"truth": campaign.truth, "note": campaign.note, "seed": str(seed)}
    run_comparison(task, words | run_provenance(()), json)


def fit_all(
    problem: hd.Problem,
    models: Sequence[hd.DampingModel],
    methods: Sequence[hd.Method],
    save: Callable[[hd.Fit], None] = lambda _: None,
    finished: Container[Key] = (),
    mapping: str | None = None,
) -> tuple[hd.Fit, ...]:
    """Compute the missing fits, with a progress bar per method and the mapping of their log."""
    fits, origin = tuple[hd.Fit, ...](), inputs.mapping_provenance(mapping)

    def trace(fit: hd.Fit) -> hd.Fit:
        return replace(fit, provenance=fit.provenance | origin)

    for number, method in enumerate(methods, start=1):
        missing = [model for model in models if (model.key, method.key) not in finished]
        counter = f" ({number} of {len(methods)})" if len(methods) > 1 else ""
        with progress(f"identifying by {method.key}{counter}", len(missing)) as step:

            def record_fit(fit: hd.Fit, step: Callable[..., None] = step) -> None:
                save(trace(fit))
                step()

            done = hd.identify_all(problem, missing, method, record_fit) if missing else ()
            fits += tuple(map(trace, done))
        parameters.note_stopped(method, done)
    return fits


def run_comparison(task: Task, provenance: dict[str, str], json: bool) -> None:
    """Identify, replay, write and print; after Ctrl-C with the finished rows and status 130.

    An interrupted run leaves a finished comparison in the folder as it is.
    """
    from hydrodamp.report.documents import comparison_document
    from hydrodamp.report.files import DAMPING, listed_fits

    comparison = compare_task(task, provenance)
    if any(row.rms is not None for row in comparison.rows):
        comparison = predict_missions(comparison)
    n_rows, n_requested = len(comparison.rows), len(task.rows)
    out, remark = task.out, ""
    if out is not None and n_rows < n_requested and listed_fits(out) is not None:
        out, remark = None, f"The earlier comparison in {out} stays. "
    if n_rows:
        if out is not None and n_rows == n_requested:
            write_results(comparison, task.vehicle, task.train, out)
        elif out is not None:
            hd.write_comparison(comparison, out)
        damping = None if out is None else out / DAMPING
        paths = {} if damping is None else {"folder": str(out), "damping": str(damping)}
        document = comparison_document(comparison) | {"paths": paths}
        tables = comparison_output(comparison, damping, task.verbose, n_rows == n_requested)
        print_output(json, document, *tables)
    if n_rows < n_requested:
        suffix = "With `--out DIR`" if task.out is None else f"In {task.out / 'fits'}"
        note(
            f"interrupted: {n_rows} of {n_requested} rows. {remark}{suffix} finished fits are "
            "kept; the same command with `--resume` continues with the others."
        )
        raise typer.Exit(INTERRUPTED)
    if all(row.rms is None for row in comparison.rows):
        outcomes = dict.fromkeys(row.status.word for row in comparison.rows)
        fail(
            f"no row has an RMS error ({', '.join(outcomes)}): check units, axes and signs "
            "(`hydrodamp probe`), then try models with fewer terms, another method, or a log with "
            "richer excitation."
        )


def predict_missions(comparison: hd.Comparison) -> hd.Comparison:
    """Return a comparison whose verdict states the predicted errors of standard missions."""
    from hydrodamp.experiment_design.standard_missions import describe_missions
    from hydrodamp.validation.compare import MISSIONS

    text = "\n".join(describe_missions(comparison.select().row.fit))
    provenance = comparison.provenance | ({MISSIONS: text} if text else {})
    return replace(comparison, provenance=provenance)


def check_resume(folder: Path, fits: Iterable[hd.Fit], force: bool) -> None:
    """Refuse to overwrite a comparison unless it is unfinished and these are fits of its run."""
    from hydrodamp.report.documents import names_of
    from hydrodamp.report.files import RESULTS, listed_fits

    names, listed = {*names_of(fits)}, listed_fits(folder)
    if force or not names <= (listed or set()):
        return
    if listed is not None:
        raise hd.FileError(
            f"{folder}: holds a finished comparison, so there is nothing to resume. Name another "
            "folder, or replace it with `--force`; `--resume --force` reuses its fits of this call."
        )
    check_results(folder, RESULTS, force)


def comparison_output(
    comparison: hd.Comparison, damping: Path | None, verbose: bool, is_whole: bool
) -> tuple[Table, ...]:
    """Return the verdict with the next command of a whole run, the table of rows, and details."""
    from hydrodamp.report.comparison_tables import brief_table, detail_tables, summary_tables
    from hydrodamp.report.verdict_tables import verdict_table

    if all(row.blocks is None for row in comparison.rows):
        return summary_tables(comparison)
    verdict = comparison.verdict()
    notes = [] if damping is None else [f"File: {damping}."]
    if not verdict.remedy and damping is not None:
        target = inputs.suggest_target(comparison.select().row.fit.model)
        notes = [f"{notes[0]} Next: `hydrodamp export {target} {damping} --out exported`."]
    elif not verdict.remedy:
        notes = ["Next: the same command with `--out DIR` writes the damping file and a report."]
    details = (*detail_tables(comparison), *summary_tables(comparison)) if verbose else ()
    return (verdict_table(verdict, notes if is_whole else ()), brief_table(comparison), *details)


def compare_task(task: Task, provenance: dict[str, str]) -> hd.Comparison:
    """Return the comparison; after Ctrl-C only the finished rows."""
    from hydrodamp.identification.fit import digest
    from hydrodamp.report.files import COMPARISON, read_finished_fit, write_fit
    from hydrodamp.report.narrative import RESUMED, UNFINISHED
    from hydrodamp.validation.compare import comparison_provenance

    fits: dict[Key, hd.Fit] = {}
    rows: dict[Key, hd.Row] = {}
    problem = hd.prepare(task.vehicle, task.train, task.models)
    if task.resume and task.out is not None:
        for method, model in product(task.methods, task.models):
            key = model.key, method.key
            if fit := read_finished_fit(task.out, *key, digest(problem, model, method)):
                fits[key] = fit
        check_resume(task.out, fits.values(), task.force)
        provenance[RESUMED] = f"{len(fits)} of {len(task.rows)} fits from an earlier run"
    if task.out is not None and (task.out / COMPARISON).is_file():
        suffix = "; finished fits are reused" if task.resume else ""
        note(
            f"{task.out} contains an earlier comparison, which will be replaced when this run is "
            f"complete{suffix}."
        )

    def save(fit: hd.Fit) -> None:
        fits[fit.model.key, fit.method] = fit
        if task.out is not None and fit.status.usable:
            write_fit(fit, task.out)

    try:
        fit_all(problem, task.models, task.methods, save, tuple(fits), task.mapping)
    except KeyboardInterrupt:
        note(f"interrupted with {len(fits)} of {len(task.rows)} fits, which are replayed.")
    finished = hd.grade_fits(problem, [fits[key] for key in task.rows if key in fits])
    with suppress(KeyboardInterrupt), progress("replaying", len(finished)) as step:

        def collect(row: hd.Row) -> None:
            rows[row.model, row.method] = row
            step()

        if finished:
            hd.compare(finished, task.vehicle, task.test, **task.settings, done=collect)
    words = comparison_provenance(finished, task.vehicle, task.test) | provenance
    if len(rows) < len(task.rows):
        words[UNFINISHED] = f"{len(rows)} of {len(task.rows)} rows: interrupted"
    ordered = tuple(rows[key] for key in task.rows if key in rows)
    rate_unit, attitude = task.settings["rate_unit"], task.settings["attitude"]
    return hd.Comparison(ordered, rate_unit, attitude, words | collected_warnings())
