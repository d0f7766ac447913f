"""Steps and stability margins of a control design."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.control.design import ControlDesign
from hydrodamp.control.loop_margins import MIN_MODULUS
from hydrodamp.errors import MethodError
from hydrodamp.report.figures import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@style.with_style
def step_figure(design: ControlDesign) -> Figure:
    """Draw the simulated step at each speed, with the range over draws of the damping."""
    runs = [(each.speed, each.step) for each in design.loops]
    if not runs:
        raise MethodError("no speed has a closed loop to draw")
    figure = style.new_figure(style.COLUMN, 1.3 * len(runs) + 0.5)
    panels = style.panel_grid(figure, len(runs), 1)
    for panel, (speed, run) in zip(panels, runs, strict=True):
        is_depth = bool(np.any(run.setpoints[:, :, 2]))
        name, column, unit = (
            ("depth [m]", 11, 1.0) if is_depth else ("heading [deg]", 8, np.degrees(1.0))
        )
        time, values = run.period * np.arange(len(run.states)), unit * run.states[:, :, column]
        low, high = values.min(axis=1), values.max(axis=1)
        panel.fill_between(time, low, high, facecolor=(style.SERIES[0], style.BAND), linewidth=0.0)
        setpoint = unit * run.setpoints[:, 0, 2 if is_depth else 1]
        panel.plot(time, setpoint, color=style.FAINT, linewidth=0.7, linestyle="--")
        panel.plot(time, values[:, 0], color=style.SERIES[0], linewidth=0.9)
        panel.set_ylabel(f"{name}\nat {speed:g} m/s")
        if is_depth:
            panel.invert_yaxis()
    panels[-1].set_xlabel("time [s]")
    looks: dict[str, dict[str, Any]] = {
        "estimate": {"color": style.SERIES[0]},
        f"{runs[0][1].states.shape[1] - 1} draws": {
            "color": style.SERIES[0],
            "linewidth": 5,
            "alpha": style.BAND,
        },
        "setpoint": {"color": style.FAINT, "linestyle": "--"},
    }
    style.legend(figure, looks.items(), 3)
    return figure


@style.with_style
def margins_figure(design: ControlDesign) -> Figure:
    """Draw the modulus margin of each loop over the speed, with the range over draws."""
    entries = design.loops
    if not entries:
        raise MethodError("no speed has margins to draw")
    figure = style.new_figure(style.COLUMN, 2.4)
    panel, speeds = figure.subplots(), [each.speed for each in entries]
    values = [each.margins.modulus for each in entries]
    names, looped = entries[0].autopilot.names, np.flatnonzero(entries[0].law.d.any(axis=1))
    looks = []
    for index, colour in zip(looped, style.SERIES * len(names), strict=False):
        centre = [each[0, index] for each in values]
        below = [each[0, index] - each[:, index].min() for each in values]
        above = [each[:, index].max() - each[0, index] for each in values]
        panel.errorbar(
            speeds, centre, [below, above], color=colour, marker="o", capsize=2.0, linewidth=0.9
        )
        looks.append((names[index], {"color": colour, "marker": "o"}))
    panel.axhline(MIN_MODULUS, color=style.FAINT, linewidth=0.7, linestyle="--")
    panel.set(xlabel="surge speed [m/s]", ylabel="modulus margin", ylim=(0.0, None))
    style.legend(figure, [*looks, ("required", {"color": style.FAINT, "linestyle": "--"})], 4)
    return figure
