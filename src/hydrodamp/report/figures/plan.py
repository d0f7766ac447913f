"""Figures of a dive plan: setpoints, predicted track, and predicted standard errors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.basis.term import VELOCITIES
from hydrodamp.experiment_design.result import DivePlan
from hydrodamp.report.figures import style as style
from hydrodamp.report.figures.axes import coefficient_symbol

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DEGREES = 180.0 / np.pi
"""Degrees of a radian."""


@style.with_style
def setpoint_figure(plan: DivePlan) -> Figure:
    """Draw setpoints and overlays, one panel each, with lines between segments.

    Parameters
    ----------
    plan : DivePlan
        From :func:`hydrodamp.plan`.

    Returns
    -------
    figure : Figure
        Heading in degrees, commands in the unit of the vehicle file.

    Raises
    ------
    MethodError
        If matplotlib is not installed.
    """
    figure, panels = style.stacked_panels(len(plan.setpoints), each=0.75)
    units = {"speed": " [m/s]", "heading": " [deg]", "depth": " [m]"}
    for panel, (name, values) in zip(panels, plan.setpoints.items(), strict=True):
        plotted = np.degrees(np.unwrap(values)) if name == "heading" else values
        panel.plot(plan.time, plotted, color=style.SERIES[0], drawstyle="steps-post", linewidth=0.6)
        panel.set_ylabel(name.replace("_", "\n") + units.get(name, ""))
        for segment in plan.segments[1:]:
            panel.axvline(segment.start, color=style.FAINT, linewidth=0.4)
        if name == "depth":
            panel.invert_yaxis()
    panels[-1].set_xlabel("time [s]")
    figure.align_ylabels(panels)
    return figure


@style.with_style
def track_figure(plan: DivePlan) -> Figure:
    """Draw the predicted track from above and in depth, and the velocities.

    Parameters
    ----------
    plan : DivePlan
        From :func:`hydrodamp.plan`.

    Returns
    -------
    figure : Figure
        Limits are dashed; the depth band contains 90 % of the ensemble.

    Raises
    ------
    MethodError
        If matplotlib is not installed.
    """
    assert plan.track.position is not None
    north, east, depth = plan.track.position.T
    figure = style.new_figure(style.PAGE, 4.4)
    horizontal, vertical, linear, angular = style.panel_grid(figure, 4, 2)
    horizontal.plot(east, north, color=style.SERIES[0])
    horizontal.plot(east[0], north[0], "o", color=style.MEASURED)
    if plan.waypoints is not None:
        _, north, east, *_ = plan.waypoints.T
        horizontal.plot(east, north, ".", color=style.MEASURED, markersize=3)
    horizontal.set_aspect("equal", adjustable="datalim")
    horizontal.set(xlabel="east [m]", ylabel="north [m]", title="Horizontal track, dot: start")
    if (area := plan.envelope.area) is not None:
        (west, east), (south, north) = area.east, area.north
        corners = [west, east, east, west, west], [south, south, north, north, south]
        horizontal.plot(*corners, color=style.FAINT, linestyle="--")
    vertical.fill_between(
        plan.time, *plan.depth_band.T, color=style.SERIES[0], alpha=style.BAND, linewidth=0.0
    )
    vertical.plot(plan.time, depth, color=style.SERIES[0])
    for limit in (plan.envelope.depth[0], plan.envelope.max_depth):
        vertical.axhline(limit, color=style.FAINT, linestyle="--")
    vertical.invert_yaxis()
    vertical.set(xlabel="time [s]", ylabel="depth [m]", title="Depth, band: 90 % of the ensemble")
    for panel, first, unit, factor in ((linear, 0, "m/s", 1.0), (angular, 3, "deg/s", DEGREES)):
        for index in range(first, first + 3):
            velocity, name = factor * plan.track.velocity[:, index], VELOCITIES[index]
            panel.plot(plan.time, velocity, color=style.SERIES[index], linewidth=0.5, label=name)
        panel.set(xlabel="time [s]", ylabel=f"velocity [{unit}]")
        panel.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
    return figure


@style.with_style
def prediction_figure(plan: DivePlan) -> Figure:
    """Draw standard errors relative to the coefficients: prior, baseline, this dive.

    Parameters
    ----------
    plan : DivePlan
        From :func:`hydrodamp.plan`.

    Returns
    -------
    figure : Figure
        One row per nonzero coefficient; left of the dashed line it is determined.

    Raises
    ------
    MethodError
        If matplotlib is not installed.
    """
    from hydrodamp.identification.fit import critical_value
    from hydrodamp.identification.identifiability import MAX_RELATIVE_HALF_WIDTH

    items = [item for item in plan.predictions if item.value != 0.0]
    figure = style.new_figure(style.PAGE / 2, 0.9 + 0.16 * len(items))
    (panel,) = style.panel_grid(figure, 1, 1)
    rows, sizes, entries = np.arange(len(items)), np.abs([item.value for item in items]), []
    for name, quantity, marker, colour in (
        ("prior", "prior_std_error", "s", style.FAINT),
        ("baseline of steps", "baseline_std_error", "d", style.SERIES[1]),
        ("this dive", "std_error", "o", style.SERIES[0]),
    ):
        std_errors = np.array([getattr(item, quantity) for item in items], dtype=np.float64)
        if np.isfinite(std_errors).any():
            symbol: dict[str, Any] = {"marker": marker, "color": colour, "linestyle": "none"}
            panel.plot(std_errors / sizes, rows, **symbol)
            entries.append((name, symbol))
    panel.axvline(MAX_RELATIVE_HALF_WIDTH / critical_value(), color=style.FAINT, linestyle="--")
    panel.set_xscale("log")
    panel.set_yticks(rows, [coefficient_symbol(item.label) for item in items])
    panel.invert_yaxis()
    panel.set_xlabel("standard error / coefficient")
    style.legend(figure, entries, columns=3)
    return figure
