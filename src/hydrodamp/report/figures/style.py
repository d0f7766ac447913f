"""Style of figures: sizes, colours, dashes, axes; saving."""

from __future__ import annotations

import functools
import io
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Sequence
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, ParamSpec

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.errors import FileError, MethodError
from hydrodamp.files import save_bytes
from hydrodamp.identification.fit import Fit
from hydrodamp.models.model import read_label
from hydrodamp.report.decimation import clock
from hydrodamp.simulation.replay import RateUnit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Arguments = ParamSpec("Arguments")

# Widths of one column of a journal and of both [in].
COLUMN = 3.5
PAGE = 7.16

# Colours of measurements, and of segment boundaries, limits and notes.
MEASURED = "#000000"
FAINT = "#767676"

# Colours of channels that share a panel.
SERIES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#8A56E2", "#3C96FF")

# Opacity of a band behind its line, and colour of a shaded part of a panel.
BAND = 0.22
SHADE = "#e2e2e2"

# Colour of each model; marker and dashes of each method.
_LINES: dict[str, Any] = tomllib.loads(Path(__file__).with_name("lines.toml").read_text("utf-8"))

STYLE_FILE = Path(__file__).with_name("hydrodamp.mplstyle")
_TICKS: dict[str, Any] = {"labelsize": 7.0, "width": 0.6, "color": "#555555"}

# By format; without a date, so that equal figures are equal files.
_METADATA: dict[str, dict[str, Any]] = {
    "pdf": {"CreationDate": None, "Creator": "hydrodamp"},
    "svg": {"Date": None, "Creator": "hydrodamp"},
    "png": {"Software": "hydrodamp"},
}


class LineStyle(NamedTuple):
    """Line style of a row: colour by model, marker and dashes by method."""

    colour: str
    marker: str
    dashes: tuple[float, ...]

    @property
    def line(self) -> dict[str, Any]:
        """The arguments of a line of matplotlib."""
        return {"color": self.colour, "linestyle": (0.0, self.dashes) if self.dashes else "-"}

    @property
    def points(self) -> dict[str, Any]:
        """The arguments of points of matplotlib."""
        return {"color": self.colour, "marker": self.marker, "linestyle": "none"}


def line_styles(rows: Sequence[tuple[str, str]]) -> list[LineStyle]:
    """Return the line styles of rows of (model, method)."""
    colours = model_colours([model for model, _ in rows])
    looks = (_LINES["methods"].get(method, _LINES["others"]) for _, method in rows)
    return [
        LineStyle(colours[model], marker, tuple(dashes))
        for (model, _), (marker, dashes) in zip(rows, looks, strict=True)
    ]


def model_colours(models: Iterable[str]) -> dict[str, str]:
    """Return a colour per model: that of the catalogue, else one that no other model has."""
    names = [*dict.fromkeys(models)]
    colours = {name: _LINES["models"][name] for name in names if name in _LINES["models"]}
    free = [colour for colour in _LINES["colours"] if colour not in colours.values()]
    missing = [name for name in names if name not in colours]
    return colours | dict(zip(missing, cycle(free or _LINES["colours"]), strict=False))


def named_style(fit: Fit) -> tuple[str, LineStyle]:
    """Return the name and the line style of a fit; raise if it has no coefficients."""
    if not (fit.status.usable and fit.model.n_coefficients):
        raise MethodError(f"'{fit.model.key}' by '{fit.method}' has no coefficients to draw")
    return f"{fit.model.key} by {fit.method}", line_styles([(fit.model.key, fit.method)])[0]


def with_style(draw: Callable[Arguments, Figure]) -> Callable[Arguments, Figure]:
    """Decorate a drawing function to use this style, whatever the settings of matplotlib."""

    @functools.wraps(draw)
    def draw_styled(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Figure:
        with style_context():
            figure = draw(*args, **kwargs)
            for panel in figure.axes:  # matplotlib makes ticks only when the figure is drawn
                panel.tick_params(which="both", **_TICKS)
            return figure

    return draw_styled


def style_context() -> Any:
    """Return the matplotlib context of this style."""
    try:
        from matplotlib import style
    except ImportError as error:
        raise MethodError(
            'figures need the package matplotlib: pip install "hydrodamp[report]"'
        ) from error
    return style.context(["default", STYLE_FILE])


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure with constrained layout."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def stacked_panels(panels: int, *, each: float, extra: float = 0.7) -> tuple[Figure, list[Axes]]:
    """Return a figure of stacked panels with a shared horizontal axis."""
    figure = new_figure(COLUMN, panels * each + extra)
    return figure, list(figure.subplots(panels, 1, sharex=True, squeeze=False)[:, 0])


def panel_grid(figure: Figure, count: int, columns: int, **layout: Any) -> list[Axes]:
    """Return panels of a figure in a grid with a given number of columns."""
    grid = figure.subplots(-(-count // columns), columns, squeeze=False, **layout).ravel()
    for empty in grid[count:]:
        empty.remove()
    return list(grid[:count])


def legend(figure: Figure, entries: Iterable[tuple[str, dict[str, Any]]], columns: int = 1) -> None:
    """Draw a legend above a figure."""
    from matplotlib.lines import Line2D

    lines = [Line2D([], [], label=escape_text(words, 60), **look) for words, look in entries]
    length = 3.0 if columns == 1 else 1.6
    figure.legend(handles=lines, loc="outside upper left", ncols=columns, handlelength=length)


def escape_text(text: object, most: int = 200) -> str:
    """Return a text shortened and escaped for matplotlib."""
    line = "".join(letter if letter.isprintable() else " " for letter in str(text))
    return (line if len(line) <= most else f"{line[: most - 1]}…").replace("$", r"\$")


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure whole or not at all.

    Parameters
    ----------
    figure : Figure
        From any function of this package.
    path : str or path
        Ends with ``.pdf``, ``.svg`` or ``.png``; a file that is there is replaced.

    Raises
    ------
    FileError
        If the ending is another, or the file cannot be written.
    """
    kind = Path(path).suffix.lower().lstrip(".")
    if kind not in _METADATA:
        raise FileError(f"{path}: figures are written as .pdf, .svg or .png; name one of them.")
    save_bytes(figure_bytes(figure, kind), path)


def figure_bytes(figure: Figure, kind: str) -> bytes:
    """Return a figure as the content of an image file."""
    stream = io.BytesIO()
    with style_context():
        figure.savefig(stream, format=kind, metadata=_METADATA[kind])
    return stream.getvalue()


def velocity_unit(name: str, rate_unit: RateUnit = "deg") -> str:
    """Return the display unit of a velocity."""
    return "m/s" if name in VELOCITIES[:3] else f"{rate_unit}/s"


def velocity_label(name: str, rate_unit: RateUnit = "deg") -> str:
    """Return the axis label of a velocity."""
    return f"${name}$ [{velocity_unit(name, rate_unit)}]"


def shown_velocities(velocity: FloatArray, name: str, rate_unit: RateUnit = "deg") -> FloatArray:
    """Return one velocity in its display unit."""
    column = velocity[:, VELOCITIES.index(name)]
    return np.degrees(column) if velocity_unit(name, rate_unit) == "deg/s" else column


def coefficient_symbol(label: str) -> str:
    r"""Return the symbol of a coefficient in matplotlib's math text."""
    axis, term = read_label(label)
    latex = re.sub(r"\\[lr]vert ?", "|", term.latex())
    return f"${axis}_{{{latex}}}$"


def error_scale(panel: Axes) -> None:
    """Make the vertical axis logarithmic with plain numbers; after drawing."""
    from matplotlib.ticker import LogLocator, NullLocator

    panel.set_yscale("log")
    panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=9))
    panel.yaxis.set_minor_locator(NullLocator())
    panel.yaxis.set_major_formatter("{x:g}")


MAX_SEGMENT_NAMES = 8  # segments whose names are written
PANEL_LETTERS = 56  # letters that fit above a panel


def mark_segments(panels: Sequence[Axes], log: Log) -> None:
    """Mark segment boundaries in all panels, with names above the first panel."""
    time, segments = clock(log), log.segments
    end = max(float(time[-1]), 1e-9)
    panels[-1].set_xlim(0.0, end)
    label = f"recorded time, {len(segments)} segments end to end [s]"
    panels[-1].set_xlabel(label if len(segments) > 1 else "time [s]")
    for segment in segments[1:]:
        for panel in panels:
            panel.axvline(float(time[segment.start]), color=FAINT, linewidth=0.6, linestyle=":")
    for segment in segments if 1 < len(segments) <= MAX_SEGMENT_NAMES else ():
        start, stop = float(time[segment.start]), float(time[segment.stop - 1])
        n_letters = int(PANEL_LETTERS * (stop - start) / end)
        text = escape_text(segment.name, n_letters) if n_letters > 2 else ""
        name = panels[0].text(0.5 * (start + stop), 1.02, text, ha="center", color=FAINT)
        name.set(transform=panels[0].get_xaxis_transform(), fontsize=6.5)
