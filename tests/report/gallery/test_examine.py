"""What is drawn and said of a run, and what is not."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.fit import correlated_pairs
from hydrodamp.report import captions, examine as examining
from hydrodamp.report.captions import best_of_each_method
from hydrodamp.report.examine import examine, painted
from hydrodamp.report.findings import Picture, chosen_row

HOSTILE = "</script><script>alert('1')</script><img src=x onerror=\"alert(2)\">&amp;$x$-->]]>"
SVG = "{http://www.w3.org/2000/svg}"
OF_LOGS = ["estimation-velocities", "estimation-actuation"]


@pytest.fixture
def undrawn(monkeypatch):
    """Make figures, but spend no time on drawing them."""
    drawing = b'<svg width="72pt" height="72pt">'
    monkeypatch.setattr("hydrodamp.report.figures.look.figure_bytes", lambda *_: drawing)


def names(gallery):
    return [picture.name for picture in gallery.pictures]


def with_row(table, row, **changes):
    """Return a comparison of one row that is changed."""
    return replace(table, rows=(replace(row, **changes),))


def test_everything_is_drawn_with_its_words(examined):
    gallery = examined.findings.gallery
    assert names(gallery) == [
        *("front", "horizons", "replays", "excitation", "coefficients"),
        *("correlation", "residuals", "power", *OF_LOGS, "history-ai"),
    ]
    assert gallery.not_drawn == ()
    for picture in gallery.pictures:
        assert ElementTree.fromstring(picture.svg).tag == f"{SVG}svg"
        assert all(50.0 < side < 900.0 for side in picture.size)
        assert picture.caption.endswith(".")
        assert "  " not in picture.caption
    printed = [one.name for one in gallery.pictures if one.print_only]
    assert printed == ["replays", "coefficients"]


def test_captions_say_what_is_in_the_numbers(examined):
    found, row = examined.findings.identifiability, examined.table.best()
    words = {one.name: one.caption for one in examined.findings.gallery.pictures}
    name = f"{row.model} by {row.method}"
    assert found.model.labels == row.fit.model.labels
    assert f"{examined.train.n} samples" in words["estimation-velocities"]
    assert "(depth-2600, yaw-1800, yaw-2133 and yaw-2600)" in words["estimation-velocities"]
    assert "rudder, elevator and rpm" in words["estimation-actuation"]
    quiet = [one.axis for one in found.axes if not one.excited]
    assert ("predicted on every axis" in words["excitation"]) == (not quiet)
    problem = hd.prepare(examined.vehicle, examined.train, row.fit.model)
    worst = hd.worst_power(row.fit.damping, hd.operating_box(problem)).power
    assert ("Somewhere in the box" in words["power"]) == (worst > 0.0)
    scores = hd.horizon_scores(
        examined.vehicle, row.fit.damping, row.trajectory.log, ["step"], rate_unit="deg"
    )
    assert f"{name}: one step {scores['step'].score.rms:.3f}" in words["horizons"]
    assert "one pass" in words["history-ai"] or "1 pass " in words["history-ai"]
    assert f"Shaded, of {name}: where 95 % of the replays" in words["replays"]
    assert f"{name} ({row.n_coefficients}: {row.rms:.3f})" in words["front"]
    (first, second, value), *_ = correlated_pairs(row.fit.damping.covariance)
    labels = row.fit.model.labels
    most = f"{labels[first]} with {labels[second]} ({value:+.2f})"
    assert f"The most correlated are {most}, " in words["correlation"]


def test_the_band_is_that_of_the_covariance_with_its_degrees_of_freedom(examined):
    row, band = examined.table.best(), examined.findings.band
    problem = hd.prepare(examined.vehicle, row.trajectory.log, row.fit.model)
    freedom = row.fit.uncertainty.degrees_of_freedom
    direct = hd.prediction_band(problem, row.fit.damping, degrees_of_freedom=freedom)
    np.testing.assert_array_equal(band.upper, direct.upper)
    np.testing.assert_allclose(band.velocity, row.trajectory.velocity, atol=1e-9)


@pytest.mark.usefixtures("undrawn")
def test_without_covariance_or_time_there_is_no_band(examined, monkeypatch):
    row = examined.table.row("fossen", "weak")
    bare = replace(row.fit, damping=replace(row.fit.damping, covariance=None))
    own = replace(row.trajectory, attitude="simulated")
    for changes in ({"fit": bare}, {"trajectory": own}, {"trajectory": None}):
        table = with_row(examined.table, row, **changes)
        assert examine(table, examined.vehicle, examined.train).band is None
    monkeypatch.setattr(examining, "_WORK", 1.0)
    found = examine(with_row(examined.table, row), examined.vehicle, examined.train)
    assert found.band is None
    (replays,) = (one for one in found.gallery.pictures if one.name == "replays")
    assert "Shaded" not in replays.caption


@pytest.mark.usefixtures("undrawn")
def test_without_a_score_the_data_alone_are_drawn(examined):
    rows = examined.table.rows[:2]
    lost = tuple(replace(row, score=replace(row.score, rms=None)) for row in rows)
    table = replace(examined.table, rows=lost)
    found = examine(table, examined.vehicle, examined.train)
    assert found.identifiability is None
    assert names(found.gallery) == OF_LOGS
    assert chosen_row(table) is None
    assert chosen_row(replace(table, rows=lost[:1])) is lost[0]


def test_without_matplotlib_there_are_grades_alone(examined, monkeypatch):
    monkeypatch.setattr(examining, "find_spec", lambda _: None)
    found = examine(examined.table, examined.vehicle, examined.train)
    assert found.gallery.pictures == ()
    assert 'pip install "hydrodamp[report]"' in found.gallery.not_drawn[0]
    assert found.identifiability.grades == examined.findings.identifiability.grades


@pytest.mark.usefixtures("undrawn")
def test_a_log_too_short_to_grade_is_no_fault(examined):
    found = examine(examined.table, examined.vehicle, examined.train.between(0.0, 0.5))
    assert found.identifiability is None
    assert found.not_graded.startswith("What the log determines is not known: ")
    assert not any("determines" in one for one in found.gallery.not_drawn)
    assert "estimation-velocities" in names(found.gallery)


@pytest.mark.usefixtures("undrawn")
def test_what_cannot_be_drawn_says_why(examined):
    row = examined.table.row("linear", "ai")
    found = examine(with_row(examined.table, row), examined.vehicle, examined.train)
    (said,) = found.gallery.not_drawn
    assert said.startswith("Correlation of coefficients: 'linear' by 'ai' has no covariance")
    assert said.endswith("use a method that gives one.")


@pytest.mark.parametrize(
    ("work", "settings", "words"),
    [
        (1.0, None, "take too long to be repeated here; draw it with `hd.history_figure("),
        (1e9, "AdaptiveIdentifier(a=1.0)", "other settings than 'ai' has"),
    ],
)
def test_a_history_that_is_not_to_hand_says_why(examined, monkeypatch, work, settings, words):
    monkeypatch.setattr(captions, "_WORK", work)
    row = examined.table.row("fossen", "ai")
    told = {} if settings is None else {"settings": settings}
    table = with_row(examined.table, row, fit=replace(row.fit, provenance=told))
    sketches = captions.sketches_of_logs(table, examined.vehicle, examined.train, None)
    (sketch,) = (one for one in sketches if one.name == "history-ai")
    (said,) = painted([sketch]).not_drawn
    assert words in said


def test_each_method_is_there_once_the_chosen_first(examined):
    chosen = examined.table.rows[1]
    rows = best_of_each_method(examined.table, chosen)
    assert rows[0] is chosen
    assert [row.method for row in rows] == ["weak", "ai"]
    scored = [row.rms for row in examined.table.rows if row.method == "ai" and row.rms is not None]
    assert rows[1].rms == min(scored)


def test_names_from_files_stay_text_in_words_and_drawings(examined):
    log, row = examined.train, examined.table.rows[0]
    named = tuple(replace(one, name=f"{HOSTILE}{k}") for k, one in enumerate(log.segments))
    train = replace(log, segments=named, source=HOSTILE)
    fit = replace(row.fit, method=HOSTILE)
    gallery = examine(with_row(examined.table, row, fit=fit), examined.vehicle, train).gallery
    assert len(gallery.pictures) > 7
    assert any(HOSTILE in one.caption for one in gallery.pictures)
    for one in gallery.pictures:
        assert re.fullmatch(r"[a-z-]+", one.name)
        _is_harmless(one)


def _is_harmless(picture: Picture) -> None:
    """A drawing of shapes: no script, no handler, nothing from elsewhere."""
    for element in ElementTree.fromstring(picture.svg).iter():
        if not isinstance(element.tag, str):
            continue
        kind = element.tag.rpartition("}")[2]
        assert kind not in ("script", "foreignObject", "a", "iframe", "animate", "set")
        for name, value in element.attrib.items():
            assert not name.rpartition("}")[2].startswith("on")
            if name.endswith("href"):
                assert value.startswith(("#", "data:image/png;base64,"))
    assert b"<img" not in picture.svg
    assert b"<script" not in re.sub(rb"<!--.*?-->", b"", picture.svg, flags=re.DOTALL)


def test_the_size_of_a_drawing_is_in_its_head():
    assert Picture("a", "A", "", b"<svg>").size == (0.0, 0.0)
    assert Picture("a", "A", "", b'<svg width="72pt" x="1" height="36.5pt">').size == (72, 36.5)
