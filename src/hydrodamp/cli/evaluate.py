"""``hydrodamp simulate``: replay a log with an identified model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import hydrodamp as hd
from hydrodamp.cli import inputs
from hydrodamp.cli.output import check_out_log, fail, note, print_output, warn_quality_issues
from hydrodamp.errors import ModelError
from hydrodamp.progress import progress

if TYPE_CHECKING:
    from hydrodamp.identification.predicted_error import PredictionBand


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
    from hydrodamp.basis.term import VELOCITY_OF
    from hydrodamp.identification import dissipativity
    from hydrodamp.models.damping import foreign_to
    from hydrodamp.report.comparison_tables import replay_table
    from hydrodamp.report.documents import axes_document, score_document
    from hydrodamp.report.table import Table
    from hydrodamp.simulation.block_errors import block_errors
    from hydrodamp.simulation.checks import estimate_length
    from hydrodamp.simulation.problem import vehicle_stamp
    from hydrodamp.validation.excitation import (
        compare_excitation,
        describe_overlap,
        find_shared_segments,
        find_untested,
    )
    from hydrodamp.validation.verdict import describe_fits, judge_axes

    check_out_log(out, force)
    numbers, fit, craft = inputs.read_damping_and_vehicle(damping, vehicle)
    if message := foreign_to(numbers, vehicle_stamp(craft)):
        raise ModelError(message)
    log = inputs.read_logs_as_fitted(logs, mapping, fit)
    warn_quality_issues(log, estimate_length(craft))
    with progress("replaying"):
        trajectory = hd.simulate(craft, numbers, log, attitude=attitude)
    scored = hd.score(trajectory, rate_unit=rate_unit)
    band, predicted, extrapolated = None, dict[str, float | None](), tuple[str, ...]()
    if fit is not None and fit.damping.covariance is not None:
        band = hd.predict_error(craft, fit, log)
        predicted, extrapolated = band.rms_by_axis(craft.axes, rate_unit), band.extrapolated
    if out is not None and not scored.diverged:
        hd.write_log(simulated_log(trajectory, band), out)
        note(f"written to {out}")
    title = f"{numbers.model.title} on {log.source}, attitude {trajectory.attitude}"
    trained = {} if fit is None else fit.training_range
    driven = dissipativity.velocity_ranges(trajectory.log.velocity, craft.axes)
    grades, overlap = {}, ""
    untested = find_untested([compare_excitation(trained, driven)])
    if fit is not None:
        grades, overlap = fit.grades, find_shared_segments((fit,), trajectory.log)
    if overlap:
        untested = dict.fromkeys(map(VELOCITY_OF.__getitem__, craft.axes), "training data")
    errors = block_errors(trajectory, rate_unit)
    axes = tuple(judge_axes(errors, grades, {}, untested))
    document = {
        "model": numbers.model.key,
        "axes": axes_document(axes),
        **score_document(scored, trajectory.attitude),
        "predicted_error_by_axis": predicted or None,
        "extrapolated": extrapolated,
    }
    notes = [describe_overlap(overlap)] if overlap else []
    lights = Table("", (), (), (describe_fits(axes), *notes))
    print_output(json, document, lights, replay_table(title, scored, predicted, extrapolated))
    ranges = dissipativity.join_ranges(trained, driven)
    for sentence in (
        *dissipativity.range_exceedance_warnings(trained, driven),
        *dissipativity.energy_injection_warnings(numbers, ranges),
    ):
        note(sentence)
    if scored.diverged:
        fail(
            f"the replay diverged in {scored.divergence_text}: there is no RMS error, and no file "
            "is written."
        )


def simulated_log(trajectory: hd.Trajectory, band: PredictionBand | None) -> hd.Log:
    """Return the log with simulated instead of measured velocities and, if known, their band."""
    import numpy as np

    from hydrodamp.basis.term import VELOCITIES, VELOCITY_OF

    log = trajectory.log
    names = tuple(VELOCITY_OF[axis] for axis in trajectory.axes)
    if band is not None:
        width = band.half_width[:, [VELOCITIES.index(name) for name in names]]
        widths = tuple(f"{name}_half_width" for name in names)
        columns = [k for k, name in enumerate(log.command_names) if name not in widths]
        commands = np.hstack([log.commands[:, columns], width])
        names_kept = (log.command_names[k] for k in columns)
        log = replace(log, commands=commands, command_names=(*names_kept, *widths))
    return replace(
        log,
        velocity=trajectory.velocity,
        velocity_names=names,
        attitude=log.attitude if trajectory.attitude == "measured" else None,
        acceleration=None,
        position=None,
        specific_force=None,
        source=f"replay of {log.source or 'log'}",
    )
