"""SVG in half the time: byte for byte what matplotlib writes by itself."""

from __future__ import annotations

import io
import re

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.report.figures.files import figure_bytes
from hydrodamp.report.figures.histories import history_figure
from hydrodamp.report.figures.look import our_look
from hydrodamp.report.figures.svg import as_svg, fix_empty_labels

METADATA = {"Date": None, "Creator": "hydrodamp"}


def correlation():
    """Symbols at both sides, an image, a colour bar."""
    model = hd.catalog["fossen"]
    n = model.n_coefficients
    damping = hd.Damping(model, -np.arange(1.0, n + 1), 0.5 * np.eye(n) + 0.5)
    return hd.correlation_figure(hd.Fit(damping, "ls", hd.Status.OK, n))


def history():
    """Panels whose labels are aligned, legends, and lines that are drawn dot by dot."""
    time = np.linspace(0.0, 100.0, 200)
    labels = tuple(label for label in hd.catalog["gertler-hagen"].labels if label.startswith("X"))
    values = np.sin(np.outer(time, np.arange(1.0, len(labels) + 1)) / 100.0)
    return history_figure(hd.History(time, np.cos(time)[:, None] * np.ones(6), values, labels))


def by_matplotlib(figure):
    stream = io.BytesIO()
    with our_look():
        figure.savefig(stream, format="svg", metadata=METADATA)
    return stream.getvalue()


def unnamed(svg: bytes) -> bytes:
    """Leave out the names of clipping paths, which matplotlib takes from where objects lie."""
    return re.sub(rb"\bp[0-9a-f]{10}\b", b"p", svg)


@pytest.mark.parametrize("draw", [correlation, history])
def test_the_same_bytes_as_savefig_writes(draw):
    with our_look():
        assert unnamed(as_svg(draw(), METADATA)) == unnamed(by_matplotlib(draw()))


@pytest.mark.parametrize("draw", [correlation, history])
def test_places_of_empty_labels_change_nothing(draw):
    figure = draw()
    fix_empty_labels(figure)
    assert unnamed(figure_bytes(figure, "svg")) == unnamed(figure_bytes(draw(), "svg"))


def test_a_figure_can_be_drawn_again():
    figure = correlation()
    before = figure.dpi, figure.canvas, figure.get_layout_engine()
    assert figure_bytes(figure, "svg").endswith(b"</svg>\n")
    assert (figure.dpi, figure.canvas, figure.get_layout_engine()) == before
    assert figure_bytes(figure, "svg").endswith(b"</svg>\n")
    assert figure_bytes(figure, "png").startswith(b"\x89PNG")
