"""The one look of all figures: sizes, type, lines. What tells rows apart is in ``apart``."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ParamSpec

from hydrodamp.errors import MethodError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Given = ParamSpec("Given")

COLUMN = 3.5
"""Width of one column of a journal [in]."""

PAGE = 7.16
"""Width of both columns [in]."""

MEASURED = "#000000"
"""Colour of what was measured."""

FAINT = "#767676"
"""Colour of what is said beside the data: joins, limits, notes."""

SERIES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of channels that share a panel."""

BAND = 0.22
"""Opacity of a band behind its line."""

_STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 7.5,
    "axes.labelsize": 7.5,
    "axes.titlesize": 7.5,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "legend.frameon": False,
    "legend.borderaxespad": 0.2,
    "legend.handlelength": 1.6,
    "legend.columnspacing": 1.2,
    "axes.edgecolor": "#555555",
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-3, 6),
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.minor.size": 1.5,
    "ytick.minor.size": 1.5,
    "lines.linewidth": 0.9,
    "lines.markersize": 4.0,
    "patch.linewidth": 0.6,
    "hatch.linewidth": 0.5,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "figure.dpi": 150,
    "savefig.dpi": 300,
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "hydrodamp",
}

_KINDS = (
    "agg axes axes3d contour errorbar figure font grid hatch hist image legend lines markers "
    "mathtext patch path pdf polaraxes ps savefig scatter svg text xaxis xtick yaxis ytick"
)
_DRAWN_BY = tuple(f"{kind}." for kind in _KINDS.split(" "))
"""Settings of matplotlib that change what a figure looks like."""


def in_our_look(draw: Callable[Given, Figure]) -> Callable[Given, Figure]:
    """Make a function draw in the one look, whatever matplotlib is set to."""

    @functools.wraps(draw)
    def drawn(*args: Given.args, **kwargs: Given.kwargs) -> Figure:
        with our_look():
            return draw(*args, **kwargs)

    return drawn


def our_look() -> Any:
    """Return the context in which figures are drawn and saved."""
    try:
        import matplotlib
    except ImportError as error:
        raise MethodError(
            'figures need the package matplotlib: pip install "hydrodamp[report]"'
        ) from error
    defaults: dict[Any, Any] = dict(matplotlib.rcParamsDefault)
    ours = {key: defaults[key] for key in defaults if str(key).startswith(_DRAWN_BY)}
    ours.update(_STYLE)
    return matplotlib.rc_context(ours)


def sheet(width: float, height: float) -> Figure:
    """Return an empty figure whose parts make room for each other."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def stacked(
    panels: int, *, each: float, extra: float = 0.7, width: float = COLUMN
) -> tuple[Figure, list[Axes]]:
    """Return a figure of panels above each other that share their horizontal axis."""
    figure = sheet(width, panels * each + extra)
    axes = list(figure.subplots(panels, 1, sharex=True, squeeze=False)[:, 0])
    for one in axes:
        settle(one)
    return figure, axes


def settle(axes: Axes) -> None:
    """Fix the size of tick labels, which matplotlib makes only when it draws."""
    axes.tick_params(which="both", labelsize=_STYLE["xtick.labelsize"], width=0.6, color="#555555")
