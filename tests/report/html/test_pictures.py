"""Pictures in the page: as images with words, whatever their files hold, and never too large."""

from __future__ import annotations

import base64
from dataclasses import replace

import pytest

import hydrodamp as hd
from hydrodamp.identification.grades import AxisIdentifiability, Grade, Identifiability
from hydrodamp.report.findings import Findings, Gallery, Picture
from hydrodamp.report.page import grade_grid, page

from .conftest import take_apart

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


def test_a_picture_is_an_image_with_words_and_a_size(comparison):
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


def test_the_policy_lets_images_in_and_nothing_of_theirs_run(comparison):
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


def test_hostile_words_stay_text(comparison):
    picture = replace(PLAIN, title=HOSTILE, caption=HOSTILE)
    gallery = Gallery((picture,), (HOSTILE,))
    text = page(comparison, Findings(gallery=gallery))
    found = take_apart(text)
    assert HOSTILE in found.one("img").attributes["alt"]
    assert len(found.all("img")) == 1
    assert not any(name.startswith("on") for e in found.elements for name in e.attributes)
    assert HOSTILE in found.one("section", id="pictures").text
    assert "alert('1')</script>" not in text


@pytest.mark.parametrize("folder", ["figures", "damping.figures"])
def test_the_folder_is_named_also_where_the_page_shows_no_picture(comparison, folder):
    printed = replace(PLAIN, name="front", print_only=True)
    found = take_apart(page(comparison, Findings(None, Gallery((printed,)), folder=folder)))
    assert not found.all("img")
    assert (
        f"The folder {folder} of this run has the pictures"
        in found.one("section", id="pictures").text
    )
    assert "among them front.svg for what" in found.one("section", id="pictures").text


def test_why_there_are_no_grades_stands_with_what_is_not_shown(comparison):
    findings = Findings(gallery=Gallery((PLAIN,), ("Power: no.",)), not_graded=f"Not: {HOSTILE}")
    section = take_apart(page(comparison, findings)).one("section", id="pictures")
    assert section.text.index("Not shown") < section.text.index("Power: no.")
    assert f"Not: {HOSTILE}" in section.text
    bare = take_apart(page(comparison, Findings(not_graded="Not known.")))
    assert "Not known." in bare.one("section", id="pictures").text


def test_grades_stand_as_a_table(comparison):
    found = take_apart(page(comparison, Findings(GRADES)))
    section = found.one("section", id="pictures")
    assert "Coefficients of linear by how well they are known" in section.text
    assert "The folder" not in section.text
    assert not found.all("img")
    grid = grade_grid(GRADES)
    assert grid.words[0] == ["X", "6 of 6", "90 %", "yes", "2", "2", "2"]
    assert grid.words[3] == ["K", "6 of 6", "10 %", "no", "2", "2", "2"]
