"""``hydrodamp compare``: every model by every method, on data they have not seen."""

from __future__ import annotations

from pathlib import Path

from hydrodamp.cli import options
from hydrodamp.errors import ProblemError


def compare(
    vehicle: options.VehicleName,
    logs: options.Logs = None,
    train: options.Train = None,
    test: options.Test = None,
    models: options.Models = None,
    methods: options.Methods = options.DEFAULT_METHOD,
    mapping: options.MappingFile = None,
    attitude: options.Attitude = options.AttitudeSource.measured,
    rate_unit: options.Rates = options.RateUnit.deg,
    out: options.OutFolder = None,
    resume: options.Resume = False,
    json: options.Json = False,
) -> None:
    """Identify models on one part of the data, replay them on another, rank them."""
    from hydrodamp.cli.choose import (
        choose_methods,
        choose_models,
        file_of,
        names,
        selects,
        with_sparse,
    )
    from hydrodamp.cli.parts import train_and_test
    from hydrodamp.cli.targets import check_out_folder, record
    from hydrodamp.cli.work import Task, carry_out, check_attitude, check_log, check_training
    from hydrodamp.vehicle.fleet import find_vehicle

    if resume and out is None:
        raise ProblemError(options.RESUME_NEEDS_OUT)
    inputs = (
        *(logs or ()),
        *(train or ()),
        *(test or ()),
        *map(file_of, names(models or "")),
        vehicle,
        mapping,
    )
    if out is not None:
        check_out_folder(out, inputs)
    craft, chosen, ways = find_vehicle(vehicle), choose_models(models), choose_methods(methods)
    said = record(inputs)
    learn, held_out, shared = train_and_test(logs or (), train or (), test or (), mapping)
    if shared:
        said = {"overlap": shared, **said}
    if selects(models):
        chosen = with_sparse(craft, learn, chosen)
    check_training(craft, learn, chosen)
    check_log(craft, held_out, chosen)
    check_attitude(attitude.value, held_out)
    home = None if out is None else Path(out)
    task = Task(craft, learn, held_out, chosen, ways, home, attitude.value, rate_unit.value)
    carry_out(task, said, resume, json)
