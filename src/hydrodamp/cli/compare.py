"""``hydrodamp compare``: identify models by several methods and rank them on test data."""

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
    estimate_gains: options.EstimateGains = False,
    attitude: options.Attitude = "measured",
    rate_unit: options.Rates = "deg",
    horizon: options.Horizon = None,
    out: options.OutFolder = None,
    resume: options.Resume = False,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Identify models on training data, replay them on test data and rank them by RMS error."""
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
    vehicle_model, listed = resolve.find_vehicle(vehicle), resolve.list_models(models)
    method_list, provenance = resolve.list_methods(methods), run_provenance(inputs)
    train_log, test_log, overlap = train_and_test(logs or (), train or (), test or (), mapping)
    time, segments = test_log.time, test_log.segments
    longest = max(time[segment.stop - 1] - time[segment.start] for segment in segments)
    if horizon is not None and not 0.0 < horizon <= longest:
        raise ProblemError(
            f"`--horizon` must be positive and at most {longest:.4g} s, the longest segment of "
            f"the test data; got {horizon:g}."
        )
    check_training(vehicle_model, train_log, listed.candidates(vehicle_model, train_log))
    check_log(vehicle_model, test_log, listed.candidates(vehicle_model, test_log), train_log)
    fitted_models = listed.complete(vehicle_model, train_log, estimate_gains)
    task = Task(
        vehicle_model,
        train_log,
        test_log,
        fitted_models,
        method_list,
        out,
        attitude,
        rate_unit,
        horizon,
    )
    run_comparison(task, overlap | provenance, resume, json)
