"""``hydrodamp control``: autopilots scheduled over speeds, with margins over draws of a fit."""

from __future__ import annotations

from pathlib import Path

from hydrodamp.cli.inputs import read_damping_and_vehicle
from hydrodamp.cli.output import fail, note, print_output
from hydrodamp.results import check_results


def control(
    damping: str,
    speed: list[float],
    out: Path,
    vehicle: str = "",
    envelope: str | None = None,
    draws: int = 100,
    force: bool = False,
    json: bool = False,
) -> None:
    """Design autopilots at speeds, with stability margins over draws of the coefficients."""
    from hydrodamp.control.design import design_control
    from hydrodamp.experiment_design.envelope import read_envelope
    from hydrodamp.report.control_report import (
        RESULTS,
        control_document,
        margins_table,
        write_control,
    )

    check_results(out, RESULTS, force)
    numbers, fit, craft = read_damping_and_vehicle(damping, vehicle)
    limits = None if envelope is None else read_envelope(envelope)
    design = design_control(craft, numbers, speed, envelope=limits, fit=fit, draws=draws)
    missing = write_control(design, out, None if fit is None else fit.noise)
    print_output(json, control_document(design), f"Verdict: {design}", margins_table(design))
    for message in (*(each.warning for each in design.speeds if each.warning), *missing):
        note(f"warning: {message}")
    if draws and not design.n_draws:
        note("warning: the damping has no covariance: margins are those of the estimate alone")
    note(f"written to {out}")
    if failed := [f"{each.speed:g} m/s" for each in design.speeds if not each.outcome.usable]:
        fail(f"no autopilot holds {', '.join(failed)}: see the outcome in the table.")
