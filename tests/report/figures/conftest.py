"""Figures that must stay on their sheet, and their labels."""

import pytest

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


def labels(figure, side="y"):
    """Return the labels of the axes of a figure."""
    return [getattr(one, f"get_{side}label")() for one in figure.axes]


def legend(figure):
    """Return the words of the legend of a figure."""
    return [text.get_text() for one in figure.legends for text in one.get_texts()]
