"""What is told of a planned dive: its tables, its files, and one page."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np

from hydrodamp.data.canonical import write_log
from hydrodamp.errors import MethodError
from hydrodamp.experiment_design.files import (
    can_write_bags,
    commands_csv,
    mission_plan,
    plan_document,
    write_bag,
)
from hydrodamp.experiment_design.result import DivePlan
from hydrodamp.files import as_json
from hydrodamp.models.model import coefficient_unit, read_label
from hydrodamp.report.figures.plan import orders_figure, prediction_figure, track_figure
from hydrodamp.report.figures.style import figure_bytes
from hydrodamp.report.page import installed, render_page
from hydrodamp.report.table import Column, Table, coefficient, to_csv
from hydrodamp.results import register_results, remove_results, save_result, save_results

#: The bag in the folder of a plan.
_BAG = "bag"

_FIGURES = {
    "orders": (
        orders_figure,
        "What is commanded; thin lines between stretches.",
    ),
    "track": (track_figure, "Predicted track, of the nominal damping."),
    "predictions": (
        prediction_figure,
        "Standard errors as shares of the coefficients; left of the dashed line a coefficient is "
        "determined.",
    ),
}


def prediction_table(plan: DivePlan) -> Table:
    """Return a row for each coefficient: what is known of it, and what will be."""
    columns = (
        Column("coefficient", number=False),
        Column("known as", form=coefficient),
        Column("+- before", form=coefficient),
        Column("+- this dive", form=coefficient),
        Column("+- with what is known", form=coefficient),
        Column("+- steps", form=coefficient),
        Column("unit", number=False),
        Column("will be", number=False),
    )
    rows = tuple(
        (
            *(
                one.label,
                one.value,
                one.prior_std_error,
                one.std_error,
                one.combined_std_error,
                one.baseline_std_error,
            ),
            coefficient_unit(*read_label(one.label)),
            f"{one.grade.word}{f' ({one.cause.word})' if one.cause else ''}",
        )
        for one in plan.predictions
    )
    return Table("What the dive will determine", columns, rows, tuple(_notes(plan)))


def _notes(plan: DivePlan) -> Iterator[str]:
    yield (
        f"+- are standard errors as `identify` will report them from this dive, executed by "
        f"{plan.mode}; 'steps' is a campaign of steps of the same length in the same envelope. "
        f"Planned with {plan.prior}."
    )
    shares = ", ".join(f"{name} {share:.1%}" for name, share in plan.saturation.items())
    if shares:
        yield f"Time at a limit or rate limit: {shares}."
    yield from plan.assumptions
    if plan.goal_duration is not None:
        goal, by_axis = plan.goal_duration.goal.word, plan.goal_duration.duration_by_axis
        took = ", ".join(f"{axis} {_long(time)}" for axis, time in by_axis.items())
        yield f"Shortest dive to '{goal}', for what can be so at all: {took}."
        for label, why in plan.goal_duration.unreached.items():
            yield f"{label} cannot be {goal}: {why}"
    yield from plan.notes


def _long(time: float | None) -> str:
    return "none" if time is None else f"{time:.0f} s"


def segment_table(plan: DivePlan) -> Table:
    """Return a row for each stretch of the dive."""
    rows = (
        (
            f"{one.start:.0f}-{one.end:.0f}",
            one.manoeuvre.shape,
            f"{np.degrees(one.course) % 360.0:.0f}",
            f"{_mean(plan, 'speed', one.start, one.end)}",
        )
        for one in plan.segments
    )
    header = ("seconds", "manoeuvre", "course [deg]", "speed [m/s]")
    return Table.of_words("Stretches", header, "llrr", rows)


def _mean(plan: DivePlan, name: str, start: float, end: float) -> str:
    if name not in plan.setpoints:
        return "-"
    part = (plan.time >= start) & (plan.time < end)
    return f"{plan.setpoints[name][part].mean():.2f}"


#: Names of all files that a plan may write, from its folder.
RESULTS = (
    *("plan.csv", "predictions.csv", "plan.json", "mission.plan", "track.csv", "plan.html"),
    *(f"{name}.svg" for name in _FIGURES),
    f"{_BAG}/*",
)


def write_plan(plan: DivePlan, folder: Path) -> list[str]:
    """Write a plan into a folder; return what could not be written, in sentences."""
    missing = []
    contents = {
        folder / "plan.csv": commands_csv(plan).encode("utf-8"),
        folder / "predictions.csv": to_csv(prediction_table(plan)).encode("utf-8"),
        folder / "plan.json": as_json(plan_document(plan)).encode("utf-8"),
    }
    try:
        contents[folder / "mission.plan"] = mission_plan(plan).encode("utf-8")
    except MethodError as error:
        missing.append(f"mission.plan is not written: {error}.")
    pictures = {}
    with suppress(MethodError):
        pictures = {name: figure_bytes(draw(plan), "svg") for name, (draw, _) in _FIGURES.items()}
        contents |= {folder / f"{name}.svg": one for name, one in pictures.items()}
    save_results(contents, folder)
    write_log(plan.track, folder / "track.csv")
    if can_write_bags():
        remove_results(folder, (f"{_BAG}/*",))
        write_bag(plan, folder / _BAG)
    else:
        missing.append('The ROS 2 bag needs the package rosbags: pip install "hydrodamp[logs]".')
    if installed():
        save_result(page(plan, pictures), folder / "plan.html")
    else:
        missing.append('Pictures and the page need: pip install "hydrodamp[report]".')
    register_results((folder / "track.csv", *(folder / _BAG).glob("*")), folder)
    return missing


def page(plan: DivePlan, pictures: dict[str, bytes]) -> str:
    """Return the page of a plan."""
    facts = {
        key.replace("_", " "): str(value)
        for key, value in plan.envelope.model_dump(mode="json").items()
        if value not in (None, {})
    }
    return render_page(
        f"The next dive of {plan.vehicle.name}",
        f"Executed by {plan.mode}",
        [str(plan)],
        [prediction_table(plan), segment_table(plan)],
        [(_FIGURES[name][1], picture) for name, picture in pictures.items()],
        facts,
        "Envelope",
    )
