"""``hydrodamp simulate``: replay one log with one damping file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.guard import WORK_FAILED
from hydrodamp.cli.output import emit, fail, note, results

if TYPE_CHECKING:
    from hydrodamp.simulation.score import Score


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
    from hydrodamp.cli.experiment import check_attitude
    from hydrodamp.cli.progress import followed, progress
    from hydrodamp.cli.select import read
    from hydrodamp.cli.targets import check_out_file
    from hydrodamp.cli.trajectory import write_trajectory
    from hydrodamp.models.damping_file import read_damping
    from hydrodamp.report.document import score_document
    from hydrodamp.simulation.replay import simulate as replay
    from hydrodamp.simulation.score import score
    from hydrodamp.vehicle.fleet import find_vehicle

    if out is not None:
        check_out_file(out, (*logs, vehicle, damping, mapping))
    craft, numbers = find_vehicle(vehicle), read_damping(damping)
    log = read(logs, mapping)
    check_attitude(attitude.value, log)
    with progress("replaying"):
        trajectory = replay(craft, numbers, log, attitude=attitude.value)
    scored = score(trajectory, craft.axes, rate_unit.value)
    if out is not None:
        with followed("writing", log.n):
            written = write_trajectory(trajectory, craft, out)
        if written:
            note(f"written to {out}")
    if json:
        emit({"model": numbers.model.key, **score_document(scored, trajectory.attitude)})
    else:
        _print_score(f"{numbers.model.title} on {log.source}", scored)
    _fail_if_diverged(scored)


def _fail_if_diverged(scored: Score) -> None:
    if scored.diverged:
        places = ", ".join(f"{name} after {time:.1f} s" for name, time in scored.diverged)
        fail(f"the replay diverged in {places}; there is no RMS error.", WORK_FAILED)


def _print_score(title: str, scored: Score) -> None:
    from hydrodamp.report.score_grid import score_grid
    from hydrodamp.report.screen import show

    show(results(), score_grid(title, scored))
