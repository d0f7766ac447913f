"""Fits made by hand, and figures that must stay on their sheet."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd

matplotlib = pytest.importorskip("matplotlib", reason="figures need the extra hydrodamp[report]")


@pytest.fixture
def on_sheet():
    """Ask of a figure that all it shows lies on its sheet."""

    def check(figure):
        figure.get_layout_engine().execute(figure)
        inked = figure.get_tightbbox()
        width, height = figure.get_size_inches()
        assert inked.x0 >= -0.01
        assert inked.y0 >= -0.01
        assert inked.x1 <= width + 0.01
        assert inked.y1 <= height + 0.01

    return check


def made_up(key, method="ls", covariance=None):
    """Return a fit with coefficients of both signs."""
    model = hd.catalog[key]
    values = np.linspace(-3.0, 5.0, model.n_coefficients)
    return hd.Fit(hd.Damping(model, values, covariance), method, hd.Status.OK)


def tied(key, tie=0.0):
    """Return a fit whose neighbouring coefficients are correlated."""
    order = np.arange(hd.catalog[key].n_coefficients)
    return made_up(key, covariance=tie ** np.abs(np.subtract.outer(order, order)))


def lost(fit):
    """Return a fit that failed."""
    return replace(fit, status=hd.Status.FAILED)


def labels(figure, side="y"):
    """Return the labels of the axes of a figure."""
    return [getattr(one, f"get_{side}label")() for one in figure.axes]


def legend(figure):
    """Return the words of the legend of a figure."""
    return [text.get_text() for one in figure.legends for text in one.get_texts()]


def words_in(panel):
    """Return the lines of text that are written into a panel."""
    return [line for text in panel.texts for line in text.get_text().splitlines() if line]
