"""Figures 2 and 3 of the paper: the data that coefficients are estimated from."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import cycle
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.report.figures.axes import shown, velocity_label
from hydrodamp.report.figures.look import MEASURED, SERIES, in_our_look, plain, stacked
from hydrodamp.report.figures.traces import mark_segments, trace
from hydrodamp.simulation.score import RateUnit

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class _Panel(NamedTuple):
    """What one panel shows."""

    label: str
    channels: dict[str, FloatArray]
    drawstyle: str = "default"
    downward: bool = False


@in_our_look
def velocities_figure(log: Log, rate_unit: RateUnit = "deg") -> Figure:
    """Draw the recorded velocities, a panel each: figure 2 of the paper.

    Parameters
    ----------
    log : Log
        What models are estimated from; any log will do.
    rate_unit : {"deg", "rad"}
        Unit of angular rates.

    Returns
    -------
    figure : Figure
        One column wide; joins dotted, segments named.

    Raises
    ------
    MethodError
        If the log has no velocity, or matplotlib is not installed.
    """
    names = log.velocity_names
    if not names:
        raise MethodError(f"{log.source or 'log'}: no velocity was recorded, so none is drawn")
    panels = [
        _Panel(velocity_label(name, rate_unit), {name: shown(log.velocity, name, rate_unit)})
        for name in names
    ]
    return _drawn(log, panels, 0.72)


@in_our_look
def commands_figure(log: Log) -> Figure:
    """Draw what drove the vehicle and how it lay: figure 3 of the paper.

    Parameters
    ----------
    log : Log
        Commands or wrench, propulsion ratio, attitude and depth are drawn where they
        are recorded. Angles run on where they wrap; depth grows downward. Commands of
        one order of magnitude share a panel.

    Returns
    -------
    figure : Figure
        One column wide; joins dotted, segments named.

    Raises
    ------
    MethodError
        If none of them is recorded, or matplotlib is not installed.
    """
    panels = [*_actuation(log), *_pose(log)]
    if not panels:
        raise MethodError(
            f"{log.source or 'log'}: neither commands, a wrench, attitude nor position is "
            "recorded, so there is nothing to draw"
        )
    return _drawn(log, panels, 0.85)


def _actuation(log: Log) -> Iterator[_Panel]:
    groups: dict[tuple[int, int], dict[str, FloatArray]] = {}
    for name in log.command_names:
        values = log.command(name)
        size = int(np.floor(np.log10(np.abs(values).max(initial=0.0) or 1.0)))
        full = sum(len(group) for (other, _), group in groups.items() if other == size)
        groups.setdefault((size, full // len(SERIES)), {})[name] = values
    for group in groups.values():
        label = plain(next(iter(group)), 16) if len(group) == 1 else "commands"
        yield _Panel(f"{label}\n[as recorded]", group, "steps-post")
    if log.propulsion_ratio is not None:
        yield _Panel(r"$\bar\eta$ [1]", {"eta": log.propulsion_ratio})
    if log.wrench is not None:
        for letters, label in (("XYZ", "force [N]"), ("KMN", "moment [N m]")):
            columns = {letter: log.wrench[:, AXES.index(letter)] for letter in letters}
            yield _Panel(label, {name: each for name, each in columns.items() if each.any()})


def _pose(log: Log) -> Iterator[_Panel]:
    if log.attitude is not None:
        angles = euler_from_quaternion(log.attitude)
        for segment in log.segments:
            part = slice(segment.start, segment.stop)
            angles[part] = np.unwrap(angles[part], axis=0)
        roll, pitch, yaw = np.degrees(angles).T
        yield _Panel(r"$\phi$, $\theta$ [deg]", {"roll": roll, "pitch": pitch})
        yield _Panel(r"yaw $\psi$ [deg]", {"yaw": yaw})
    if log.position is not None:
        yield _Panel("depth [m]", {"depth": log.position[:, 2]}, downward=True)


def _drawn(log: Log, contents: list[_Panel], each: float) -> Figure:
    """Draw panels above each other, with a legend beside those of several channels."""
    figure, panels = stacked(len(contents), each=each)
    for panel, content in zip(panels, contents, strict=True):
        several = len(content.channels) > 1
        for (name, values), colour in zip(content.channels.items(), cycle(SERIES), strict=False):
            (line,) = panel.plot(*trace(log, values), drawstyle=content.drawstyle, linewidth=0.7)
            line.set(color=colour if several else MEASURED, label=plain(name, 14))
        panel.set_ylabel(content.label)
        if several:
            panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.0)
        if content.downward:
            panel.invert_yaxis()
    mark_segments(panels, log)
    figure.align_ylabels(panels)
    return figure
