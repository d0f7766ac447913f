"""A figure as SVG, by one renderer that measures and draws."""

from __future__ import annotations

import io
from functools import cache, lru_cache
from importlib import import_module
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.font_manager import FontProperties

_DOTS = 72.0
"""Units of an SVG in an inch."""

_SYMBOLS = 1000
"""Parsed symbols that are kept: those of all pictures of a run."""


def as_svg(figure: Figure, metadata: dict[str, Any]) -> bytes:
    """Lay out and draw a figure."""
    from matplotlib import rcParams

    vector: Any = import_module("matplotlib.backends.backend_svg")
    mixed: Any = import_module("matplotlib.backends.backend_mixed")
    stream, (width, height) = io.StringIO(), figure.get_size_inches()
    raster, canvas, dots = rcParams["savefig.dpi"], figure.canvas, figure.dpi
    size = _DOTS * width, _DOTS * height
    page = vector.RendererSVG(*size, stream, image_dpi=raster, metadata=metadata)
    page._text2path = _letters()  # were it called otherwise one day, drawing would only be slower
    figure.dpi = _DOTS
    try:
        renderer = mixed.MixedModeRenderer(figure, width, height, raster, page)
        own = vector.FigureCanvasSVG(figure)
        own.get_renderer = lambda: renderer  # the layout asks for it
        figure.draw(renderer)
        renderer.finalize()
    finally:
        figure.dpi = dots
        figure.set_canvas(canvas)
    return stream.getvalue().encode("utf-8")


def fix_empty_labels(figure: Figure) -> None:
    """Fix the places of labels without words, which matplotlib else works out from all ticks."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if not axis.get_label().get_text():
                axis.set_label_coords(0.5, 0.5)


@cache
def _letters() -> Any:
    """Return what makes outlines of words, with a memory for symbols."""
    from matplotlib.mathtext import MathTextParser
    from matplotlib.textpath import TextToPath

    letters: Any = TextToPath()
    parser = MathTextParser("path")

    @lru_cache(_SYMBOLS)
    def parse(text: str, dpi: float, font: FontProperties) -> Any:
        return parser.parse(text, dpi, font)

    letters.mathtext_parser = SimpleNamespace(parse=parse)
    return letters
