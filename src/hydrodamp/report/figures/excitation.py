"""What a log determines: motion by axis, and coefficients by grade."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.errors import MethodError
from hydrodamp.identification.trust.excitation import EXCITED
from hydrodamp.identification.trust.grades import Grade
from hydrodamp.identification.trust.identifiability import Identifiability
from hydrodamp.report.figures.look import COLUMN, FAINT, in_our_look, settle, sheet
from hydrodamp.report.figures.symbols import plain, shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_GRADES = {
    Grade.DETERMINED: ("#0072B2", ""),
    Grade.WEAK: ("#9fcbe6", "////"),
    Grade.NOT_DETERMINED: ("#d0d0d0", ""),
}
"""Colour and hatching: dark to light, as what is known grows less."""


@in_our_look
def excitation_figure(found: Identifiability) -> Figure:
    """Draw how far each axis is excited, and how well its coefficients are determined.

    Parameters
    ----------
    found : Identifiability
        Of :func:`hydrodamp.identification.trust.identifiability.identifiability`.

    Returns
    -------
    figure : Figure
        To the left the share of the response to motion that is predicted on stretches
        held out, with the least share that counts as excited; to the right how many
        coefficients have which grade, with the rank.

    Raises
    ------
    MethodError
        If the model has no coefficient, or matplotlib is not installed.
    """
    if not found.axes:
        raise MethodError(f"model '{found.model.key}' has no coefficient, so nothing is excited")
    figure = sheet(COLUMN, 0.28 * len(found.axes) + 1.0)
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 1.15))
    _shares(left, found)
    _grades(right, found)
    for panel in (left, right):
        panel.grid(visible=False, axis="y")
        settle(panel)
        panel.tick_params(axis="y", length=0.0, labelsize=8.0)
    left.set_yticks(range(len(found.axes)), [f"${one.axis}$" for one in found.axes])
    left.set_ylim(len(found.axes) - 0.4, -0.6)
    handles, labels = right.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=3, handlelength=1.0)
    return figure


def _shares(panel: Axes, found: Identifiability) -> None:
    shares = np.array([one.share for one in found.axes])
    for place, (one, share) in enumerate(zip(found.axes, shares.tolist(), strict=True)):
        colour = "#4d4d4d" if one.excited else "#ffffff"
        panel.barh(place, share, height=0.62, color=colour, edgecolor="#4d4d4d")
        words = f"{100.0 * share:.0f} %" if one.excited else f"{100.0 * share:.0f} %, not predicted"
        inside = share > 0.6
        panel.text(
            share - 0.03 if inside else max(share, EXCITED) + 0.03,
            place,
            words,
            ha="right" if inside else "left",
            va="center",
            fontsize=6.5,
            color="white" if inside and one.excited else "#222222",
        )
    panel.axvline(EXCITED, color=FAINT, linewidth=0.9, linestyle="--")
    panel.set_xlim(0.0, 1.0)
    panel.set_xticks([0.0, 0.5, 1.0])
    panel.set_xlabel("predicted share of\nthe response [1]")


def _grades(panel: Axes, found: Identifiability) -> None:
    places = np.arange(len(found.axes))
    start = np.zeros(len(found.axes))
    for grade, (colour, hatch) in _GRADES.items():
        counts = np.array([one.count(grade) for one in found.axes], dtype=float)
        panel.barh(
            places,
            counts,
            left=start,
            height=0.62,
            color=colour,
            hatch=hatch,
            edgecolor="#4d4d4d",
            label=grade.word,
        )
        start += counts
    for place, one in enumerate(found.axes):
        panel.text(
            start[place] + 0.02 * start.max(), place, f"rank {one.rank}", va="center", fontsize=6.5
        )
    panel.set_xlim(0.0, 1.32 * start.max())
    panel.locator_params(axis="x", integer=True, nbins=5)
    panel.set_xlabel(f"coefficients by grade,\n{plain(shortened(found.model.key, 24))}")
