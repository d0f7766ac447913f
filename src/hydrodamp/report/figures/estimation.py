"""Figures 2 and 3 of the paper: the data that coefficients are estimated from."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.report.figures.joins import mark_segments
from hydrodamp.report.figures.look import MEASURED, SERIES, in_our_look, stacked
from hydrodamp.report.figures.symbols import plain, shortened, shown, velocity_label
from hydrodamp.report.figures.traces import trace
from hydrodamp.simulation.score import RateUnit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SHARED = 3
"""Channels of one panel at most."""

_LETTERS = 42
"""Letters of a legend of one line."""

_ALIKE = 4.0
"""Commands whose extremes differ by no more than this ratio share a panel."""

_LEGEND = 0.3
"""Room for a legend above the lines, in their range."""

Panel = Callable[["Axes"], None]


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
    figure, panels = stacked(len(names), each=0.72)
    for panel, name in zip(panels, names, strict=True):
        panel.plot(*trace(log, shown(log.velocity, name, rate_unit)), color=MEASURED, linewidth=0.7)
        panel.set_ylabel(velocity_label(name, rate_unit))
    mark_segments(panels, log)
    figure.align_ylabels(panels)
    return figure


@in_our_look
def commands_figure(log: Log) -> Figure:
    """Draw what drove the vehicle and how it lay: figure 3 of the paper.

    Parameters
    ----------
    log : Log
        Commands or wrench, propulsion ratio, attitude and depth are drawn where they
        are recorded. Angles run on where they wrap; depth grows downward. Commands of
        like size share a panel.

    Returns
    -------
    figure : Figure
        One column wide; joins dotted, segments named.

    Raises
    ------
    MethodError
        If none of them is recorded, or matplotlib is not installed.
    """
    drawn = [*_commands(log), *_wrench(log), *_attitude(log), *_depth(log)]
    if not drawn:
        raise MethodError(
            f"{log.source or 'log'}: neither commands, a wrench, attitude nor position is "
            "recorded, so there is nothing to draw"
        )
    figure, panels = stacked(len(drawn), each=0.85)
    for panel, draw in zip(panels, drawn, strict=True):
        draw(panel)
    mark_segments(panels, log)
    figure.align_ylabels(panels)
    return figure


def _commands(log: Log) -> Iterator[Panel]:
    sizes = dict(
        zip(log.command_names, np.abs(log.commands).max(axis=0, initial=0.0), strict=False)
    )
    for group in _groups(sizes):
        channels = {name: log.command(name) for name in group}
        label = plain(group[0]) if len(group) == 1 else "commands"
        yield _panel(log, channels, f"{label}\n[as recorded]", held=True)
    if log.propulsion_ratio is not None:
        yield _panel(log, {"eta": log.propulsion_ratio}, r"$\bar\eta$ [1]")


def _groups(sizes: dict[str, float]) -> list[list[str]]:
    """Put neighbours of like size together."""
    groups: list[list[str]] = []
    for name, size in sizes.items():
        last = [sizes[other] for other in groups[-1]] if groups else []
        low, high = min([size, *last]), max([size, *last])
        if 0 < len(last) < _SHARED and high <= _ALIKE * low:
            groups[-1].append(name)
        else:
            groups.append([name])
    return groups


def _wrench(log: Log) -> Iterator[Panel]:
    if log.wrench is None:
        return
    for letters, label in (("XYZ", "force [N]"), ("KMN", "moment [N m]")):
        columns = {letter: log.wrench[:, AXES.index(letter)] for letter in letters}
        yield _panel(log, {name: each for name, each in columns.items() if each.any()}, label)


def _attitude(log: Log) -> Iterator[Panel]:
    if log.attitude is None:
        return
    angles = euler_from_quaternion(log.attitude)
    for segment in log.segments:
        part = slice(segment.start, segment.stop)
        angles[part] = np.unwrap(angles[part], axis=0)
    roll, pitch, yaw = np.degrees(angles).T
    yield _panel(log, {"roll": roll, "pitch": pitch}, r"$\phi$, $\theta$ [deg]")
    yield _panel(log, {"yaw": yaw}, r"yaw $\psi$ [deg]")


def _depth(log: Log) -> Iterator[Panel]:
    if log.position is None:
        return
    draw = _panel(log, {"depth": log.position[:, 2]}, "depth [m]")

    def downward(panel: Axes) -> None:
        draw(panel)
        panel.invert_yaxis()

    yield downward


def _panel(log: Log, channels: dict[str, FloatArray], label: str, *, held: bool = False) -> Panel:
    """Return what draws some channels; a legend only where there are several."""

    def draw(panel: Axes) -> None:
        several = len(channels) > 1
        for (name, values), colour in zip(channels.items(), SERIES, strict=False):
            panel.plot(
                *trace(log, values),
                color=colour if several else MEASURED,
                linewidth=0.7,
                drawstyle="steps-post" if held else "default",
                label=plain(shortened(name, _LETTERS // len(channels))),
            )
        panel.set_ylabel(label)
        if several:
            low, high = panel.get_ylim()
            panel.set_ylim(low, high + _LEGEND * (high - low))
            panel.legend(loc="upper left", ncols=len(channels), borderpad=0.0, handlelength=1.0)

    return draw
