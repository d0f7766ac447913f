"""Where one segment ends and the next begins, said above and drawn through all panels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from hydrodamp.data.log import Log
from hydrodamp.report.figures.look import COLUMN, FAINT
from hydrodamp.report.figures.symbols import plain, shortened
from hydrodamp.report.figures.traces import clock

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_NAMED = 8
"""Segments whose names are written; of more the number is said."""

_LETTER = 0.052
"""Mean width of a letter of the names [in]."""

_PANEL = 0.8
"""Share of a figure's width that its panels have."""

_FONT = 6.5


def mark_segments(panels: Sequence[Axes], log: Log) -> None:
    """Mark joins in every panel, name segments above the first, time below the last."""
    time, segments = clock(log), log.segments
    end = max(float(time[-1]), 1e-9)
    panels[-1].set_xlim(0.0, end)
    panels[-1].set_xlabel(_time_label(len(segments)))
    if len(segments) < 2:
        return
    for segment in segments[1:]:
        for panel in panels:
            panel.axvline(float(time[segment.start]), color=FAINT, linewidth=0.6, linestyle=":")
    if len(segments) <= MOST_NAMED:
        spans = [(float(time[one.start]), float(time[one.stop - 1])) for one in segments]
        _name(panels[0], [one.name for one in segments], spans, end)


def _time_label(count: int) -> str:
    if count < 2:
        return "time [s]"
    number = f"{count} segments" if count > MOST_NAMED else "segments"
    return f"recorded time, {number} end to end [s]"


def _name(
    panel: Axes, names: Sequence[str], spans: Sequence[tuple[float, float]], end: float
) -> None:
    """Write the names in one line, or in two by turns; what still is too long is cut."""
    figure = panel.get_figure(root=True)
    letters = _PANEL * (figure.get_figwidth() if figure else COLUMN) / _LETTER / end
    rooms = [(stop - start) * letters for start, stop in spans]
    lines = 1 if all(len(name) <= room for name, room in zip(names, rooms, strict=True)) else 2
    for place, (name, (start, stop)) in enumerate(zip(names, spans, strict=True)):
        middle = 0.5 * (start + stop)
        to_edge = 2.0 * min(middle, end - middle) * letters
        room = max(rooms[place], min(lines * end * letters / len(names), to_edge))
        panel.annotate(
            plain(shortened(name, int(room))),
            (middle, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0.0, 2.0 + 8.0 * (place % lines)),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=_FONT,
            color=FAINT,
            annotation_clip=False,
        )
