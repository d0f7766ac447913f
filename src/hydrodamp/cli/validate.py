"""``hydrodamp validate``: which model, by leaving out each segment in turn."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from hydrodamp.cli import options
from hydrodamp.cli.guard import INTERRUPTED, WORK_FAILED
from hydrodamp.cli.output import emit, fail, note, results

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Fit, Method
    from hydrodamp.models.model import DampingModel
    from hydrodamp.simulation.horizons import HorizonScores
    from hydrodamp.validation.criteria import Criteria
    from hydrodamp.validation.crossvalidation import CrossValidation
    from hydrodamp.vehicle.vehicle import Vehicle

    Whole = tuple[tuple[Fit, ...], list[HorizonScores | None], Criteria]


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
    from hydrodamp.cli.experiment import check_attitude, check_before, check_samples
    from hydrodamp.cli.progress import progress
    from hydrodamp.cli.select import read
    from hydrodamp.errors import ModelError
    from hydrodamp.report.screen import show
    from hydrodamp.report.validation_grids import fold_grid, horizon_grid, validation_document
    from hydrodamp.validation.crossvalidation import cross_validate
    from hydrodamp.validation.holdouts import holdouts
    from hydrodamp.vehicle.fleet import find_vehicle

    if selects(models):
        raise ModelError(
            "`sparse` is selected by leaving data out itself: compare it on data of its own, "
            "with `hydrodamp compare --models sparse`."
        )
    craft, chosen, ways = find_vehicle(vehicle), choose_models(models), choose_methods(methods)
    log = read(logs, mapping)
    check_before(craft, log, chosen)
    check_attitude(attitude.value, log)
    check_samples(craft, log, chosen)
    tables: list[CrossValidation] = []
    count = len(holdouts(log, folds))
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
                done=done,
                keep=tables.append,
            )
        fits, scores, found = _on_the_whole(craft, log, chosen, ways, attitude, rate_unit)
    except KeyboardInterrupt:
        _show_part(tables, count, json)
    if json:
        emit(validation_document(table, fits, scores, found))
    else:
        show(results(), fold_grid(table), horizon_grid(fits, scores, found))
    if all(row.rms_of_finished is None for row in table.rows):
        fail("no model has an error on any fold: give a longer log or smaller models.", WORK_FAILED)


def _on_the_whole(
    vehicle: Vehicle,
    log: Log,
    models: Sequence[DampingModel],
    methods: Sequence[Method],
    attitude: options.AttitudeSource,
    rate_unit: options.RateUnit,
) -> Whole:
    """Fit the whole log; return fits, their errors by horizon and their criteria."""
    from hydrodamp.cli.experiment import fit_all
    from hydrodamp.cli.progress import progress
    from hydrodamp.identification.rows.weak_equations import WeakEquations
    from hydrodamp.simulation.horizons import HORIZONS, scores_with_restarts
    from hydrodamp.simulation.problem import prepare
    from hydrodamp.validation.criteria import criteria

    fits = fit_all(vehicle, log, models, methods)
    problem = prepare(vehicle, log, models)
    scores: list[HorizonScores | None] = []
    with progress("replaying from many places", len(fits)) as step:
        for fit in fits:
            scores.append(
                scores_with_restarts(
                    problem, fit.damping, HORIZONS, attitude.value, rate_unit.value
                )
                if fit.status.usable
                else None
            )
            step()
    return fits, scores, criteria(WeakEquations().rows(problem), fits)


def _show_part(tables: Sequence[CrossValidation], count: int, json: bool) -> NoReturn:
    """Show the folds that were finished before Ctrl-C, marked as such; end with status 130."""
    from hydrodamp.report.screen import show
    from hydrodamp.report.validation_grids import fold_grid, validation_document
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
