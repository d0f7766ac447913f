"""Pictures of what models are estimated from: figures 2 and 3 of the paper."""

from __future__ import annotations

from collections.abc import Iterator

from hydrodamp.data.log import Log
from hydrodamp.report.figures.recorded import commands_figure, velocities_figure
from hydrodamp.report.figures.traces import MOST_NAMED
from hydrodamp.report.gallery.picture import Drawn, Sketch
from hydrodamp.report.gallery.words import listed, segments_of
from hydrodamp.simulation.score import RateUnit


def sketches_of_data(log: Log, rate_unit: RateUnit) -> Iterator[Sketch]:
    """Return the pictures of a log."""
    yield Sketch(
        "estimation-velocities", "Estimation data: velocities", lambda: _velocities(log, rate_unit)
    )
    yield Sketch("estimation-actuation", "Estimation data: actuation", lambda: _actuation(log))


def _velocities(log: Log, rate_unit: RateUnit) -> Drawn:
    names = listed(log.velocity_names)
    return Drawn(
        velocities_figure(log, rate_unit),
        f"What the models were estimated from: {segments_of(log)}.{_joins(log)} A velocity that "
        "hardly moves teaches nothing of its damping.",
        f"Lines of the recorded velocities {names} over time, a panel each: {segments_of(log)}.",
    )


def _actuation(log: Log) -> Drawn:
    figure = commands_figure(log)
    return Drawn(
        figure,
        "What drove the vehicle over the same time, and how it lay.",
        f"Lines over time in {len(figure.axes)} panels: {_recorded(log)} as recorded.",
    )


def _recorded(log: Log) -> str:
    parts = [
        f"the commands {listed(log.command_names)}" if log.command_names else "",
        "the propulsion ratio" if log.propulsion_ratio is not None else "",
        "the wrench" if log.wrench is not None else "",
        "the attitude" if log.attitude is not None else "",
        "the depth" if log.position is not None else "",
    ]
    return listed([part for part in parts if part])


def _joins(log: Log) -> str:
    if len(log.segments) < 2:
        return ""
    named = ", segments named above" if len(log.segments) <= MOST_NAMED else ""
    return f" Dotted lines are joins{named}."
