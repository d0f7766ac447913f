"""One look: colours of methods, words from files, files of figures."""

import sys
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb

import hydrodamp as hd
from hydrodamp.data.log import Segment
from hydrodamp.errors import FileError, MethodError
from hydrodamp.report.figures.style import (
    escape_text,
    figure_bytes,
    line_styles,
    model_colours,
    new_figure,
    with_style,
)

DEUTERANOPIA = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]]
)
"""G. M. Machado, M. M. Oliveira and L. A. F. Fernandes (2009), doi:10.1109/TVCG.2009.113."""


def linear(colour):
    """Colour as linear light."""
    value = np.array(to_rgb(colour))
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def test_every_method_has_a_marker_and_dashes_of_its_own_and_others_share_one():
    looks = line_styles([("linear", key) for key in (*hd.METHODS, "mine", "yours")])
    assert len({look.colour for look in looks}) == 1
    assert len({look.marker for look in looks}) == len(hd.METHODS) + 1
    assert len({look.dashes for look in looks}) == len(hd.METHODS) + 1


def test_models_differ_for_eyes_without_green():
    colours = model_colours([*hd.PAPER_MODELS, "mine"])
    assert len(set(colours.values())) == len(hd.PAPER_MODELS) + 1
    assert colours["linear"] == model_colours(["linear"])["linear"]
    perceived = [DEUTERANOPIA @ linear(colours[key]) for key in hd.PAPER_MODELS]
    apart = [np.linalg.norm(a - b) for i, a in enumerate(perceived) for b in perceived[:i]]
    assert min(apart) > 0.1
    luminances = [linear(colour) @ (0.2126, 0.7152, 0.0722) for colour in colours.values()]
    assert min(1.05 / (luminance + 0.05) for luminance in luminances) >= 3.0  # WCAG 2.2, 1.4.11


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:Glyph")  # the font lacks letters, which print as boxes
@pytest.mark.parametrize(
    "name", ["$\\frac{$", "a$b$c", "line\nbreak", "日本 $x", "<script>", "a_b^{c}"]
)
def test_any_name_is_printed_as_it_is(name, comparison):
    row = comparison.rows[0]
    segments = (Segment(name, 0, 3), Segment("$", 3, 5))
    log = replace(row.trajectory.log, segments=segments, time=0.1 * np.arange(5))
    figure = hd.replays_figure([replace(row, trajectory=replace(row.trajectory, log=log))])
    assert b"<script>" not in figure_bytes(figure, "svg")
    assert [text.get_text() for text in figure.axes[0].texts] == [escape_text(name), r"\$"]


@pytest.mark.slow
def test_settings_of_the_user_and_the_look_leave_each_other_alone(comparison):
    before = dict(mpl.rcParams)
    ours = figure_bytes(hd.replays_figure(comparison.rows[:1]), "svg")
    assert dict(mpl.rcParams) == before
    with mpl.rc_context({"axes.facecolor": "red", "font.size": 20, "lines.linewidth": 9}):
        assert figure_bytes(hd.replays_figure(comparison.rows[:1]), "svg") == ours


def test_without_matplotlib_the_message_says_what_to_install(comparison, monkeypatch, refused):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    refused(MethodError, hd.replays_figure, comparison.rows[:1])


@pytest.mark.parametrize(
    ("ending", "start"), [("pdf", b"%PDF"), ("svg", b"<?xml"), ("PNG", b"\x89PNG")]
)
def test_figures_are_written_the_same_each_time(ending, start, tmp_path):
    figure = with_style(lambda: new_figure(1.0, 1.0))()
    for name in ("a", "b"):
        hd.save_figure(figure, tmp_path / f"{name}.{ending}")
    first, second = ((tmp_path / f"{name}.{ending}").read_bytes() for name in ("a", "b"))
    assert first.startswith(start)
    assert first == second


def test_a_file_that_cannot_be_is_refused(tmp_path, refused):
    figure = with_style(lambda: new_figure(1.0, 1.0))()
    refused(FileError, hd.save_figure, figure, tmp_path / "a.jpg")
    refused(FileError, hd.save_figure, figure, tmp_path / "nowhere" / "a.png")
    assert not list(tmp_path.iterdir())
