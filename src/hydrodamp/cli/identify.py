"""``hydrodamp identify``: estimate one model by one method and write its damping file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import hydrodamp as hd
from hydrodamp.cli import inputs, log_checks
from hydrodamp.cli.compare import fit_all, predict_missions
from hydrodamp.cli.output import fail, note, print_output, run_provenance
from hydrodamp.cli.parameters import GAINS, estimate_response, list_parameters, set_options
from hydrodamp.cli.report import report_paths, write_fit
from hydrodamp.files import as_json
from hydrodamp.results import check_new_file, check_results

if TYPE_CHECKING:
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
    from hydrodamp.identification.parameter_estimates import describe_estimates
    from hydrodamp.report.documents import fit_document, selection_document
    from hydrodamp.report.files import PICTURES

    logs, train = logs or [], train or []
    files = (*logs, *train, vehicle, inputs.model_file(model), mapping)
    if out is not None:
        figures, page = report_paths(out)
        for path in (out, page):
            check_new_file(path, force)
        check_results(figures, PICTURES, force)
    craft, listed = hd.find_vehicle(vehicle), inputs.find_model(model)
    estimator, provenance = hd.find_method(method), run_provenance(files)
    log = inputs.training_log(logs, train, mapping)
    log_checks.check_training(craft, log, listed.candidates(craft, log))
    names = list_parameters(estimate, craft)
    models = listed.complete(craft, log, GAINS in names)
    if response := estimate_response(craft, log, models, names):
        log = response.apply(log)
    problem = hd.prepare(craft, log, models)
    (estimator,) = set_options((estimator,), names, estimate, "--method")
    log_checks.warn_wrong_gains(problem, models)
    (fit,) = fit_all(problem, models, (estimator,), mapping=mapping)
    for line in describe_estimates(fit.estimates):
        note(line)
    if fit.vehicle is not None and fit.vehicle != craft:
        craft = fit.vehicle
        problem = hd.prepare(craft, log, models)
    grades: hd.Identifiability | None = None
    extra: list[str] = []
    if fit.status.usable and fit.model.n_coefficients:
        with _reason_of_failure("Coefficients are not graded", extra):
            grades = hd.grade_fit(problem, fit)
            fit = replace(fit, grades=grades.grades)
    comparison = hd.compare((fit,), craft, log)
    if fit.status.usable:
        comparison = predict_missions(comparison)
    document = fit_document(fit) | {"verdict": selection_document(comparison)}
    document["predicted_missions"] = comparison.missions
    text = as_json(document)
    tables = fit_output(comparison, grades, out, verbose)
    if json:
        for text in extra:
            note(text)
    if out is not None:
        document["paths"] = {"damping": str(out), "report": str(page)}
    if out is not None and fit.status.usable:
        details = [] if grades is None else [str(grades)]
        if not json:
            with _reason_of_failure("The residuals are not tested", details):
                details.append("\n".join(hd.diagnose(problem, fit.damping)))
        reported = replace(fit, remarks=(*fit.remarks, *filter(None, details), *extra))
        write_fit(reported, craft, log, comparison.provenance | provenance, out, text)
    print_output(json, document, *tables, *extra)
    if not fit.status.usable:
        fail(" ".join((fit.status.value, *fit.remarks)))


def fit_output(
    comparison: hd.Comparison, grades: hd.Identifiability | None, out: Path | None, verbose: bool
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


@contextmanager
def _reason_of_failure(failure: str, reasons: list[str]) -> Iterator[None]:
    """Add the reason to a list where a diagnostic fails."""
    try:
        yield
    except hd.HydrodampError as error:
        reasons.append(f"{failure}: {error}")
