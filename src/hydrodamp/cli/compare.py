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
    from hydrodamp.cli.comparison_run import Task, check_log, check_training, run_comparison
    from hydrodamp.cli.provenance import check_out_folder, run_provenance

    data_names = (*(logs or ()), *(train or ()), *(test or ()))
    inputs = (
        *data_names,
        *map(resolve.model_file, resolve.split_names(models or "")),
        vehicle,
        mapping,
    )
    check_out_folder(out, inputs, resume, force)
    vehicle_model, chosen = resolve.find_vehicle(vehicle), resolve.list_models(models)
    method_list, provenance = resolve.list_methods(methods), run_provenance(inputs)
    learn, held_out, shared = train_and_test(logs or (), train or (), test or (), mapping)
    ends = (
        (held_out.time[segment.start], held_out.time[segment.stop - 1])
        for segment in held_out.segments
    )
    longest = max(stop - start for start, stop in ends)
    if horizon is not None and not 0.0 < horizon <= longest:
        raise ProblemError(
            "`--horizon` must be more than 0 s and no more than the longest run of the test data, "
            f"{longest:.4g} s; got {horizon:g}."
        )
    check_training(
        vehicle_model, learn, resolve.with_selectable_terms(models, vehicle_model, learn, chosen)
    )
    check_log(
        vehicle_model,
        held_out,
        resolve.with_selectable_terms(models, vehicle_model, held_out, chosen),
        learn,
    )
    chosen = resolve.complete_models(models, vehicle_model, learn, chosen, free_gains)
    task = Task(
        vehicle_model, learn, held_out, chosen, method_list, out, attitude, rate_unit, horizon
    )
    run_comparison(task, shared | provenance, resume, json)
