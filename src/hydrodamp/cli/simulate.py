"""``hydrodamp simulate``: replay a log with a damping file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import hydrodamp as hd
from hydrodamp.cli import options
from hydrodamp.cli.data_split import read_logs, warn_quality_issues
from hydrodamp.cli.output import emit, fail, note, print_results
from hydrodamp.cli.resolve import find_vehicle
from hydrodamp.progress import progress


def simulate(
    logs: options.SomeLogs,
    damping: Annotated[str, options.option("simulate-damping")],
    vehicle: options.VehicleName = "",
    mapping: options.MappingFile = None,
    attitude: options.Attitude = "measured",
    rate_unit: options.Rates = "deg",
    out: Annotated[Path | None, options.option("simulate-out")] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Replay a log open loop with an identified model and report the RMS error."""
    from hydrodamp.cli.provenance import check_out_log
    from hydrodamp.errors import ModelError
    from hydrodamp.identification.operating_range import (
        energy_injection_warnings,
        join_ranges,
        range_exceedance_warnings,
        velocity_ranges,
    )
    from hydrodamp.models.damping import foreign_to
    from hydrodamp.report.comparison_tables import replay_table
    from hydrodamp.report.documents import read_training_range, score_document
    from hydrodamp.simulation.checks import estimate_length
    from hydrodamp.simulation.problem import vehicle_stamp

    check_out_log(out, (*logs, vehicle, damping, mapping), force)
    vehicle_model, numbers = find_vehicle(vehicle), hd.read_damping(damping)
    if message := foreign_to(numbers, vehicle_stamp(vehicle_model)):
        raise ModelError(message)
    log = read_logs(logs, mapping)
    warn_quality_issues(log, estimate_length(vehicle_model))
    with progress("replaying"):
        trajectory = hd.simulate(vehicle_model, numbers, log, attitude=attitude)
    scored = hd.score(trajectory, rate_unit=rate_unit)
    if out is not None and not scored.diverged:
        hd.write_log(simulated_log(trajectory), out)
        note(f"written to {out}")
    if json:
        emit({"model": numbers.model.key, **score_document(scored, trajectory.attitude)})
    else:
        title = f"{numbers.model.title} on {log.source}, attitude {trajectory.attitude}"
        print_results(replay_table(title, scored))
    trained, driven = (
        read_training_range(Path(damping)),
        velocity_ranges(log.velocity, vehicle_model.axes),
    )
    for sentence in (
        *range_exceedance_warnings(trained, driven),
        *energy_injection_warnings(numbers, join_ranges(trained, driven)),
    ):
        note(sentence)
    if scored.diverged:
        fail(
            f"the replay diverged in {scored.divergence_text}: there is no RMS error, and no file "
            "is written."
        )


def simulated_log(trajectory: hd.Trajectory) -> hd.Log:
    """Return the log with simulated instead of measured velocities."""
    from hydrodamp.basis.term import VELOCITY_OF

    log = trajectory.log
    return replace(
        log,
        velocity=trajectory.velocity,
        velocity_names=tuple(VELOCITY_OF[axis] for axis in trajectory.axes),
        attitude=log.attitude if trajectory.attitude == "measured" else None,
        acceleration=None,
        position=None,
        specific_force=None,
        source=f"replay of {log.source or 'log'}",
    )
