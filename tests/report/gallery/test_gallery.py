"""What is drawn and said of a run, and what is not."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.dissipativity import max_damping_power, operating_box
from hydrodamp.report import pictures as drawing
from hydrodamp.report.pictures import residual_caption
from hydrodamp.validation import diagnostics
from hydrodamp.validation.diagnostics import find_selected_row

from .conftest import draw


@pytest.fixture
def undrawn(monkeypatch):
    """Make figures, but spend no time on drawing them."""
    monkeypatch.setattr(drawing.style, "figure_bytes", lambda *_: b"<svg>")


def names(found):
    return [picture.name for picture in found.pictures]


def with_row(table, row, **changes):
    """Return a comparison of one row that is changed."""
    return replace(table, rows=(replace(row, **changes),))


def test_everything_is_drawn_with_its_words(sailed, findings):
    found = findings
    assert names(found) == ["front", "horizons", "replays", "residuals", "power"]
    assert found.not_shown == ()
    assert found.identifiability.model.labels == sailed.table.best().fit.model.labels
    for picture in found.pictures:
        root = ElementTree.fromstring(picture.svg)
        assert root.tag.endswith("svg")
        assert float(root.attrib["width"].rstrip("pt")) == pytest.approx(
            0.75 * picture.width, abs=1
        )
        assert picture.caption.endswith(".")
        assert "  " not in picture.caption


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_captions_say_where_residuals_are_coloured_and_where_damping_drives(sailed):
    row = sailed.table.row("fossen", "weak")
    problem = hd.prepare(sailed.vehicle, sailed.train, row.fit.model)
    wrong = {label: 50.0 * (label == "Y_v") for label in row.fit.model.labels}
    bad = replace(row.fit, damping=hd.Damping.from_dict(row.fit.model, wrong))
    for fit, driven in ((row.fit, False), (bad, True)):
        found = draw(with_row(sailed.table, row, fit=fit), sailed.vehicle, sailed.train)
        said = {one.name: one.caption for one in found.pictures}
        assert said["residuals"].startswith(hd.diagnose(problem, fit.damping)[0])
        assert ("injects energy" in said["power"]) == driven
        power, velocity = max_damping_power(fit.damping, operating_box(problem))
        assert (f"{power:.3g} W at most" in said["power"]) == driven
        assert (f"v {velocity[1]:.2g}" in said["power"]) == driven
    caption = residual_caption(("Many residuals are outliers.",))
    assert "white" in caption.partition("Many residuals")[0]


def test_the_band_is_that_of_the_covariance_with_its_degrees_of_freedom(sailed, findings):
    row, band = sailed.table.best(), findings.band
    problem = hd.prepare(sailed.vehicle, row.trajectory.log, row.fit.model)
    freedom = row.fit.uncertainty.degrees_of_freedom
    direct = hd.prediction_band(problem, row.fit.damping, degrees_of_freedom=freedom)
    np.testing.assert_array_equal(band.upper, direct.upper)
    np.testing.assert_allclose(band.velocity, row.trajectory.velocity, atol=1e-9)
    (replays,) = (one for one in findings.pictures if one.name == "replays")
    assert f"95 % band of {row.model} by {row.method}" in replays.caption


def test_without_covariance_or_time_there_is_no_band(sailed, monkeypatch):
    row = sailed.table.row("fossen", "weak")
    assert diagnostics.replay_band(sailed.vehicle, row) is not None
    bare = replace(row.fit, damping=replace(row.fit.damping, covariance=None))
    own = replace(row.trajectory, attitude="simulated")
    for changes in ({"fit": bare}, {"trajectory": own}, {"trajectory": None}):
        assert diagnostics.replay_band(sailed.vehicle, replace(row, **changes)) is None
    monkeypatch.setattr(diagnostics, "MAX_BAND_WORK", 1.0)
    assert diagnostics.replay_band(sailed.vehicle, row) is None


@pytest.mark.usefixtures("undrawn")
def test_without_a_score_nothing_is_drawn(sailed):
    rows = sailed.table.rows[:2]
    lost = tuple(replace(row, score=replace(row.score, rms=None)) for row in rows)
    table = replace(sailed.table, rows=lost)
    found = draw(table, sailed.vehicle, sailed.train)
    assert found.identifiability is None
    assert names(found) == []
    assert find_selected_row(table) is None
    assert find_selected_row(replace(table, rows=lost[:1])) is lost[0]


@pytest.mark.usefixtures("undrawn")
def test_what_cannot_be_graded_or_drawn_says_why(sailed):
    row = sailed.table.row("linear", "ai")
    short = sailed.train.between(0.0, 0.5)
    found = draw(with_row(sailed.table, row), sailed.vehicle, short)
    assert found.identifiability is None
    said = "\n".join(found.not_shown)
    assert "Coefficients are not graded: " in said
