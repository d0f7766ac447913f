"""RMS errors: against the number of coefficients, and against the length of a replay."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.errors import MethodError
from hydrodamp.report.figures.axes import error_scale
from hydrodamp.report.figures.look import (
    COLUMN,
    FAINT,
    PAGE,
    in_our_look,
    legend,
    looks_of,
    plain,
    sheet,
)
from hydrodamp.simulation.score import HorizonScores, RateUnit
from hydrodamp.validation.choice import error_of, front
from hydrodamp.validation.compare import Comparison

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Models in one column of a journal; the names of more take both.
_NARROW = 14


@in_our_look
def front_figure(comparison: Comparison) -> Figure:
    """Draw RMS error against the number of coefficients, with the front.

    Parameters
    ----------
    comparison : Comparison
        Rows that have not settled are hollow; those without an error are left out.

    Returns
    -------
    figure : Figure
        Models stand side by side with their numbers of coefficients, the smallest first, and
        methods beside each other within a model. Errors are on a logarithmic scale. The line
        joins the rows that no other beats in both.

    Raises
    ------
    MethodError
        If no row with coefficients has an error, or matplotlib is not installed.
    """
    rows = [row for row in comparison.rows if row.n_coefficients and row.rms is not None]
    if not rows:
        raise MethodError("no row with coefficients has an error, so there is no front")
    sizes = {row.model: row.n_coefficients for row in rows}
    models, methods = sorted(sizes, key=sizes.__getitem__), comparison.methods
    looks = dict(zip(methods, looks_of([("", method) for method in methods]), strict=True))
    step = min(0.7 / len(methods), 0.2)

    def place(model: str, method: str) -> float:
        return models.index(model) + step * (methods.index(method) - 0.5 * (len(methods) - 1))

    figure = sheet(COLUMN if len(models) <= _NARROW else PAGE, 3.3 + 0.05 * len(methods))
    panel = figure.subplots()
    best = [row for row in front(comparison) if row.n_coefficients]
    across = [place(row.model, row.method) for row in best]
    panel.plot(across, [*map(error_of, best)], drawstyle="steps-post", color=FAINT, linewidth=1.2)
    for row in rows:
        look = looks[row.method]
        (point,) = panel.plot([place(row.model, row.method)], [error_of(row)], **look.points)
        point.set_markerfacecolor(look.colour if row.settled else "white")
    error_scale(panel)
    names = [f"{plain(model, 22)}, {sizes[model]}" for model in models]
    panel.set_xticks(range(len(models)), names, rotation=40.0, ha="right", rotation_mode="anchor")
    panel.set_xlabel("model and number of its coefficients")
    panel.set_ylabel(_error_label(comparison.rate_unit))
    entries = [(method, look.points) for method, look in looks.items()]
    entries.append(("front", {"color": FAINT, "linewidth": 1.2}))
    hollow = {"color": FAINT, "marker": "o", "markerfacecolor": "white", "linestyle": "none"}
    if not all(row.settled for row in rows):
        entries.append(("not settled", hollow))
    legend(figure, entries, columns=3)
    return figure


@in_our_look
def horizons_figure(scores: Mapping[tuple[str, str], HorizonScores]) -> Figure:
    """Draw the RMS error at each horizon.

    Parameters
    ----------
    scores : mapping of (model, method) to HorizonScores
        All on the same log. Horizons stand at equal distances, in the order asked for. Where
        a window diverged there is no error; the legend says how many did.

    Returns
    -------
    figure : Figure
        One column wide, errors on a logarithmic scale. Colour and marker are the method,
        dashes are the model.

    Raises
    ------
    MethodError
        If there is no score, units differ, or matplotlib is not installed.
    """
    found = [one for each in scores.values() for one in each.scores]
    if not found:
        raise MethodError("there is no score at any horizon to draw")
    if len({one.score.rate_unit for one in found}) > 1:
        raise MethodError("all scores of one figure must have the same `rate_unit`")
    figure = sheet(COLUMN, 2.4 + 0.13 * len(scores))
    panel = figure.subplots()
    entries = []
    for (pair, several), look in zip(scores.items(), looks_of(list(scores)), strict=True):
        errors = [one.score.rms or np.nan for one in several.scores]
        drawn = {**look.line, "marker": look.marker}
        panel.plot([one.name for one in several.scores], errors, **drawn)
        most = max(one.diverged_share for one in several.scores)
        said = f", up to {100.0 * most:.2g} % of windows diverged" if most else ""
        entries.append((f"{' by '.join(pair)}{said}", drawn))
    error_scale(panel)
    panel.set_xlabel("replayed without a measurement for")
    panel.set_ylabel(_error_label(found[0].score.rate_unit))
    legend(figure, entries)
    return figure


def _error_label(rate_unit: RateUnit) -> str:
    return f"RMS error, eq. 24\n[m/s and {rate_unit}/s]"
