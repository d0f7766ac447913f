"""Pictures in the page: as images with words, whatever their files hold, and never too large."""

from __future__ import annotations

import base64
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.grades import AxisIdentifiability, Grade, Identifiability
from hydrodamp.models.catalog import PAPER_MODELS
from hydrodamp.report.figures.look import figure_bytes
from hydrodamp.report.gallery.findings import Findings, Gallery, Picture
from hydrodamp.report.html.page import page
from hydrodamp.report.html.sections import grade_grid, pictures

HOSTILE = "</script><script>alert('1')</script><img src=x onerror=\"alert(2)\">&amp;"
SVG = b'<svg width="252pt" height="180pt" onload="alert(1)"><script>alert(1)</script></svg>'
PLAIN = Picture("power", "Power", "Takes power.", SVG)


GRADES = Identifiability(
    hd.catalog["linear"],
    tuple(
        AxisIdentifiability(
            axis,
            hd.catalog["linear"].labels[6 * k : 6 * k + 6],
            (*2 * (Grade.DETERMINED,), *2 * (Grade.WEAK,), *2 * (Grade.NOT_DETERMINED,)),
            (1.0,) * 6,
            6,
            3.0,
            0.1 if axis == "K" else 0.9,
            axis != "K",
            (),
        )
        for k, axis in enumerate("XYZKMN")
    ),
)


def test_a_picture_is_an_image_with_words_and_a_size(comparison, take_apart):
    findings = Findings(gallery=Gallery((PLAIN,)))
    found = take_apart(page(comparison, findings))
    image = found.one("img")
    assert image.attributes["alt"].startswith("Figure: Power.")
    assert (image.attributes["width"], image.attributes["height"]) == ("336", "240")
    kind, _, content = image.attributes["src"].partition(",")
    assert kind == "data:image/svg+xml;base64"
    assert base64.b64decode(content) == SVG
    assert "figure" in image.inside
    (caption,) = [e for e in found.all("figcaption") if "Takes power." in e.text]
    assert caption.text.startswith("Power.")
    assert found.one("section", id="pictures")
    assert found.all("a", href="#pictures")


def test_the_policy_lets_images_in_and_nothing_of_theirs_run(comparison, take_apart):
    bare, hung_up = (
        take_apart(page(comparison, Findings(gallery=gallery)))
        for gallery in (Gallery(), Gallery((PLAIN,)))
    )
    assert len(bare.all("script")) == len(hung_up.all("script"))
    assert not hung_up.all("svg", onload="alert(1)")
    (policy,) = (
        m.attributes["content"] for m in hung_up.all("meta") if "http-equiv" in m.attributes
    )
    assert "img-src data:" in policy
    assert "object-src" not in policy
    assert "default-src 'none'" in policy


def test_hostile_words_stay_text(comparison, take_apart):
    picture = replace(PLAIN, title=HOSTILE, caption=HOSTILE)
    gallery = Gallery((picture,), (HOSTILE,))
    text = page(comparison, Findings(gallery=gallery))
    found = take_apart(text)
    assert HOSTILE in found.one("img").attributes["alt"]
    assert len(found.all("img")) == 1
    assert not any(name.startswith("on") for e in found.elements for name in e.attributes)
    assert HOSTILE in found.one("section", id="pictures").text
    assert "alert('1')</script>" not in text


def test_pictures_for_which_there_is_no_room_are_named():
    large = replace(PLAIN, name="large", title="Large", svg=SVG + b" " * 3000)
    printed = replace(PLAIN, name="front", print_only=True)
    findings = Findings(gallery=Gallery((large, PLAIN, printed), ("Other: no.",)))
    section = pictures(findings, 2000)
    assert [one.picture.name for one in section.images] == ["power"]
    assert section.not_shown == ("Other: no.", "Large: large.svg is too large for this page.")
    assert section.print_only == ("front.svg",)
    assert pictures(Findings(), 2000) is None


@pytest.mark.parametrize("folder", ["figures", "damping.figures"])
def test_the_folder_is_named_also_where_the_page_shows_no_picture(comparison, take_apart, folder):
    printed = replace(PLAIN, name="front", print_only=True)
    found = take_apart(page(comparison, Findings(None, Gallery((printed,)), folder=folder)))
    assert not found.all("img")
    assert (
        f"The folder {folder} of this run has the pictures"
        in found.one("section", id="pictures").text
    )
    assert "among them front.svg for what" in found.one("section", id="pictures").text


def test_why_there_are_no_grades_stands_where_they_would(comparison, take_apart):
    findings = Findings(gallery=Gallery((PLAIN,)), not_graded=f"Not known: {HOSTILE}")
    section = take_apart(page(comparison, findings)).one("section", id="pictures")
    assert f"Not known: {HOSTILE}" in section.text
    assert section.text.index("Not known") < section.text.index("Takes power.")
    assert "Not shown" not in section.text
    bare = take_apart(page(comparison, Findings(not_graded="Not known.")))
    assert "Not known." in bare.one("section", id="pictures").text


def test_grades_stand_as_a_table(comparison, take_apart):
    found = take_apart(page(comparison, Findings(GRADES)))
    section = found.one("section", id="pictures")
    assert "Coefficients of linear by how well they are known" in section.text
    assert "The folder" not in section.text
    assert not found.all("img")
    grid = grade_grid(GRADES)
    assert grid.words[0] == ["X", "6 of 6", "90 %", "yes", "2", "2", "2"]
    assert grid.words[3] == ["K", "6 of 6", "10 %", "no", "2", "2", "2"]


def test_an_hour_at_ten_hertz_with_pictures_is_small(make_log, make_comparison):
    """As noisy as a log can be, so that no line is simpler than its bins."""
    pytest.importorskip("matplotlib")
    log = make_log(3600.0, 10.0)
    rng = np.random.default_rng(7)
    noisy = replace(log, wrench=rng.standard_normal((log.n, 6)))
    figures = hd.velocities_figure(noisy), hd.commands_figure(noisy)
    drawings = [figure_bytes(figure, "svg") for figure in figures]
    assert all(len(svg) < 500_000 for svg in drawings)
    many = tuple(replace(PLAIN, name=f"p{k}", svg=drawings[k % 2]) for k in range(16))
    table = make_comparison(log, PAPER_MODELS, ("ls", "ai", "ai-scaled", "recommended"))
    text = page(table, Findings(gallery=Gallery(many)))
    assert len(text.encode()) < 5_000_000
    assert text.count("data:image/svg+xml") >= 4
    assert "too large for this page" in text
