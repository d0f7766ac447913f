"""RMS error against number of coefficients, with the front: what each further one buys."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hydrodamp.report.figures.apart import mark_of
from hydrodamp.report.figures.spacing import Columns, columns_of, pushed_apart
from hydrodamp.report.figures.symbols import shortened
from hydrodamp.report.numbers import error_size
from hydrodamp.validation.comparison import Comparison, Row
from hydrodamp.validation.front import front

WIDTH, HEIGHT = 720.0, 514.0
LEFT, RIGHT, TOP, BOTTOM = 64.0, 24.0, 150.0, 48.0
_ROOM = 1.12
"""Between the data and the frame, as a factor."""

_LINE = 14.0
"""Least distance of the names of two models."""

_LETTERS = 18
"""Letters of a model's name."""

_FEWEST = 4
"""Ticks that an axis must have, where finer ones can be had."""

_DIGITS: tuple[tuple[float, ...], ...] = (
    (1.0,),
    (1.0, 2.0, 5.0),
    tuple(range(1, 10)),
    tuple(k / 2 for k in range(2, 20)),
    tuple(k / 10 for k in range(10, 100)),
)
"""Ticks by powers of ten, from coarse to fine."""

_SHAPES = {
    "o": (24, 0.0, 1.0),
    "s": (4, 0.5, 1.0),
    "D": (4, 0.0, 1.0),
    "d": (4, 0.0, 0.6),
    "^": (3, 0.0, 1.0),
    "v": (3, 0.5, 1.0),
    "<": (3, 0.75, 1.0),
    ">": (3, 0.25, 1.0),
    "p": (5, 0.0, 1.0),
    "h": (6, 0.0, 1.0),
    "H": (6, 0.5, 1.0),
    "8": (8, 0.5, 1.0),
}
"""Corners, turn in parts of a corner (triangles: of a whole turn) and width of a marker."""


@dataclass(frozen=True)
class Tick:
    """A labelled place on an axis."""

    place: float
    word: str


@dataclass(frozen=True)
class Point:
    """A row in the chart."""

    x: float
    y: float
    shape: str
    method: str
    words: str
    settled: bool


@dataclass(frozen=True)
class Column:
    """A model above its points."""

    place: float
    aside: float
    name: str


@dataclass(frozen=True)
class FrontChart:
    """The chart, in its own units."""

    across: tuple[Tick, ...]
    up: tuple[Tick, ...]
    columns: tuple[Column, ...]
    points: tuple[Point, ...]
    front: str
    markers: dict[str, str]
    words: str


@dataclass(frozen=True)
class Scale:
    """A logarithmic axis."""

    low: float
    high: float
    start: float
    stop: float

    def __call__(self, value: float) -> float:
        """Return the place of a value."""
        share = math.log(max(value, self.low) / self.low) / math.log(self.high / self.low)
        return round(self.start + share * (self.stop - self.start), 1)

    def ticks(self) -> tuple[Tick, ...]:
        """Return round values in reach: 1, 2, 5 by powers of ten; finer on a short axis."""
        for digits in _DIGITS:
            values = [
                digit * 10.0**power
                for power in range(math.floor(math.log10(self.low)), 8)
                for digit in digits
                if self.low <= digit * 10.0**power <= self.high
            ]
            if len(values) >= _FEWEST:
                break
        return tuple(Tick(self(value), f"{value:g}") for value in values)


def front_chart(comparison: Comparison) -> FrontChart | None:
    """Return the chart of a comparison."""
    rows = [row for row in comparison.rows if row.rms is not None and row.n_coefficients]
    if len(rows) < 2:
        return None
    places = columns_of(rows)
    across = _scale(list(places.values()), LEFT, WIDTH - RIGHT)
    up = _scale([row.rms or 0.0 for row in rows], HEIGHT - BOTTOM, TOP)
    best = [row for row in front(comparison) if row in rows]
    return FrontChart(
        across=across.ticks(),
        up=up.ticks(),
        columns=_columns(places, across),
        points=tuple(_point(row, across(_column(row, places)), up) for row in rows),
        front=_steps([(across(_column(row, places)), up(row.rms or 0.0)) for row in best]),
        markers={method: marker(mark_of(method), 8.0, 8.0) for method in comparison.methods},
        words=_words(best),
    )


def marker(kind: str, x: float, y: float, size: float = 6.0) -> str:
    """Return the path of a marker."""
    corners, turn, width = _SHAPES.get(kind, (4, 0.5 if kind == "X" else 0.0, 1.0))
    turn *= 1.0 if corners == 3 else 1.0 / corners
    starred = kind not in _SHAPES
    places = []
    for k in range(2 * corners if starred else corners):
        radius = size * (0.35 if starred and k % 2 else 1.0)
        angle = 2.0 * math.pi * (k / (2 * corners if starred else corners) + turn)
        places.append((x + width * radius * math.sin(angle), y - radius * math.cos(angle)))
    return "M" + "L".join(f"{_short(a)} {_short(b)}" for a, b in places) + "Z"


def _scale(values: Sequence[float], start: float, stop: float) -> Scale:
    low = max(min(values), 1e-9)
    return Scale(low / _ROOM, max(max(values), low) * _ROOM, start, stop)


def _columns(places: Columns, across: Scale) -> tuple[Column, ...]:
    """Return the models with their names pushed apart."""
    at = [across(column) for column in places.values()]
    moved = pushed_apart(at, _LINE, (LEFT, WIDTH - 0.5 * _LINE))
    return tuple(
        Column(place, round(aside, 1), shortened(name, _LETTERS))
        for (_, name), place, aside in zip(places, at, moved, strict=True)
    )


def _column(row: Row, places: Columns) -> float:
    return places[row.n_coefficients, row.model]


def _point(row: Row, x: float, up: Scale) -> Point:
    y = up(row.rms or 0.0)
    return Point(
        x=x,
        y=y,
        shape=marker(mark_of(row.method), x, y),
        method=row.method,
        words=f"{row.model} by {row.method}: {row.n_coefficients} coefficients, "
        f"RMS {error_size(row.rms)}, {row.status.word}",
        settled=row.settled,
    )


def _steps(places: Sequence[tuple[float, float]]) -> str:
    """Return the front as steps: level until the next row, then down to it."""
    words = [f"M{x} {y}" if not k else f"H{x}V{y}" for k, (x, y) in enumerate(places)]
    return "".join(words)


def _words(best: Sequence[Row]) -> str:
    steps = [f"{r.model} by {r.method} ({r.n_coefficients}: {error_size(r.rms)})" for r in best]
    return (
        "No other fit beats these in both error and size, from the smallest to the most exact: "
        f"{', then '.join(steps)}."
    )


def _short(value: float) -> str:
    return f"{value:.1f}".rstrip("0").rstrip(".")
