"""Style of all figures: fonts, sizes, colours of methods, dashes of models; saving."""

from __future__ import annotations

import functools
import io
import os
from collections.abc import Callable, Iterable, Sequence
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, ParamSpec

from hydrodamp.errors import FileError, MethodError
from hydrodamp.files import save_bytes
from hydrodamp.identification.fit import Fit

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
SERIES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")

# Opacity of a band behind its line, and colour of a shaded part of a panel.
BAND = 0.22
SHADE = "#e2e2e2"

# Colour and marker of each method, and those that all other methods share.
_METHODS = {
    "recommended": ("#D55E00", "o"),
    "ls": ("#0072B2", "s"),
    "weak": ("#56B4E9", "P"),
    "ridge": ("#999933", "<"),
    "dissipative": ("#882255", ">"),
    "oe": ("#009E73", "D"),
    "ai": ("#E69F00", "^"),
    "ai-scaled": ("#CC79A7", "v"),
    "rls": ("#8C510A", "8"),
}
_OTHERS = ("#4D4D4D", "d")

# Dashes of each model: lengths on and off, in widths of the line; solid for the first.
_DASHES: tuple[tuple[float, ...], ...] = (
    (),
    (5.0, 2.0),
    (1.2, 1.6),
    (6.0, 1.6, 1.2, 1.6),
    (11.0, 2.5),
    (6.0, 1.6, 1.2, 1.6, 1.2, 1.6),
    (10.0, 2.0, 3.0, 2.0),
    (2.6, 1.2, 2.6, 4.5),
    (1.2, 4.0),
    (1.2, 1.4, 1.2, 5.0),
)

STYLE_FILE = Path(__file__).with_name("hydrodamp.mplstyle")
_TICKS: dict[str, Any] = {"labelsize": 7.0, "width": 0.6, "color": "#555555"}

# By format; without a date, so that equal figures are equal files.
_METADATA: dict[str, dict[str, Any]] = {
    "pdf": {"CreationDate": None, "Creator": "hydrodamp"},
    "svg": {"Date": None, "Creator": "hydrodamp"},
    "png": {"Software": "hydrodamp"},
}


class LineStyle(NamedTuple):
    """Line style of a row: colour and marker by method, dashes by model."""

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
    """Return the line styles of rows of (model, method); dashes in order of the models."""
    models = list(dict.fromkeys(model for model, _ in rows))
    dashes = dict(zip(models, cycle(_DASHES), strict=False))
    return [LineStyle(*_METHODS.get(method, _OTHERS), dashes[model]) for model, method in rows]


def colour_of(method: str) -> str:
    """Return the colour of a method, the same in every figure and in the report."""
    return line_styles([("", method)])[0].colour


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
