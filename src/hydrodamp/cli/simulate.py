"""``hydrodamp simulate``: replay one log with one damping file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import WORK_FAILED, emit, fail, note, results

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.simulation.replay import Trajectory
    from hydrodamp.vehicle.vehicle import Vehicle


def simulate(
    logs: options.SomeLogs,
    vehicle: options.VehicleName,
    damping: Annotated[
        str, typer.Option("--damping", metavar="JSON", help="A damping file, as identify writes.")
    ],
    mapping: options.MappingFile = None,
    attitude: options.Attitude = options.AttitudeSource.measured,
    rate_unit: options.Rates = options.RateUnit.deg,
    out: Annotated[
        str | None,
        typer.Option("--out", metavar="CSV", help="Write the simulated log in canonical form."),
    ] = None,
    json: options.Json = False,
) -> None:
    """Replay a log open loop with identified damping and score it."""
    from hydrodamp.cli.parts import read
    from hydrodamp.cli.targets import check_out_file
    from hydrodamp.cli.work import check_attitude
    from hydrodamp.data.canonical import check_log_file, write_log
    from hydrodamp.models.files import read_damping
    from hydrodamp.progress import progress
    from hydrodamp.report.comparison_tables import replay_grid
    from hydrodamp.report.documents import score_document
    from hydrodamp.report.grid import show
    from hydrodamp.simulation.replay import simulate as replay
    from hydrodamp.simulation.score import score
    from hydrodamp.vehicle.fleet import find_vehicle

    if out is not None:
        check_out_file(out, (*logs, vehicle, damping, mapping))
        check_log_file(out)
    craft, numbers = find_vehicle(vehicle), read_damping(damping)
    log = read(logs, mapping)
    check_attitude(attitude.value, log)
    with progress("replaying"):
        trajectory = replay(craft, numbers, log, attitude=attitude.value)
    scored = score(trajectory, craft.axes, rate_unit.value)
    if out is not None and (simulated := simulated_log(trajectory, craft)) is not None:
        write_log(simulated, out)
        note(f"written to {out}")
    if json:
        emit({"model": numbers.model.key, **score_document(scored, trajectory.attitude)})
    else:
        show(results(), replay_grid(f"{numbers.model.title} on {log.source}", scored))
    if scored.diverged:
        places = ", ".join(f"{name} after {time:.1f} s" for name, time in scored.diverged)
        fail(f"the replay diverged in {places}; there is no RMS error.", WORK_FAILED)


def simulated_log(trajectory: Trajectory, vehicle: Vehicle) -> Log | None:
    """Return the log with simulated velocities; None where the replay diverged at once."""
    import numpy as np

    from hydrodamp.basis.atoms import VELOCITIES, VELOCITY_OF
    from hydrodamp.data.log import Log

    log = trajectory.log
    keep = np.asarray(np.isfinite(trajectory.velocity).all(axis=1))
    if not any(keep[part.start : part.stop].sum() > 1 for part in log.segments):
        return None
    free = [VELOCITY_OF[axis] for axis in vehicle.axes]
    attitude = log.attitude if trajectory.attitude == "measured" else None
    names = np.repeat([part.name for part in log.segments], [len(part) for part in log.segments])
    return Log.from_arrays(
        log.time[keep],
        {name: trajectory.velocity[keep, VELOCITIES.index(name)] for name in free},
        attitude=None if attitude is None else attitude[keep],
        commands={name: log.command(name)[keep] for name in log.command_names},
        wrench=None if log.wrench is None else log.wrench[keep],
        propulsion_ratio=None if log.propulsion_ratio is None else log.propulsion_ratio[keep],
        segment=names[keep].tolist(),
        source=f"replay of {log.source or 'log'}",
    )
