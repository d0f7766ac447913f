"""A planned dive: commands, predicted track, and predicted standard errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.experiment_design.result import DivePlan
from hydrodamp.report.figures.axes import coefficient_symbol
from hydrodamp.report.figures.style import (
    BAND,
    FAINT,
    MEASURED,
    PAGE,
    SERIES,
    legend,
    new_figure,
    panel_grid,
    stacked_panels,
    with_style,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ANGLES = ("heading",)


@with_style
def orders_figure(plan: DivePlan) -> Figure:
    """Draw setpoints and excitation, a panel each, stretches apart.

    Parameters
    ----------
    plan : DivePlan
        Of :func:`hydrodamp.plan`.

    Returns
    -------
    figure : Figure
        Angles of heading in degrees, else the unit of the vehicle's commands.

    Raises
    ------
    MethodError
        If matplotlib is not installed.
    """
    figure, panels = stacked_panels(len(plan.setpoints), each=0.75)
    units = {"speed": " [m/s]", "heading": " [deg]", "depth": " [m]"}
    for panel, (name, values) in zip(panels, plan.setpoints.items(), strict=True):
        shown = np.degrees(np.unwrap(values)) if name in _ANGLES else values
        panel.plot(plan.time, shown, color=SERIES[0], drawstyle="steps-post", linewidth=0.6)
        panel.set_ylabel(name.replace("_", "\n") + units.get(name, ""))
        for one in plan.segments[1:]:
            panel.axvline(one.start, color=FAINT, linewidth=0.4)
        if name == "depth":
            panel.invert_yaxis()
    panels[-1].set_xlabel("time [s]")
    figure.align_ylabels(panels)
    return figure


@with_style
def track_figure(plan: DivePlan) -> Figure:
    """Draw where the dive goes: from above, in depth, and the velocities it sails at.

    Parameters
    ----------
    plan : DivePlan
        Of :func:`hydrodamp.plan`.

    Returns
    -------
    figure : Figure
        Limits are dashed; the band of depth holds 90 % of the draws.

    Raises
    ------
    MethodError
        If matplotlib is not installed.
    """
    assert plan.track.position is not None
    north, east, depth = plan.track.position.T
    figure = new_figure(PAGE, 4.4)
    above, below, ahead, turning = panel_grid(figure, 4, 2)
    above.plot(east, north, color=SERIES[0])
    above.plot(east[0], north[0], "o", color=MEASURED)
    if plan.waypoints is not None:
        above.plot(plan.waypoints[:, 2], plan.waypoints[:, 1], ".", color=MEASURED, markersize=3)
    above.set_aspect("equal", adjustable="datalim")
    above.set(xlabel="east [m]", ylabel="north [m]", title="From above, from the dot")
    if (area := plan.envelope.area) is not None:
        corners = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]
        above.plot(
            [area.east[e] for e, _ in corners],
            [area.north[n] for _, n in corners],
            color=FAINT,
            linestyle="--",
        )
    below.fill_between(plan.time, *plan.depth_band.T, color=SERIES[0], alpha=BAND, linewidth=0.0)
    below.plot(plan.time, depth, color=SERIES[0])
    for limit in (plan.envelope.depth[0], plan.envelope.max_depth):
        below.axhline(limit, color=FAINT, linestyle="--")
    below.invert_yaxis()
    below.set(xlabel="time [s]", ylabel="depth [m]", title="Depth, and 90 % of the draws")
    for panel, places, unit, factor in (
        (ahead, range(3), "m/s", 1.0),
        (turning, range(3, 6), "deg/s", float(np.degrees(1.0))),
    ):
        for place in places:
            values = factor * plan.track.velocity[:, place]
            panel.plot(
                plan.time, values, color=SERIES[place], linewidth=0.5, label=VELOCITIES[place]
            )
        panel.set(xlabel="time [s]", ylabel=f"velocity [{unit}]")
        panel.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
    return figure


@with_style
def prediction_figure(plan: DivePlan) -> Figure:
    """Draw standard errors as shares of the coefficients: before, by steps, by this dive.

    Parameters
    ----------
    plan : DivePlan
        Of :func:`hydrodamp.plan`.

    Returns
    -------
    figure : Figure
        One line a coefficient that is not zero; left of the dashed line it is determined.

    Raises
    ------
    MethodError
        If matplotlib is not installed.
    """
    from hydrodamp.identification.fit import critical_value
    from hydrodamp.identification.identifiability import MAX_RELATIVE_HALF_WIDTH

    rows = [one for one in plan.predictions if one.value != 0.0]
    figure = new_figure(PAGE / 2, 0.9 + 0.16 * len(rows))
    (panel,) = panel_grid(figure, 1, 1)
    marks = {
        "before": ("s", FAINT),
        "steps": ("d", SERIES[1]),
        "after": ("o", SERIES[0]),
    }
    lines = np.arange(len(rows))
    for name, (marker, colour) in marks.items():
        shares = [getattr(one, name) and getattr(one, name) / abs(one.value) for one in rows]
        given = [(s, n) for s, n in zip(shares, lines, strict=True) if s is not None]
        if given:
            panel.plot(*zip(*given, strict=True), marker=marker, color=colour, linestyle="none")
    panel.axvline(MAX_RELATIVE_HALF_WIDTH / critical_value(), color=FAINT, linestyle="--")
    panel.set_xscale("log")
    panel.set_yticks(lines, [coefficient_symbol(one.label) for one in rows])
    panel.invert_yaxis()
    panel.set_xlabel("standard error / coefficient")
    names = {"before": "before", "steps": "a campaign of steps", "after": "this dive"}
    has_before = any(one.prior_std_error is not None for one in rows)
    shown = {name: look for name, look in marks.items() if name != "before" or has_before}
    legend(
        figure,
        [
            (names[name], {"marker": marker, "color": colour, "linestyle": "none"})
            for name, (marker, colour) in shown.items()
        ],
        columns=3,
    )
    return figure
