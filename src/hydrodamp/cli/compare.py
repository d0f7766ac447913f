"""``hydrodamp compare``: every model by every method, on data they have not seen."""

from __future__ import annotations

from hydrodamp.cli import options, resolve
from hydrodamp.cli.data_split import train_and_test
from hydrodamp.errors import ProblemError


def compare(
    vehicle: options.VehicleName = "",
    logs: options.Logs = None,
    train: options.Train = None,
    test: options.Test = None,
    models: options.Models = None,
    methods: options.Methods = options.DEFAULT_METHOD,
    mapping: options.MappingFile = None,
    free_gains: options.FreeGains = False,
    attitude: options.Attitude = "measured",
    rate_unit: options.Rates = "deg",
    horizon: options.Horizon = None,
    out: options.OutFolder = None,
    resume: options.Resume = False,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Identify models on one part of the data, replay them on another, rank them."""
    from hydrodamp.cli.comparison_run import Task, carry_out, check_log, check_training
    from hydrodamp.cli.provenance import check_out_folder, record

    parts = (*(logs or ()), *(train or ()), *(test or ()))
    inputs = (*parts, *map(resolve.file_of, resolve.names(models or "")), vehicle, mapping)
    check_out_folder(out, inputs, resume, force)
    craft, chosen = resolve.choose_vehicle(vehicle), resolve.choose_models(models)
    ways, said = resolve.choose_methods(methods), record(inputs)
    learn, held_out, shared = train_and_test(logs or (), train or (), test or (), mapping)
    ends = ((held_out.time[one.start], held_out.time[one.stop - 1]) for one in held_out.segments)
    longest = max(stop - start for start, stop in ends)
    if horizon is not None and not 0.0 < horizon <= longest:
        raise ProblemError(
            "`--horizon` must be more than 0 s and no more than the longest run of the test data, "
            f"{longest:.4g} s; got {horizon:g}."
        )
    check_training(craft, learn, resolve.asked(models, craft, learn, chosen))
    check_log(craft, held_out, resolve.asked(models, craft, held_out, chosen), learn)
    chosen = resolve.for_log(models, craft, learn, chosen, free_gains)
    task = Task(craft, learn, held_out, chosen, ways, out, attitude, rate_unit, horizon)
    carry_out(task, shared | said, resume, json)
