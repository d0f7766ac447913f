"""``hydrodamp simulate``: replay a log with a damping file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import hydrodamp as hd
from hydrodamp.cli.inputs import read_logs, warn_quality_issues
from hydrodamp.cli.output import check_out_log, fail, note, print_output
from hydrodamp.errors import ModelError
from hydrodamp.progress import progress


def simulate(
    logs: list[str],
    damping: str,
    vehicle: str = "",
    mapping: str | None = None,
    attitude: Literal["measured", "simulated"] = "measured",
    rate_unit: Literal["deg", "rad"] = "deg",
    out: Path | None = None,
    force: bool = False,
    json: bool = False,
) -> None:
    """Replay a log open loop with an identified model and report the RMS error."""
    from hydrodamp.identification import operating_range
    from hydrodamp.models.damping import foreign_to
    from hydrodamp.report.comparison_tables import replay_table
    from hydrodamp.report.documents import read_training_range, score_document
    from hydrodamp.simulation.checks import estimate_length
    from hydrodamp.simulation.problem import vehicle_stamp

    check_out_log(out, (*logs, vehicle, damping, mapping), force)
    craft, numbers = hd.find_vehicle(vehicle), hd.read_damping(damping)
    if message := foreign_to(numbers, vehicle_stamp(craft)):
        raise ModelError(message)
    log = read_logs(logs, mapping)
    warn_quality_issues(log, estimate_length(craft))
    with progress("replaying"):
        trajectory = hd.simulate(craft, numbers, log, attitude=attitude)
    scored = hd.score(trajectory, rate_unit=rate_unit)
    if out is not None and not scored.diverged:
        hd.write_log(simulated_log(trajectory), out)
        note(f"written to {out}")
    title = f"{numbers.model.title} on {log.source}, attitude {trajectory.attitude}"
    document = {"model": numbers.model.key, **score_document(scored, trajectory.attitude)}
    print_output(json, document, replay_table(title, scored))
    trained = read_training_range(Path(damping))
    driven = operating_range.velocity_ranges(log.velocity, craft.axes)
    ranges = operating_range.join_ranges(trained, driven)
    for sentence in (
        *operating_range.range_exceedance_warnings(trained, driven),
        *operating_range.energy_injection_warnings(numbers, ranges),
    ):
        note(sentence)
    if scored.diverged:
        fail(
            f"the replay diverged in {scored.divergence_text}: there is no RMS error, and no file "
            "is written."
        )


def simulated_log(trajectory: hd.Trajectory) -> hd.Log:
    """Return the log with simulated instead of measured velocities."""
    from hydrodamp.basis.atoms import VELOCITY_OF

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
