"""How errors grow with the time since a replay last saw a measurement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from hydrodamp.errors import MethodError
from hydrodamp.report.figures.apart import SAMPLE, Look, looks_of
from hydrodamp.report.figures.look import COLUMN, FAINT, in_our_look, settle, sheet
from hydrodamp.report.figures.scales import round_ticks
from hydrodamp.report.figures.symbols import plain, shortened
from hydrodamp.simulation.horizons import Horizon, HorizonScore, HorizonScores

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROW = 0.06
"""Height of a row of the lane for horizons without an error, as a share of the panel's."""

_LANE = 0.35
"""Height of the whole lane at most."""


@in_our_look
def horizons_figure(
    scores: Mapping[tuple[str, str], HorizonScores], models: Sequence[str] = ()
) -> Figure:
    """Draw the RMS error at each horizon.

    Parameters
    ----------
    scores : mapping of (model, method) to HorizonScores
        All on the same log. Horizons stand at equal distances, the shortest first. Where
        a window diverged there is no error: a cross at the top, in the order of the
        legend, says how many did.
    models : sequence of str, optional
        The models that take dashes first, in this order; by default they take them as they
        come, the first a solid line.

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
    horizons = sorted({one.horizon for one in found}, key=_length)
    figure = sheet(COLUMN, 2.6 + 0.13 * len(scores))
    panel = figure.subplots()
    panel.set_yscale("log")
    names = {one.horizon: one.name for one in found}
    panel.set_xticks(range(len(horizons)), [names[horizon] for horizon in horizons])
    panel.set_xlim(-0.3, len(horizons) - 0.5)
    panel.set_xlabel("replayed without a measurement for")
    panel.set_ylabel(f"RMS error, eq. 24\n[m/s and {found[0].score.rate_unit}/s]")
    settle(panel)
    lane = _lane_of(scores)
    for pair, look in zip(scores, looks_of(list(scores), models), strict=True):
        _draw(panel, scores[pair], horizons, pair, look, lane.get(pair))
    _make_room(panel, [one.score.rms for one in found if one.score.rms], len(lane))
    figure.legend(loc="outside upper left", labelspacing=0.25, handlelength=SAMPLE)
    return figure


Pair = tuple[str, str]
"""Model and method."""


def _lane_of(scores: Mapping[Pair, HorizonScores]) -> dict[Pair, float]:
    """Return the height of the row of each pair of which a window diverged, as a share."""
    lost = [pair for pair, each in scores.items() if any(one.n_diverged for one in each.scores)]
    return {pair: 1.0 - _row(len(lost)) * (place + 0.6) for place, pair in enumerate(lost)}


def _row(rows: int) -> float:
    """Return the height of a row of the lane, lower where there are many."""
    return min(_ROW, _LANE / max(rows, 1))


def _length(horizon: Horizon) -> float:
    words = {"step": 0.0, "run": float("inf")}
    return words[horizon] if isinstance(horizon, str) else float(horizon)


def _draw(
    panel: Axes,
    scores: HorizonScores,
    horizons: list[Horizon],
    pair: Pair,
    look: Look,
    row: float | None,
) -> None:
    ordered = sorted(scores.scores, key=lambda one: _length(one.horizon))
    places = [horizons.index(one.horizon) for one in ordered]
    errors = [float("nan") if one.score.rms is None else one.score.rms for one in ordered]
    label = plain(shortened(" by ".join(pair), 44))
    (line,) = panel.plot(places, errors, linestyle=look.linestyle, color=look.colour, label=label)
    line.set(marker=look.marker, markersize=4.0)
    for place, one in zip(places, ordered, strict=True):
        if row is not None and one.n_diverged:
            _cross(panel, place, one, look.colour, row)


def _cross(panel: Axes, place: int, one: HorizonScore, colour: str, height: float) -> None:
    """Mark a horizon at which windows diverged, and say how many."""
    where = panel.get_xaxis_transform()
    panel.plot([place], [height], "x", color=colour, transform=where, markeredgewidth=1.2)
    words = f"{one.n_diverged}/{one.n_windows}"
    panel.text(place + 0.1, height, words, transform=where, va="center", fontsize=6.0)


def _make_room(panel: Axes, errors: list[float], rows: int) -> None:
    """Leave a lane above the errors for windows that diverged."""
    low, high = (min(errors) / 1.3, max(errors) * 1.3) if errors else (0.1, 10.0)
    panel.set_ylim(low, high)
    round_ticks(panel.yaxis, low, high)
    if not rows:
        return
    from matplotlib.patches import Rectangle

    height = _row(rows) * (rows + 0.2)
    panel.set_ylim(low, low * (high / low) ** (1.0 / (1.0 - height)))
    box = Rectangle((0.0, 1.0 - height), 1.0, height, transform=panel.transAxes)
    box.set(facecolor="#efefef", edgecolor="none", zorder=0.5)
    panel.add_patch(box)
    words = "windows diverged, of all"
    panel.text(0.0, 1.01, words, transform=panel.transAxes, fontsize=6.0, color=FAINT)
