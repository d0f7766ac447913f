"""``hydrodamp validate``: which model, by leaving out each segment in turn."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import INTERRUPTED, WORK_FAILED, emit, fail, note, results

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hydrodamp.identification.fit import Fit
    from hydrodamp.validation.crossvalidation import CrossValidation


def validate(
    logs: options.SomeLogs,
    vehicle: options.VehicleName,
    models: options.Models = None,
    methods: options.Methods = options.DEFAULT_METHOD,
    mapping: options.MappingFile = None,
    folds: Annotated[
        int | None,
        typer.Option(
            "--folds", min=2, help="How many. [default: one a segment, ten at most; five blocks]"
        ),
    ] = None,
    attitude: options.Attitude = options.AttitudeSource.measured,
    rate_unit: options.Rates = options.RateUnit.deg,
    json: options.Json = False,
) -> None:
    """Cross-validate models over the segments of a log, and score them at several horizons."""
    from hydrodamp.cli.choose import choose_methods, choose_models, selects
    from hydrodamp.cli.parts import read
    from hydrodamp.cli.work import check_attitude, check_training, fit_all
    from hydrodamp.errors import ModelError
    from hydrodamp.identification.weak import WeakEquations
    from hydrodamp.progress import counted, progress
    from hydrodamp.report.comparison_tables import fold_grid, horizon_grid, validation_document
    from hydrodamp.report.grid import show
    from hydrodamp.simulation.problem import prepare
    from hydrodamp.simulation.score import HORIZONS, scores_with_restarts
    from hydrodamp.validation.criteria import criteria
    from hydrodamp.validation.crossvalidation import cross_validate, holdouts
    from hydrodamp.vehicle.fleet import find_vehicle

    if selects(models):
        raise ModelError(
            "`sparse` is selected by leaving data out itself: compare it on data of its own, "
            "with `hydrodamp compare --models sparse`."
        )
    craft, chosen, ways = find_vehicle(vehicle), choose_models(models), choose_methods(methods)
    log = read(logs, mapping)
    check_training(craft, log, chosen)
    check_attitude(attitude.value, log)
    tables: list[CrossValidation] = []
    count = len(holdouts(log, folds))
    made: dict[tuple[str, str], Fit] = {}
    try:
        with progress("leaving out in turn", count * len(ways) * len(chosen)) as done:
            table = cross_validate(
                craft,
                log,
                chosen,
                ways,
                folds=folds,
                attitude=attitude.value,
                rate_unit=rate_unit.value,
                done=lambda *_: done(),
                keep=tables.append,
            )
        problem = prepare(craft, log, chosen)
        fit_all(problem, chosen, ways, made)
        fits = tuple(made[model.key, way.key] for way in ways for model in chosen)
        scores = [
            scores_with_restarts(problem, fit.damping, HORIZONS, attitude.value, rate_unit.value)
            if fit.status.usable
            else None
            for fit in counted(fits, "replaying from many places", len(fits))
        ]
    except KeyboardInterrupt:
        _show_part(tables, count, json)
    found = criteria(WeakEquations().rows(problem), fits)
    if json:
        emit(validation_document(table, fits, scores, found))
    else:
        show(results(), fold_grid(table), horizon_grid(fits, scores, found))
    if all(row.rms_of_finished is None for row in table.rows):
        fail("no model has an error on any fold: give a longer log or smaller models.", WORK_FAILED)


def _show_part(tables: Sequence[CrossValidation], count: int, json: bool) -> NoReturn:
    """Show the folds that were finished before Ctrl-C; end with status 130."""
    from hydrodamp.report.comparison_tables import fold_grid, validation_document
    from hydrodamp.report.grid import show
    from hydrodamp.validation.criteria import Criteria

    if not tables:
        note("interrupted before any fold was finished.")
        raise typer.Exit(INTERRUPTED)
    table = tables[-1]
    words = f"{len(table.held_out)} of {count} folds: interrupted"
    if json:
        emit({"unfinished": words, **validation_document(table, (), (), Criteria((), 0, {}))})
    else:
        grid = fold_grid(table)
        show(results(), replace(grid, notes=(f"Unfinished, {words}.", *grid.notes)))
    note(f"interrupted: {len(table.held_out)} of {count} folds, and no errors by horizon.")
    raise typer.Exit(INTERRUPTED)
