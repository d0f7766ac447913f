"""Manoeuvres of a ship: track, heading and rudder, and the curve of steady turns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.experiment_design.ship_manoeuvres import SIDES, ShipManoeuvres
from hydrodamp.experiment_design.ship_motion import STOP, TURN
from hydrodamp.report.figures import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_LINES, MAX_POINTS = 31, 400  # the estimate and draws, and points of each line
DECIMALS = 6  # of lengths and degrees: rounding errors of a straight track are below them


def _look(column: int) -> dict[str, Any]:
    """Return the look of the line of the estimate, the first column, or of a draw."""
    thickness = {"linewidth": 0.4, "zorder": 2.0} if column else {"linewidth": 1.1, "zorder": 3.0}
    return {"alpha": style.BAND if column else 1.0, **thickness}


@style.with_style
def manoeuvre_figure(result: ShipManoeuvres, name: str) -> Figure:
    """Draw the track of the estimate and of draws, and heading and rudder over time."""
    ship, run, n = result.ship, result.trajectories[name], len(result.steady)
    figure = style.new_figure(style.PAGE, 2.9)
    track, motion = figure.subplots(1, 2)
    sides = SIDES[:1] if name == STOP else SIDES
    for index, colour in zip(range(len(sides)), style.SERIES, strict=False):
        n_samples = np.isfinite(run.states[:, index * n, 0]).sum()
        rows = slice(None, None, max(n_samples // MAX_POINTS, 1))
        time = run.period * np.arange(len(run.states))[rows]
        for column in range(min(n, MAX_LINES)):
            states, look = run.states[rows, index * n + column], _look(column)
            ahead, aside = (states[:, [9, 10]] / ship.length).round(DECIMALS).T
            track.plot(aside, ahead, color=colour, **look)
            motion.plot(time, np.degrees(states[:, 8]).round(DECIMALS), color=colour, **look)
        rudder = ship.side * np.degrees(run.commands[rows, index * n, ship.rudder])
        rudder[np.isnan(run.states[rows, index * n, 0])] = np.nan  # after the end
        motion.plot(time, rudder, color=colour, linestyle="--", linewidth=0.8)
    track.set(xlabel="to starboard [L]", ylabel="ahead [L]")
    if name in (TURN, STOP):
        track.set_aspect("equal", "datalim")
    motion.set(xlabel="time [s]", ylabel="heading (line), rudder (dashes) [deg]")
    lines = ({"color": colour} for colour in style.SERIES)
    style.legend(figure, [*zip((f"{name}, {side}" for side in sides), lines, strict=False)], 2)
    return figure


@style.with_style
def spiral_figure(result: ShipManoeuvres) -> Figure:
    """Draw the yaw rate of steady turns over the rudder angle, for the estimate and draws."""
    rates, angles = np.degrees(result.spiral[0]), np.degrees(result.spiral[1])
    figure = style.new_figure(style.COLUMN, 2.6)
    panel = figure.subplots()
    for column in range(min(angles.shape[1], MAX_LINES)):
        panel.plot(angles[:, column], rates, color=style.SERIES[0], **_look(column))
    panel.set(xlabel="rudder to starboard [deg]", ylabel="steady yaw rate [deg/s]")
    return figure
