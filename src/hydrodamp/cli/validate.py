"""``hydrodamp validate``: which model, by leaving out each segment in turn."""

from __future__ import annotations

from typing import Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.guard import WORK_FAILED
from hydrodamp.cli.output import emit, fail, results


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
    from hydrodamp.cli.experiment import check_attitude, check_before, check_samples, fit_all
    from hydrodamp.cli.progress import progress
    from hydrodamp.cli.select import read
    from hydrodamp.errors import ModelError
    from hydrodamp.identification.rows.weak_equations import WeakEquations
    from hydrodamp.report.screen import show
    from hydrodamp.report.validation_grids import fold_grid, horizon_grid, validation_document
    from hydrodamp.simulation.horizons import HORIZONS, HorizonScores, scores_with_restarts
    from hydrodamp.simulation.problem import prepare
    from hydrodamp.validation.criteria import criteria
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
    count = len(holdouts(log, folds)) * len(ways) * len(chosen)
    with progress("leaving out in turn", count) as done:
        table = cross_validate(
            craft,
            log,
            chosen,
            ways,
            folds=folds,
            attitude=attitude.value,
            rate_unit=rate_unit.value,
            done=done,
        )
    fits = fit_all(craft, log, chosen, ways)
    problem = prepare(craft, log, chosen)
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
    found = criteria(WeakEquations().rows(problem), fits)
    if json:
        emit(validation_document(table, fits, scores, found))
    else:
        show(results(), fold_grid(table), horizon_grid(fits, scores, found))
    if all(row.rms_of_finished is None for row in table.rows):
        fail("no model has an error on any fold: give a longer log or smaller models.", WORK_FAILED)
