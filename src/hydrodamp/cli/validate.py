"""``hydrodamp validate``: cross-validate models over the segments of a log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.data_split import read_logs
from hydrodamp.cli.output import INTERRUPTED, emit, fail, note, print_results
from hydrodamp.progress import count_items, progress


def validate(
    logs: options.SomeLogs,
    vehicle: options.VehicleName = "",
    models: options.Models = None,
    methods: options.Methods = options.DEFAULT_METHOD,
    mapping: options.MappingFile = None,
    folds: Annotated[int | None, options.option("validate-folds")] = None,
    attitude: options.Attitude = "measured",
    rate_unit: options.Rates = "deg",
    out: Annotated[Path | None, options.option("validate-out")] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Cross-validate models over the segments of a log; report errors by prediction horizon."""
    from hydrodamp.cli.comparison_run import check_training, fit_all
    from hydrodamp.cli.provenance import check_out_file
    from hydrodamp.files import save_json
    from hydrodamp.report.comparison_tables import fold_table, horizon_table, validation_document
    from hydrodamp.validation.cross_validation import split_holdout

    files = map(resolve.model_file, resolve.split_names(models or ""))
    check_out_file(out, (*logs, *files, vehicle, mapping), force)
    vehicle_model, listed = resolve.find_vehicle(vehicle), resolve.list_models(models)
    method_list, log = resolve.list_methods(methods), read_logs(logs, mapping)
    selected = (hd.StepwiseSelection(),) if listed.selects_terms else ()
    check_training(vehicle_model, log, listed.candidates(vehicle_model, log))
    fitted_models = listed.complete(vehicle_model, log)
    count, tables = len(split_holdout(log, folds)), list[hd.CrossValidation]()
    full_fit: tuple[Any, ...] = ((), ())
    try:
        with progress("cross-validating", count * len(method_list) * len(fitted_models)) as done:
            hd.cross_validate(
                vehicle_model,
                log,
                (*listed.models, *selected),
                method_list,
                folds=folds,
                attitude=attitude,
                rate_unit=rate_unit,
                done=lambda _: done(),
                keep=tables.append,
            )
        problem = hd.prepare(vehicle_model, log, fitted_models)
        fits = fit_all(problem, fitted_models, method_list)
        scores = [
            hd.horizon_scores(
                vehicle_model, fit.damping, log, attitude=attitude, rate_unit=rate_unit
            )
            if fit.status.usable
            else None
            for fit in count_items(fits, "replaying windows", len(fits))
        ]
        full_fit = fits, scores
    except KeyboardInterrupt:
        if not tables:
            raise
    document = validation_document(tables[-1], *full_fit)
    if out is not None:
        save_json(document, out)
        note(f"written to {out}")
    if json:
        emit(document)
    else:
        print_results(fold_table(tables[-1]), *([horizon_table(*full_fit)] if full_fit[0] else []))
    if not full_fit[0]:
        message = f"interrupted after {len(tables)} of {count} folds; no errors by horizon."
        fail(message, INTERRUPTED)
    if all(row.rms_of_completed is None for row in tables[-1].rows):
        fail("no model has an error on any fold: use a longer log or models with fewer terms.")
