"""Command ``compare``: identify models by several methods and rank them by error."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

import hydrodamp as hd
from hydrodamp.cli import inputs, parameters
from hydrodamp.cli.output import (
    INTERRUPTED,
    WRONG_INPUT,
    check_out_folder,
    collected_warnings,
    fail,
    note,
    print_output,
    run_provenance,
)
from hydrodamp.cli.report import write_results
from hydrodamp.errors import FileError
from hydrodamp.results import check_results

if TYPE_CHECKING:
    from hydrodamp.report.table import Table
    from hydrodamp.validation.workflow import Study


def compare(
    vehicle: str = "",
    logs: list[str] | None = None,
    train: list[str] | None = None,
    test: list[str] | None = None,
    folds: int | None = None,
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
    """Identify models on training data, replay them on test data and rank them by their errors."""
    logs, train, test = logs or [], train or [], test or []
    check_division(train, test, folds, resume)
    files = (*logs, *train, *test, *inputs.model_files(models), vehicle, mapping)
    check_out_folder(out, resume, force)
    craft, request = hd.find_vehicle(vehicle), inputs.list_models(models)
    method_list, provenance = inputs.list_methods(methods), run_provenance(files)
    if folds is None:
        train_log, test_log, overlap = inputs.train_and_test(logs, train, test, mapping)
    else:
        train_log = inputs.training_log(logs, train, mapping)
        test_log, overlap, folds = train_log, {}, parameters.check_folds(train_log, folds)
    if horizon is not None:
        parameters.check_horizon(horizon, test_log, folds)
    study = parameters.prepare_study(
        craft, train_log, test_log, request, method_list, estimate, mapping
    )
    study = replace(study, attitude=attitude, rate_unit=rate_unit, horizon=horizon)
    if folds is None:
        study = replace(study, provenance=overlap | provenance)
        run_comparison(study, out, json, verbose=verbose, resume=resume, force=force)
        return
    values = [("--vehicle", vehicle), *(("--train", name) for name in train)]
    values += [("--mapping", mapping or ""), ("--estimate", estimate or "")]
    words = ["hydrodamp", "identify", *logs, *chain(*(pair for pair in values if pair[1]))]
    run_validation(study, folds, out, json, verbose, [*words, "--model", models or ""])


def check_division(train: list[str], test: list[str], folds: int | None, resume: bool) -> None:
    """Refuse a call without test data, or with two kinds of them."""
    if folds is None:
        for option, values in (("--train", train), ("--test", test)):
            if not values:
                syntax = "files, START:END in seconds of LOG, or its segments"
                fail(
                    f"`{option}` is missing: give {syntax}; or `--folds N` cross-validates LOG.",
                    WRONG_INPUT,
                )
    for option, value in (("--test", test), ("--resume", resume)):
        if folds is not None and value:
            fail(f"`{option}` and `--folds` exclude each other: leave one out.", WRONG_INPUT)


def run_comparison(
    study: Study, out: Path | None, json: bool, *, verbose: bool, resume: bool, force: bool
) -> None:
    """Identify, replay, write and print; after Ctrl-C with the finished rows and status 130.

    An interrupted run leaves a finished comparison in the folder as it is.
    """
    from hydrodamp.identification.fit_files import read_finished_fits, write_fit
    from hydrodamp.report.documents import comparison_document
    from hydrodamp.report.files import COMPARISON, DAMPING, listed_fits
    from hydrodamp.validation.workflow import assess_study

    finished, home = None, out
    if out is not None and resume:
        finished = read_finished_fits(out, study.digests)
        check_resume(out, finished.values(), force)
    if out is not None and (out / COMPARISON).is_file():
        suffix = "; finished fits are reused" if resume else ""
        note(
            f"{out} contains an earlier comparison, which will be replaced when this run is "
            f"complete{suffix}."
        )

    def save(fit: hd.Fit) -> None:
        if home is not None and fit.status.usable:
            write_fit(fit, home)

    assessment = assess_study(study, finished, save)
    comparison = assessment.comparison
    parameters.note_stopped(study.methods, [row.fit for row in comparison.rows])
    comparison = replace(comparison, provenance=comparison.provenance | collected_warnings())
    n_rows, n_requested, remark = len(comparison.rows), len(study.requests), ""
    if out is not None and n_rows < n_requested and listed_fits(out) is not None:
        out, remark = None, f"The earlier comparison in {out} stays. "
    if n_rows:
        if out is not None and n_rows == n_requested:
            write_results(replace(assessment, comparison=comparison), study.problem, out)
        elif out is not None:
            hd.write_comparison(comparison, out)
        damping = out / DAMPING if out is not None and (out / DAMPING).is_file() else None
        written = {"folder": out, "damping": damping}
        paths = {key: str(path) for key, path in written.items() if path is not None}
        document = comparison_document(comparison) | {"paths": paths}
        tables = comparison_output(comparison, damping, verbose, n_rows == n_requested)
        print_output(json, document, *tables)
    if n_rows < n_requested:
        suffix = "With `--out DIR`" if home is None else f"In {home / 'fits'}"
        saved = (
            f"{suffix} finished fits are kept; the same command with `--resume` continues with the "
            "others."
        )
        is_empty = home is not None and not (home / "fits").is_dir()
        saved = "No fit was finished." if is_empty else saved
        note(f"interrupted: {n_rows} of {n_requested} rows. {remark}{saved}")
        raise typer.Exit(INTERRUPTED)
    if all(row.rms is None for row in comparison.rows):
        outcomes = dict.fromkeys(row.status.word for row in comparison.rows)
        fail(
            f"no row has an RMS error ({', '.join(outcomes)}): check units, axes and signs "
            "(`hydrodamp probe`), then try models with fewer terms, another method, or a log with "
            "richer excitation."
        )


def check_resume(folder: Path, fits: Iterable[hd.Fit], force: bool) -> None:
    """Refuse to overwrite a comparison unless it is unfinished and these are fits of its run."""
    from hydrodamp.identification.fit_files import names_of
    from hydrodamp.report.files import RESULTS, listed_fits

    names, listed = {*names_of(fits)}, listed_fits(folder)
    if force or not names <= (listed or set()):
        return
    if listed is not None:
        raise FileError(
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


def run_validation(
    study: Study, folds: int, out: Path | None, json: bool, verbose: bool, command: list[str]
) -> None:
    """Cross-validate, write and print; after Ctrl-C with the finished folds and status 130.

    `command` identifies from the log, and ends with the list of models.
    """
    from hydrodamp.report.files import VALIDATION, save_validation
    from hydrodamp.report.validation_tables import detail_tables, error_table, validation_document
    from hydrodamp.report.verdict_tables import verdict_table
    from hydrodamp.validation.workflow import validate_study

    result = validate_study(study, folds, verbose or json or out is not None)
    table, document = result.table, validation_document(result)
    if out is not None:
        save_validation(document, out)
        document["paths"] = {"validation": str(out / VALIDATION)}
        note(f"written to {out / VALIDATION}")
    details = [*detail_tables(result)] if verbose else []
    if any(row.blocks is not None for row in table.rows):
        verdict, (*words, models) = table.verdict(), command
        words += [inputs.locate_model(models, verdict.model), "--method", verdict.method]
        line = shlex.join([*words, "--out", "damping.json"])
        next_step = () if verdict.remedy else (f"Next: `{line}`.",)
        details = [verdict_table(verdict, next_step), error_table(table), *details]
    print_output(json, document, *(details or detail_tables(result)))
    if not result.is_complete:
        message = f"interrupted after {len(table.held_out)} of {folds} folds; no errors by horizon."
        fail(message, INTERRUPTED)
    if all(row.n_failed_folds == len(row.folds) for row in table.rows):
        fail("no model has an error on any fold: use a longer log or models with fewer terms.")
