"""``hydrodamp identify``: estimate one model by one method and write its damping file."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.data_split import training_log
from hydrodamp.cli.output import emit, fail, note, print_results
from hydrodamp.cli.report import report_paths, write_fit_report


def identify(
    vehicle: options.VehicleName = "",
    model: options.OneModel = "",
    logs: options.Logs = None,
    method: Annotated[str, options.option("identify-method")] = options.DEFAULT_METHOD,
    train: options.Train = None,
    mapping: options.MappingFile = None,
    estimate_gains: options.EstimateGains = False,
    check_actuators: Annotated[bool, options.option("identify-check-actuators")] = False,
    sensitivity: Annotated[bool, options.option("identify-sensitivity")] = False,
    next_dive: Annotated[bool, options.option("identify-next-dive")] = False,
    out: Annotated[Path | None, options.option("identify-out")] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Identify one model from a log, grade its coefficients and write a damping file."""
    from hydrodamp.cli.comparison_run import check_training, fit_all
    from hydrodamp.cli.provenance import check_out_file, run_provenance
    from hydrodamp.files import save_json
    from hydrodamp.report.documents import fit_document
    from hydrodamp.report.files import PICTURES
    from hydrodamp.report.fit_tables import fit_table
    from hydrodamp.results import check_results, remove_results

    inputs = (*(logs or ()), *(train or ()), vehicle, resolve.model_file(model), mapping)
    if out is not None:
        figures, page = report_paths(out)
        for path in (out, page):
            check_out_file(path, inputs, force)
        check_results(figures, PICTURES, force)
    vehicle_model, listed = resolve.find_vehicle(vehicle), resolve.find_model(model)
    estimator, provenance = hd.find_method(method), run_provenance(inputs)
    log = training_log(logs or (), train or (), mapping)
    check_training(vehicle_model, log, listed.candidates(vehicle_model, log))
    models = listed.complete(vehicle_model, log, estimate_gains)
    problem = hd.prepare(vehicle_model, log, models)
    if check_actuators:
        from hydrodamp.validation.sensitivity import check_gains

        for issue in check_gains(problem, models):
            warnings.warn(str(issue), hd.HydrodampWarning, stacklevel=2)
    (fit,) = fit_all(problem, models, (estimator,))
    if out is not None and fit.status.usable:
        page.unlink(missing_ok=True)
        remove_results(figures, PICTURES)
        save_json(fit_document(fit), out)
        note(f"written to {out}")
    grades: hd.Identifiability | None = None
    extra: list[str] = []
    if fit.status.usable and not json:
        try:
            grades = hd.grade_fit(problem, fit)
        except hd.HydrodampError as error:
            extra.append(f"Coefficients are not graded: {error}")
        if sensitivity:
            extra.append(describe_sensitivity(vehicle_model, log, fit))
    if json:
        emit(fit_document(fit))
    else:
        print_results(fit_table(replace(fit, remarks=()), grades), *extra)
    if not fit.status.usable:
        fail(" ".join((fit.status.value, *fit.remarks)))
    if out is not None:
        details = [] if json else describe_diagnostics(problem, fit, grades)
        reported = replace(fit, remarks=(*fit.remarks, *details, *extra))
        write_fit_report(reported, vehicle_model, log, provenance, out)
    elif not json:
        note("Use `--out FILE` to write the damping file and a report with all diagnostics.")
    if next_dive and grades is not None:
        from hydrodamp.experiment_design.plan import expected_gain

        note(expected_gain(problem, fit, grades) or "All coefficients are determined.")


def describe_diagnostics(
    problem: hd.Problem, fit: hd.Fit, grades: hd.Identifiability | None
) -> list[str]:
    """Return identifiability by axis and the tests of the residuals, for the report."""
    try:
        tests = "\n".join(hd.diagnose(problem, fit.damping))
    except hd.HydrodampError as error:
        tests = f"The residuals are not tested: {error}"
    return [text for text in (str(grades or ""), tests) if text]


def describe_sensitivity(vehicle: hd.Vehicle, log: hd.Log, fit: hd.Fit) -> str:
    """Return the sensitivity to vehicle parameters, by the weak form, or why there is none."""
    try:
        return str(hd.vehicle_sensitivity(vehicle, log, log, fit.model, hd.WeakForm()))
    except hd.HydrodampError as error:
        return f"The sensitivity to vehicle parameters is not known: {error}"
