"""Whether a damping takes power at every velocity that a vehicle is operated at."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.errors import MethodError
from hydrodamp.identification.dissipation.operating_box import OperatingBox
from hydrodamp.identification.dissipation.power import WorstPower, worst_power
from hydrodamp.identification.dissipation.power_range import PowerRange, power_range
from hydrodamp.identification.fit import Fit
from hydrodamp.report.figures.apart import SAMPLE, Look, looks_of
from hydrodamp.report.figures.look import BAND, COLUMN, FAINT, in_our_look, settle, sheet
from hydrodamp.report.figures.symbols import plain, shortened, shown, velocity_label
from hydrodamp.simulation.score import RateUnit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS = 2
"""Panels beside each other."""


@in_our_look
def power_figure(fits: Iterable[Fit], box: OperatingBox, rate_unit: RateUnit = "deg") -> Figure:
    """Draw the power that damping puts into the motion over an operating box.

    Parameters
    ----------
    fits : iterable of Fit
        Those without numbers are left out.
    box : OperatingBox
        Such as :func:`hydrodamp.identification.dissipation.operating_box.operating_box`
        of a log.
    rate_unit : {"deg", "rad"}
        Unit of angular rates.

    Returns
    -------
    figure : Figure
        One column wide, a panel for each velocity that moves: the line is the middle of
        the power, the band all of it, over the other velocities of the box. Above zero (shaded)
        damping drives the vehicle, which water cannot. The legend says the greatest power
        that a search found.

    Raises
    ------
    MethodError
        If no fit has numbers, the box has no extent, or matplotlib is not installed.
    """
    usable = [fit for fit in fits if fit.status.usable and fit.model.n_coefficients]
    names = [
        name for name, low, high in zip(VELOCITIES, box.low, box.high, strict=True) if low < high
    ]
    if not usable or not names:
        raise MethodError(
            "power is drawn for fits with coefficients on a box with an extent; got "
            f"{len(usable)} such fits and the box {box or 'of one point'}"
        )
    rows = -(-len(names) // _COLUMNS)
    figure = sheet(COLUMN, 1.05 * rows + 0.5 + 0.13 * len(usable))
    grid = figure.subplots(rows, min(_COLUMNS, len(names)), squeeze=False, sharey=True)
    panels = dict(zip(names, grid.ravel(), strict=False))
    for empty in grid.ravel()[len(names) :]:
        empty.remove()
    looks = looks_of([(fit.model.key, fit.method) for fit in usable])
    worst = [worst_power(fit.damping, box) for fit in usable]
    for name, panel in panels.items():
        for fit, look in zip(usable, looks, strict=True):
            _draw(panel, power_range(fit.damping, box, name), name, look, rate_unit)
        panel.axhline(0.0, color=FAINT, linewidth=0.9)
        panel.margins(x=0.0)
        panel.set_xlabel(velocity_label(name, rate_unit))
        settle(panel)
    _shade(list(panels.values()))
    figure.supylabel("power into the motion [W]", fontsize=7.5)
    _legend(figure, usable, worst, looks)
    return figure


def _draw(panel: Axes, found: PowerRange, name: str, look: Look, rate_unit: RateUnit) -> None:
    column = np.zeros((len(found.velocity), 6))
    column[:, VELOCITIES.index(name)] = found.velocity
    velocity, colour, dashes = shown(column, name, rate_unit), look.colour, look.linestyle
    panel.fill_between(
        velocity, found.least, found.greatest, color=colour, alpha=BAND, linewidth=0.0
    )
    panel.plot(velocity, found.greatest, color=colour, linestyle=dashes, linewidth=0.6)
    panel.plot(velocity, found.middle, color=colour, linestyle=dashes, linewidth=1.1)


def _shade(panels: list[Axes]) -> None:
    """Set apart what lies above zero, where damping would drive the vehicle."""
    low, high = panels[0].get_ylim()
    high = max(high, 0.12 * (high - low))
    for panel in panels:
        panel.axhspan(0.0, high, color="#ececec", linewidth=0.0, zorder=0.5)
        panel.set_ylim(low, high)


def _legend(figure: Figure, fits: list[Fit], worst: list[WorstPower], looks: list[Look]) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=look.colour, linestyle=look.linestyle, label=_said(fit, most))
        for fit, most, look in zip(fits, worst, looks, strict=True)
    ]
    figure.legend(handles=handles, loc="outside upper left", labelspacing=0.25, handlelength=SAMPLE)


def _said(fit: Fit, worst: WorstPower) -> str:
    name = plain(shortened(f"{fit.model.key} by {fit.method}", 36))
    return f"{name}: at most ${worst.power:.3g}$ W"
