"""A picture as it stands in a report and in a folder."""

from __future__ import annotations

import gc
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hydrodamp.errors import FileError, HydrodampError
from hydrodamp.report.gallery.words import sentence

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEAD = 2000
"""Bytes of a file in which the element ``svg`` begins."""


@dataclass(frozen=True)
class Picture:
    """A drawing and its words."""

    name: str
    title: str
    caption: str
    alt: str
    svg: bytes
    print_only: bool = False

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [pt]."""
        head = self.svg[:_HEAD]
        width = re.search(rb'<svg\b[^>]*?\swidth="([\d.]+)pt"', head)
        height = re.search(rb'<svg\b[^>]*?\sheight="([\d.]+)pt"', head)
        if not width or not height:
            raise FileError(
                f"{self.name}.svg: must begin as an SVG of hydrodamp does, with a size in pt: "
                "make it again by the command that wrote the folder."
            )
        return float(width[1]), float(height[1])


@dataclass(frozen=True)
class Drawn:
    """A figure with its words."""

    figure: Figure
    caption: str
    alt: str


@dataclass(frozen=True)
class Sketch:
    """A picture still to be drawn."""

    name: str
    title: str
    draw: Callable[[], Drawn]
    print_only: bool = False


@dataclass(frozen=True)
class Gallery:
    """The pictures of a run."""

    pictures: tuple[Picture, ...] = ()
    not_drawn: tuple[str, ...] = ()


def painted(
    sketches: list[Sketch], reach: Callable[[str, int, int], None] | None = None
) -> Gallery:
    """Draw sketches."""
    pictures: list[Picture] = []
    not_drawn: list[str] = []
    for place, sketch in enumerate(sketches):
        if reach is not None:
            reach(sketch.title, place, len(sketches))
        try:
            with _uncollected():
                pictures.append(_picture(sketch))
        except HydrodampError as error:
            not_drawn.append(sentence(f"{sketch.title}: {error}"))
    if reach is not None:
        reach("", len(sketches), len(sketches))
    return Gallery(tuple(pictures), tuple(not_drawn))


def _picture(sketch: Sketch) -> Picture:
    from hydrodamp.report.figures.look import figure_bytes

    drawn = sketch.draw()
    svg = figure_bytes(drawn.figure, "svg")
    return Picture(sketch.name, sketch.title, drawn.caption, drawn.alt, svg, sketch.print_only)


@contextmanager
def _uncollected() -> Iterator[None]:
    """Look for no garbage: a figure has very many parts, and none is garbage before it is drawn."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()
