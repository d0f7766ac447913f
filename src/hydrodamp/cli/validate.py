"""``hydrodamp validate``: which model, by leaving out each segment in turn."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.data_split import read
from hydrodamp.cli.output import INTERRUPTED, emit, fail, note, show
from hydrodamp.progress import count_items, progress


def validate(
    logs: options.SomeLogs,
    vehicle: options.VehicleName = "",
    models: options.Models = None,
    methods: options.Methods = options.DEFAULT_METHOD,
    mapping: options.MappingFile = None,
    folds: Annotated[
        int | None,
        typer.Option(min=2, help="How many. [default: one a segment, ten at most; five blocks]"),
    ] = None,
    attitude: options.Attitude = "measured",
    rate_unit: options.Rates = "deg",
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write what --json prints.")
    ] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Cross-validate models over the segments of a log, and score them at several horizons."""
    from hydrodamp.cli.comparison_run import check_training, fit_all
    from hydrodamp.cli.provenance import check_out_file
    from hydrodamp.files import save_json
    from hydrodamp.report.comparison_tables import fold_table, horizon_table, validation_document
    from hydrodamp.validation.cross_validation import split_holdout

    files = map(resolve.file_of, resolve.names(models or ""))
    check_out_file(out, (*logs, *files, vehicle, mapping), force)
    craft, given = resolve.choose_vehicle(vehicle), resolve.choose_models(models)
    ways, log = resolve.choose_methods(methods), read(logs, mapping)
    selected = (hd.StepwiseSelection(),) if resolve.selects(models) else ()
    check_training(craft, log, resolve.asked(models, craft, log, given))
    chosen = resolve.for_log(models, craft, log, given)
    count, tables = len(split_holdout(log, folds)), list[hd.CrossValidation]()
    whole: tuple[Any, ...] = ((), ())
    try:
        with progress("leaving out in turn", count * len(ways) * len(chosen)) as done:
            hd.cross_validate(
                craft,
                log,
                (*given, *selected),
                ways,
                folds=folds,
                attitude=attitude,
                rate_unit=rate_unit,
                done=lambda _: done(),
                keep=tables.append,
            )
        problem = hd.prepare(craft, log, chosen)
        fits = fit_all(problem, chosen, ways)
        scores = [
            hd.horizon_scores(craft, fit.damping, log, attitude=attitude, rate_unit=rate_unit)
            if fit.status.usable
            else None
            for fit in count_items(fits, "replaying from many places", len(fits))
        ]
        whole = fits, scores
    except KeyboardInterrupt:
        if not tables:
            raise
    document = validation_document(tables[-1], *whole)
    if out is not None:
        save_json(document, out)
        note(f"written to {out}")
    if json:
        emit(document)
    else:
        show(fold_table(tables[-1]), *([horizon_table(*whole)] if whole[0] else []))
    if not whole[0]:
        said = f"interrupted after {len(tables)} of {count} folds; no errors by horizon."
        fail(said, INTERRUPTED)
    if all(row.rms_of_completed is None for row in tables[-1].rows):
        fail("no model has an error on any fold: give a longer log or smaller models.")
