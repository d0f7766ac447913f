"""``hydrodamp identify``: estimate one model by one method and write its damping file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import hydrodamp as hd
from hydrodamp.cli import inputs
from hydrodamp.cli.output import fail, note, print_output, run_provenance
from hydrodamp.cli.parameters import note_stopped, prepare_study
from hydrodamp.cli.report import report_paths, write_fit
from hydrodamp.files import as_json
from hydrodamp.results import check_new_file, check_results

if TYPE_CHECKING:
    from hydrodamp.identification.identifiability import Identifiability
    from hydrodamp.report.table import Table


def identify(
    vehicle: str = "",
    model: str = inputs.GENERAL,
    logs: list[str] | None = None,
    method: str = "recommended",
    train: list[str] | None = None,
    mapping: str | None = None,
    estimate: str | None = None,
    out: Path | None = None,
    force: bool = False,
    verbose: bool = False,
    json: bool = False,
) -> None:
    """Identify one model from a log, grade its coefficients and write a damping file."""
    from hydrodamp.identification.fit_files import fit_document
    from hydrodamp.identification.parameter_estimates import describe_estimates
    from hydrodamp.report.documents import selection_document
    from hydrodamp.report.files import PICTURES
    from hydrodamp.validation.workflow import assess_study

    logs, train = logs or [], train or []
    files = (*logs, *train, vehicle, inputs.model_file(model), mapping)
    if out is not None:
        figures, page = report_paths(out)
        for path in (out, page):
            check_new_file(path, force)
        check_results(figures, PICTURES, force)
    craft, request = hd.find_vehicle(vehicle), inputs.find_model(model)
    estimator, provenance = hd.find_method(method), run_provenance(files)
    log = inputs.training_log(logs, train, mapping)
    study = prepare_study(craft, log, log, request, (estimator,), estimate, mapping)
    assessment = assess_study(study)
    comparison = assessment.comparison
    (row,) = comparison.rows
    fit, graded = row.fit, assessment.graded.get((row.model, row.method))
    note_stopped(study.methods, (fit,))
    for line in describe_estimates(fit.estimates):
        note(line)
    document = fit_document(fit) | {"verdict": selection_document(comparison)}
    document["predicted_missions"] = comparison.missions
    text = as_json(document)
    grades = None if isinstance(graded, str) else graded
    extra = [f"Coefficients are not graded: {graded}"] if isinstance(graded, str) else []
    tables = fit_output(comparison, grades, out, verbose)
    if json:
        for each in extra:
            note(each)
    if out is not None:
        document["paths"] = {"damping": str(out), "report": str(page)}
    if out is not None and fit.status.usable:
        details = [] if grades is None else [str(grades)]
        words = comparison.provenance | provenance
        reported = replace(assessment, comparison=replace(comparison, provenance=words))
        write_fit(reported, study.problem, out, text, (*details, *extra))
    print_output(json, document, *tables, *extra)
    if not fit.status.usable:
        fail(" ".join((fit.status.value, *fit.remarks)))


def fit_output(
    comparison: hd.Comparison, grades: Identifiability | None, out: Path | None, verbose: bool
) -> tuple[Table, ...]:
    """Return the verdict on a fit with the next command, and its coefficients."""
    from hydrodamp.report.fit_tables import brief_fit_table, fit_table
    from hydrodamp.report.verdict_tables import verdict_table
    from hydrodamp.simulation.checks import CHANNEL_AXES

    (row,) = comparison.rows
    if row.blocks is None:
        return (fit_table(row.fit, grades),)
    notes = [*row.fit.warnings]
    if out is None:
        notes.append("The same command with `--out FILE` writes the damping file.")
    else:
        target, run = inputs.suggest_target(row.fit.model), row.trajectory
        export = f"; `hydrodamp export {target} {out} --out exported` exports it."
        has_wrench = run is not None and run.log.wrench is not None
        has_gains = not CHANNEL_AXES.keys().isdisjoint(row.fit.model.commands)
        is_exported = not row.divergences and (has_wrench or not has_gains)
        notes.append(f"File: {out}{export if is_exported else '.'}")
    is_complete = verbose or not row.fit.grades
    coefficients = fit_table(row.fit, grades) if is_complete else brief_fit_table(row.fit)
    verdict = verdict_table(comparison.verdict(), notes)
    return (verdict, coefficients.omit_notes(verdict.notes))
