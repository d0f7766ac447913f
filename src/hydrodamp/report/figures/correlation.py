"""How the errors of coefficients hang together, and which cannot be told apart."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit
from hydrodamp.models.model import DampingModel
from hydrodamp.report.correlated import ALIKE, Pair, correlated_pairs, correlation
from hydrodamp.report.figures.look import COLUMN, FAINT, PAGE, in_our_look, sheet
from hydrodamp.report.figures.spacing import pushed_apart
from hydrodamp.report.figures.symbols import coefficient_symbol, plain, shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

_CELL = 0.125
"""Side of a square whose name can be written beside it [in]."""

_BESIDE = 0.75
"""Room for the names [in]."""

_NUMBERED = 12
"""Coefficients whose correlations are written into the squares."""

_TOLD = 12
"""Pairs in the list, at most."""

_LINE = 0.15
"""Height of a line of the list [in]."""

_SPAN, _LETTER = 0.45, 0.06
"""Width of a line of the list without its names, and of a letter of them [in]."""

_STEP = 0.15
"""Distance of the list from the diagonal, for the names of the axes [in]."""

_LED = 0.75
"""Share of the names for which there is room that lines lead to; more would cross far."""

_LEAD = 0.18
"""Length of the lines that lead to names [in]."""

_SHARP = 40
"""Coefficients up to which squares are drawn dot by dot."""

_DARK = 0.6
"""Correlation from which a square is so dark that numbers in it are white."""

_LETTERS = 14
"""Letters of the title to the inch."""

_UNKNOWN, _DIAGONAL = "#bdbdbd", "#ececec"
"""Colours of squares without a correlation, and of those of a coefficient with itself."""


class _Sheet(NamedTuple):
    """How large the triangle is, and whose names fit beside it."""

    width: float
    named: tuple[int, ...]

    @property
    def cells(self) -> float:
        """Length of its sides [in]."""
        return self.width - _BESIDE


@in_our_look
def correlation_figure(fit: Fit) -> Figure:
    """Draw the correlation of the errors of coefficients.

    Parameters
    ----------
    fit : Fit
        With covariance.

    Returns
    -------
    figure : Figure
        A triangle with a square a pair, in the order of the model, axes divided by lines;
        those beyond 0.9 are framed, and the most correlated stand in a list. It grows with
        the model until it takes the page; beyond, only coefficients of correlated pairs are
        named. Of few coefficients the squares have numbers. Coefficients without an error of
        their own, such as those of columns that are zero, are left grey.

    Raises
    ------
    MethodError
        If the fit has no covariance, or matplotlib is not installed.
    """
    covariance = fit.damping.covariance
    if covariance is None or not fit.model.n_coefficients:
        raise MethodError(
            f"'{fit.model.key}' by '{fit.method}' has no covariance, so no correlation can be "
            "drawn: use a method that gives one"
        )
    found, pairs = correlation(covariance), correlated_pairs(covariance)
    room = _sheet_of(fit.model.n_coefficients, pairs)
    figure = sheet(room.width, 1.06 * room.width)
    panel = figure.subplots()
    image = _triangle(panel, found)
    if fit.model.n_coefficients <= _NUMBERED:
        _number(panel, found)
    _mark(panel, pairs)
    _divide(panel, fit.model)
    _name(panel, fit.model, room)
    _list(panel, fit.model, pairs, room)
    bar = figure.colorbar(image, ax=panel, location="bottom", shrink=0.7, aspect=35, pad=0.02)
    bar.set_label("correlation of errors [1]")
    bar.set_ticks([-1.0, -0.5, 0.0, 0.5, 1.0])
    bar.ax.tick_params(labelsize=7.0)
    title = shortened(f"{fit.model.key} by {fit.method}", int(room.width * _LETTERS))
    panel.set_title(plain(title), loc="left")
    return figure


def _sheet_of(n: int, pairs: list[Pair]) -> _Sheet:
    """Return the sheet for so many coefficients; beyond the page, name the most correlated."""
    width = min(max(n * _CELL + _BESIDE, COLUMN), PAGE)
    most = int((width - _BESIDE) / _CELL)
    if n <= most:
        return _Sheet(width, tuple(range(n)))
    named: set[int] = set()
    for pair in pairs:
        many = len(named | {pair.first, pair.second}) > _LED * most
        if many or abs(pair.correlation) < ALIKE:
            break
        named |= {pair.first, pair.second}
    return _Sheet(width, tuple(sorted(named)))


def _triangle(panel: Axes, found: FloatArray) -> AxesImage:
    """Draw each pair once, below the diagonal, and what has no error of its own in grey."""
    from matplotlib.colors import ListedColormap

    n = len(found)
    below = np.tri(n, k=-1, dtype=bool)
    known = np.isfinite(found)
    # Few squares are drawn dot by dot, many are left to the viewer, as one dot a square.
    drawn = "nearest" if n <= _SHARP else "none"
    ground = np.ma.masked_array(np.where(known, 0.0, 1.0), ~(below | np.eye(n, dtype=bool)))
    ground[below & known] = np.ma.masked
    colours = ListedColormap([_DIAGONAL, _UNKNOWN])
    panel.imshow(ground, cmap=colours, vmin=0.0, vmax=1.0, interpolation=drawn)
    image = panel.imshow(
        np.ma.masked_array(found, ~(below & known)),
        cmap="RdBu_r",
        vmin=-1.0,
        vmax=1.0,
        interpolation=drawn,
    )
    panel.grid(visible=False)
    panel.spines[:].set_visible(False)
    return image


def _number(panel: Axes, found: FloatArray) -> None:
    """Write the correlations into their squares, but those that round to zero."""
    for row, column in np.argwhere(np.tri(len(found), k=-1)).tolist():
        value = float(found[row, column])
        if np.isfinite(value) and abs(value) >= 0.005:
            panel.text(
                column,
                row,
                _short(value),
                ha="center",
                va="center",
                fontsize=6.0,
                color="white" if abs(value) > _DARK else "black",
            )


def _short(value: float) -> str:
    """Return a correlation without the zero before the point."""
    words = f"{value:.2f}".replace("0.", ".").replace("1.00", "1.0")
    return words.replace("-", "\N{MINUS SIGN}")


def _mark(panel: Axes, pairs: list[Pair]) -> None:
    """Frame the pairs that are better known together than apart."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Rectangle

    tied = [pair for pair in pairs if abs(pair.correlation) >= ALIKE]
    frames = [Rectangle((i - 0.5, j - 0.5), 1.0, 1.0) for i, j, _ in tied]
    panel.add_collection(
        PatchCollection(frames, facecolor="none", edgecolor="black", linewidth=0.8)
    )


def _divide(panel: Axes, model: DampingModel) -> None:
    """Divide axes by lines, and write them along the diagonal."""
    ends = np.cumsum([len(terms) for terms in model.terms]).tolist()
    n = model.n_coefficients
    for end in sorted({*ends} - {0, n}):
        edge = end - 0.5
        for line in (([-0.5, edge], [edge, edge]), ([edge, edge], [edge, n - 0.5])):
            panel.plot(*line, color="#222222", linewidth=0.6)
    for axis, end in zip(AXES, ends, strict=True):
        if count := len(model.terms[AXES.index(axis)]):
            middle = end - (count + 1) // 2
            panel.annotate(
                f"${axis}$",
                (middle + 0.5, middle - 0.5),
                (2.0, 1.0),
                textcoords="offset points",
                fontsize=8.0,
            )


def _name(panel: Axes, model: DampingModel, room: _Sheet) -> None:
    """Write names beside their squares; of some, apart and joined to them by lines."""
    n = model.n_coefficients
    symbols = [coefficient_symbol(model.labels[place]) for place in room.named]
    panel.tick_params(length=0.0, pad=1.5, labelsize=7.0)
    if len(symbols) == n:
        panel.set_xticks(range(n), symbols, rotation=90)
        panel.set_yticks(range(n), symbols)
        return
    panel.set_xticks([])
    panel.set_yticks([])
    squares = n / room.cells  # to the inch
    places = [float(place) for place in room.named]
    moved = pushed_apart(places, _CELL * squares, (0.0, n - 1.0)) if places else []
    for symbol, place, aside in zip(symbols, room.named, moved, strict=True):
        edge, away = n - 0.5, _LEAD * squares
        _lead(panel, symbol, (-0.5, place), (-0.5 - away, aside), ha="right", va="center")
        _lead(panel, symbol, (place, edge), (aside, edge + away), ha="center", va="top", turn=90)


def _lead(
    panel: Axes,
    words: str,
    place: tuple[float, float],
    aside: tuple[float, float],
    *,
    ha: str,
    va: str,
    turn: float = 0.0,
) -> None:
    panel.annotate(
        words,
        place,
        aside,
        ha=ha,
        va=va,
        rotation=turn,
        fontsize=7.0,
        annotation_clip=False,
        arrowprops={
            "arrowstyle": "-",
            "color": FAINT,
            "linewidth": 0.4,
            "shrinkA": 0,
            "shrinkB": 0,
        },
    )


def _list(panel: Axes, model: DampingModel, pairs: list[Pair], room: _Sheet) -> None:
    """Write the most correlated pairs into the empty half, as many as it holds."""
    said: list[str] = []
    free = room.cells * (1.0 - 1.0 / model.n_coefficients) - _STEP
    for i, j, value in pairs[:_TOLD]:
        one, other = model.labels[i], model.labels[j]
        depth = (len(said) + 3) * _LINE  # below it there may be a line for the others
        if depth + _SPAN + _LETTER * len(one + other) > free:
            break
        said.append(f"{coefficient_symbol(one)} with {coefficient_symbol(other)}  ${value:+.2f}$")
    if not said:
        return
    beyond = sum(abs(pair.correlation) >= ALIKE for pair in pairs) - len(said)
    more = [f"and {beyond} more beyond {ALIKE:g}"] if beyond > 0 else []
    for line, words in enumerate(["most correlated", *said, *more]):
        panel.text(
            1.0,
            1.0 - (line + 0.5) * _LINE / room.cells,
            words,
            transform=panel.transAxes,
            ha="right",
            va="center",
            color="black" if words in said else FAINT,
            fontsize=7.0,
        )
