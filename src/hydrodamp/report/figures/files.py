"""Figures as files: PDF and SVG for print, PNG for screens."""

from __future__ import annotations

import io
import os
import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hydrodamp.errors import FileError
from hydrodamp.files import save_bytes
from hydrodamp.report.figures.look import our_look
from hydrodamp.report.figures.svg import as_svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_METADATA: dict[str, dict[str, Any]] = {
    "pdf": {"CreationDate": None, "Creator": "hydrodamp"},
    "svg": {"Date": None, "Creator": "hydrodamp"},
    "png": {"Software": "hydrodamp"},
}
"""By format: no clock, so that the same figure is the same file."""


_PATH = re.compile(rb"<path [^<>]*>")
_LONG = re.compile(rb"(?<=[ML ])(-?\d+\.\d\d)\d+")


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
    """Return a figure as the content of a file."""
    stream = io.BytesIO()
    with our_look(), warnings.catch_warnings():
        # A name in a script the font lacks prints as boxes: no reason to refuse the figure.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        if kind == "svg":
            return _PATH.sub(_cut, as_svg(figure, _METADATA[kind]))
        figure.savefig(stream, format=kind, metadata=_METADATA[kind])
    return stream.getvalue()


def _cut(path: re.Match[bytes]) -> bytes:
    """Return a path cut to hundredths of a point; matplotlib writes millionths."""
    return _LONG.sub(rb"\1", path[0])
