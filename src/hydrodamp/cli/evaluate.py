"""Commands ``simulate`` and ``validate``: replay a log, and cross-validate over its segments."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import hydrodamp as hd
from hydrodamp.cli import inputs, log_checks
from hydrodamp.cli.compare import fit_all
from hydrodamp.cli.output import (
    INTERRUPTED,
    check_out_log,
    fail,
    note,
    print_output,
)
from hydrodamp.errors import ModelError
from hydrodamp.files import save_json
from hydrodamp.progress import count_items, progress
from hydrodamp.results import check_new_file


def simulate(
    logs: list[str],
    damping: str,
    vehicle: str = "",
    mapping: str | None = None,
    attitude: Literal["measured", "simulated"] = "measured",
    rate_unit: Literal["deg", "rad"] = "deg",
    out: Path | None = None,
    force: bool = False,
    json: bool = False,
) -> None:
    """Replay a log open loop with an identified model and report the RMS error."""
    from hydrodamp.basis.term import VELOCITY_OF
    from hydrodamp.identification import dissipativity
    from hydrodamp.models.damping import foreign_to
    from hydrodamp.report.comparison_tables import replay_table
    from hydrodamp.report.documents import axes_document, score_document
    from hydrodamp.report.table import Table
    from hydrodamp.simulation.block_errors import block_errors
    from hydrodamp.simulation.checks import estimate_length
    from hydrodamp.simulation.problem import vehicle_stamp
    from hydrodamp.validation.excitation import (
        compare_excitation,
        describe_overlap,
        find_shared_segments,
        find_untested,
    )
    from hydrodamp.validation.verdict import describe_fits, judge_axes

    check_out_log(out, force)
    numbers, fit, craft = inputs.read_damping_and_vehicle(damping, vehicle)
    if message := foreign_to(numbers, vehicle_stamp(craft)):
        raise ModelError(message)
    log = inputs.read_logs_as_fitted(logs, mapping, fit)
    log_checks.warn_quality_issues(log, estimate_length(craft))
    with progress("replaying"):
        trajectory = hd.simulate(craft, numbers, log, attitude=attitude)
    scored = hd.score(trajectory, rate_unit=rate_unit)
    band, predicted, extrapolated = None, dict[str, float | None](), tuple[str, ...]()
    if fit is not None and fit.damping.covariance is not None:
        band = hd.predict_error(craft, fit, log)
        predicted, extrapolated = band.rms_by_axis(craft.axes, rate_unit), band.extrapolated
    if out is not None and not scored.diverged:
        hd.write_log(simulated_log(trajectory, band), out)
        note(f"written to {out}")
    title = f"{numbers.model.title} on {log.source}, attitude {trajectory.attitude}"
    trained = {} if fit is None else fit.training_range
    driven = dissipativity.velocity_ranges(trajectory.log.velocity, craft.axes)
    grades, overlap = {}, ""
    untested = find_untested([compare_excitation(trained, driven)])
    if fit is not None:
        grades, overlap = fit.grades, find_shared_segments((fit,), trajectory.log)
    if overlap:
        untested = dict.fromkeys(map(VELOCITY_OF.__getitem__, craft.axes), "training data")
    errors = block_errors(trajectory, rate_unit)
    axes = tuple(judge_axes(errors, grades, {}, untested))
    document = {
        "model": numbers.model.key,
        "axes": axes_document(axes),
        **score_document(scored, trajectory.attitude),
        "predicted_error_by_axis": predicted or None,
        "extrapolated": extrapolated,
    }
    notes = [describe_overlap(overlap)] if overlap else []
    lights = Table("", (), (), (describe_fits(axes), *notes))
    print_output(json, document, lights, replay_table(title, scored, predicted, extrapolated))
    ranges = dissipativity.join_ranges(trained, driven)
    for sentence in (
        *dissipativity.range_exceedance_warnings(trained, driven),
        *dissipativity.energy_injection_warnings(numbers, ranges),
    ):
        note(sentence)
    if scored.diverged:
        fail(
            f"the replay diverged in {scored.divergence_text}: there is no RMS error, and no file "
            "is written."
        )


def simulated_log(trajectory: hd.Trajectory, band: hd.PredictionBand | None) -> hd.Log:
    """Return the log with simulated instead of measured velocities and, if known, their band."""
    import numpy as np

    from hydrodamp.basis.term import VELOCITIES, VELOCITY_OF

    log = trajectory.log
    names = tuple(VELOCITY_OF[axis] for axis in trajectory.axes)
    if band is not None:
        width = band.half_width[:, [VELOCITIES.index(name) for name in names]]
        widths = tuple(f"{name}_half_width" for name in names)
        columns = [k for k, name in enumerate(log.command_names) if name not in widths]
        commands = np.hstack([log.commands[:, columns], width])
        names_kept = (log.command_names[k] for k in columns)
        log = replace(log, commands=commands, command_names=(*names_kept, *widths))
    return replace(
        log,
        velocity=trajectory.velocity,
        velocity_names=names,
        attitude=log.attitude if trajectory.attitude == "measured" else None,
        acceleration=None,
        position=None,
        specific_force=None,
        source=f"replay of {log.source or 'log'}",
    )


def validate(
    logs: list[str],
    vehicle: str = "",
    models: str | None = None,
    methods: str = "recommended",
    mapping: str | None = None,
    folds: int | None = None,
    attitude: Literal["measured", "simulated"] = "measured",
    rate_unit: Literal["deg", "rad"] = "deg",
    out: Path | None = None,
    force: bool = False,
    verbose: bool = False,
    json: bool = False,
) -> None:
    """Cross-validate models over the segments of a log; report errors by prediction horizon."""
    from hydrodamp.identification.estimated_vehicle import estimated_vehicle
    from hydrodamp.report.comparison_tables import fold_table, horizon_table, validation_document
    from hydrodamp.report.narrative import describe_forms
    from hydrodamp.report.verdict_tables import selection_table, verdict_table
    from hydrodamp.validation.cross_validation import split_holdout

    check_new_file(out, force)
    craft, listed = hd.find_vehicle(vehicle), inputs.list_models(models)
    method_list, log = inputs.list_methods(methods), inputs.read_logs(logs, mapping)
    selected = (hd.StepwiseSelection(),) if listed.selects_terms else ()
    log_checks.check_training(craft, log, listed.candidates(craft, log))
    fitted_models = listed.complete(craft, log)
    replay: dict[str, Any] = {"attitude": attitude, "rate_unit": rate_unit}
    count, tables = len(split_holdout(log, folds)), list[hd.CrossValidation]()
    full_fit: tuple[Any, ...] = ((), ())
    is_interrupted = False
    try:
        with progress("cross-validating", count * len(method_list) * len(fitted_models)) as done:
            hd.cross_validate(
                craft,
                log,
                (*listed.unselected(craft, log), *selected),
                method_list,
                folds=folds,
                done=lambda _: done(),
                keep=tables.append,
                **replay,
            )
        if verbose or json or out is not None:
            problem = hd.prepare(craft, log, fitted_models)
            fits = fit_all(problem, fitted_models, method_list)
            scores = [
                hd.horizon_scores(estimated_vehicle(craft, fit), fit.damping, log, **replay)
                if fit.status.usable
                else None
                for fit in count_items(fits, "replaying windows", len(fits))
            ]
            full_fit = fits, scores
    except KeyboardInterrupt:
        if not tables:
            raise
        is_interrupted = True
    document = validation_document(tables[-1], *full_fit)
    if out is not None:
        document["paths"] = {"validation": str(out)}
        save_json(document, out)
        note(f"written to {out}")
    details = [fold_table(tables[-1])]
    if verbose and full_fit[0]:
        details.append(horizon_table(*full_fit))
    if any(row.blocks is not None for row in tables[-1].rows):
        verdict, selection = tables[-1].verdict(), tables[-1].select()
        model = inputs.locate_model(models or "", verdict.model)
        words = ["hydrodamp", "identify", *logs, "--vehicle", str(vehicle)]
        words += ["--mapping", str(mapping)] if mapping else []
        words += ["--model", model, "--method", verdict.method, "--out", "damping.json"]
        next_step = () if verdict.remedy else (f"Next: `{shlex.join(words)}`.",)
        summary = selection_table(tables[-1].rows, selection, rate_unit)
        forms = describe_forms(tables[-1].rows)
        summary = replace(summary, notes=(*summary.notes, *forms))
        details = [verdict_table(verdict, next_step), summary, *(details if verbose else ())]
    print_output(json, document, *details)
    if is_interrupted:
        message = f"interrupted after {len(tables)} of {count} folds; no errors by horizon."
        fail(message, INTERRUPTED)
    if all(row.n_failed_folds == len(row.folds) for row in tables[-1].rows):
        fail("no model has an error on any fold: use a longer log or models with fewer terms.")
