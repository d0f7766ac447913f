"""Report of a planned dive: tables, files, and an HTML page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from hydrodamp.data.canonical import write_log
from hydrodamp.errors import MethodError
from hydrodamp.experiment_design import result as planning
from hydrodamp.files import as_json
from hydrodamp.models.model import coefficient_unit, read_label
from hydrodamp.report.figures import style
from hydrodamp.report.figures.replays import prediction_figure
from hydrodamp.report.files import Picture
from hydrodamp.report.page import Page, installed, render_page
from hydrodamp.report.pictures import draw_pictures
from hydrodamp.report.provenance import horizontal_track, today
from hydrodamp.report.series import Panel, series_document
from hydrodamp.report.table import Column, Table, coefficient, to_csv
from hydrodamp.results import save_results


def prediction_table(plan: planning.DivePlan) -> Table:
    """Return a row for each coefficient: prior, predicted standard errors and grade."""
    numbers = ("prior", "± prior", "± this dive", "± combined", "± baseline")
    columns = (
        Column("coefficient", number=False),
        *(Column(name, form=coefficient) for name in numbers),
        Column("unit", number=False),
        Column("predicted grade", number=False),
    )
    rows = tuple(
        (
            *(item.label, item.value, item.prior_std_error, item.std_error),
            *(item.combined_std_error, item.baseline_std_error),
            coefficient_unit(*read_label(item.label)),
            f"{item.grade.word}{f' ({item.cause.word})' if item.cause else ''}",
        )
        for item in plan.predictions
    )
    return Table("Predicted estimates", columns, rows, tuple(_notes(plan)))


def _notes(plan: planning.DivePlan) -> Iterator[str]:
    yield (
        f"± are standard errors as `identify` is expected to report them from this dive in mode "
        f"{plan.mode}; the baseline is a campaign of steps of the same duration and envelope. "
        f"Prior: {plan.prior}."
    )
    shares = ", ".join(f"{name} {share:.1%}" for name, share in plan.saturation.items())
    if shares:
        yield f"Time at a limit or rate limit: {shares}."
    yield from plan.assumptions
    yield from plan.notes


def segment_table(plan: planning.DivePlan) -> Table:
    """Return a row for each segment of the dive."""

    def mean_speed(item: planning.PlanSegment) -> str:
        if "speed" not in plan.setpoints:
            return "-"
        is_inside = (plan.time >= item.start) & (plan.time < item.end)
        return f"{plan.setpoints['speed'][is_inside].mean():.2f}"

    rows = (
        (
            f"{item.start:.0f}-{item.end:.0f}",
            item.manoeuvre.shape,
            f"{np.degrees(item.course) % 360.0:.0f}",
            mean_speed(item),
        )
        for item in plan.segments
    )
    header = ("time [s]", "manoeuvre", "course [deg]", "speed [m/s]")
    return Table.of_words("Segments", header, "llrr", rows)


RESULTS = (
    *("plan.csv", "predictions.csv", "plan.json", "mission.plan", "track.csv", "plan.html"),
    "predictions.svg",
)
"""Names of all files of a plan, relative to its folder."""


# Units of the entries of an envelope.
_UNITS = {
    **dict.fromkeys(("depth", "bottom", "altitude"), " [m]"),
    **dict.fromkeys(("pitch", "roll"), " [deg]"),
    "speed": " [m/s]",
    "period": " [s]",
}


def write_plan(plan: planning.DivePlan, folder: Path) -> list[str]:
    """Write a plan into a folder; return messages on files that could not be written."""
    missing = []
    contents = {
        folder / "plan.csv": planning.commands_csv(plan).encode("utf-8"),
        folder / "predictions.csv": to_csv(prediction_table(plan)).encode("utf-8"),
        folder / "plan.json": as_json(planning.plan_document(plan)).encode("utf-8"),
    }
    try:
        contents[folder / "mission.plan"] = planning.mission_plan(plan).encode("utf-8")
    except MethodError as error:
        missing.append(f"mission.plan is not written: {error}.")
    caption = (
        "Standard errors relative to the coefficients; a coefficient left of the dashed line is "
        "determined."
    )
    pictures, _ = draw_pictures([("predictions", caption, partial(prediction_figure, plan))], {})
    contents |= {folder / f"{each.name}.svg": each.svg for each in pictures}
    with TemporaryDirectory() as name:
        temporary = Path(name)
        write_log(plan.track, temporary / "track.csv")
        contents[folder / "track.csv"] = (temporary / "track.csv").read_bytes()
    if installed():
        contents[folder / "plan.html"] = page(plan, pictures).encode("utf-8")
    else:
        missing.append('The figures and the page need: pip install "hydrodamp[report]".')
    save_results(contents, folder, RESULTS)
    return missing


def page(plan: planning.DivePlan, pictures: Sequence[Picture]) -> str:
    """Return the HTML page of a plan."""
    facts = {
        f"{key.replace('_', ' ')}{_UNITS.get(key, '')}": str(value)
        for key, value in plan.envelope.model_dump(mode="json").items()
        if value not in (None, {})
    }
    return render_page(
        Page(
            title=f"Dive plan for {plan.vehicle.name}",
            about={
                "vehicle": plan.vehicle.name,
                "log": f"none, predicted in mode {plan.mode} from {plan.prior}",
                "date": today(),
                "units": "SI, FRD and NED; angles in deg",
            },
            notes=[str(plan)],
            track=horizontal_track(plan.track),
            series=series_document(plan.track, [*_panels(plan)]),
            pictures=pictures,
            tables=[segment_table(plan), prediction_table(plan)],
            facts=facts,
        )
    )


def _panels(plan: planning.DivePlan) -> Iterator[Panel]:
    """Yield setpoints, predicted depth with its band, and predicted velocities."""
    units = {"speed": "m/s", "heading": "deg", "depth": "m"}
    track = plan.track
    for name, values in plan.setpoints.items():
        label = f"{name.replace('_', ' ')} [{units.get(name, 'as in the vehicle file')}]"
        if name == "depth" and track.position is not None:
            label += ", band: 90 % of the ensemble"
            channels = {"predicted": track.position[:, 2], "setpoint": values}
            yield Panel(label, channels, tuple(plan.depth_band.T), is_downward=True)
        else:
            converted = np.degrees(np.unwrap(values)) if name == "heading" else values
            yield Panel(label, {name: converted})
    for name in track.velocity_names:
        velocity = style.shown_velocities(track.velocity, name)
        yield Panel(f"{name} [{style.velocity_unit(name)}]", {name: velocity})
