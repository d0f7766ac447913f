"""Pictures in the page: as images with words, whatever their files hold, and never too large."""

from __future__ import annotations

import base64
from dataclasses import replace

import numpy as np
import pytest
from hydrodamp.report.unfinished import unfinished

import hydrodamp as hd
from hydrodamp.identification.grades import AxisIdentifiability, Grade, Identifiability
from hydrodamp.models.catalog import PAPER_MODELS
from hydrodamp.report.figures.look import figure_bytes
from hydrodamp.report.gallery.findings import Findings, Gallery, Picture
from hydrodamp.report.html.page import page
from hydrodamp.report.html.pictures import pictures_section
from hydrodamp.report.html.summary import summary

HOSTILE = "</script><script>alert('1')</script><img src=x onerror=\"alert(2)\">&amp;"
SVG = b'<svg width="252pt" height="180pt" onload="alert(1)"><script>alert(1)</script></svg>'
PLAIN = Picture("power", "Power", "Takes power.", SVG)


def graded(grades: str, *, excited: bool = True) -> Identifiability:
    """Return grades of 'linear': a letter d, w or n for each coefficient of every axis."""
    words = {"d": Grade.DETERMINED, "w": Grade.WEAK, "n": Grade.NOT_DETERMINED}
    model = hd.catalog["linear"]
    axes = []
    for k, axis in enumerate("XYZKMN"):
        labels = model.labels[6 * k : 6 * k + 6]
        sure = tuple(words[letter] for letter in grades)
        share = 0.9 if excited or axis != "K" else 0.1
        axes.append(
            AxisIdentifiability(axis, labels, sure, (1.0,) * 6, 6, 3.0, share, share > 0.25, ())
        )
    return Identifiability(model, tuple(axes))


def test_a_picture_is_an_image_with_words_and_a_size(comparison, take_apart):
    findings = Findings(gallery=Gallery((PLAIN,)))
    found = take_apart(page(comparison, {}, findings))
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
        take_apart(page(comparison, {}, Findings(gallery=gallery)))
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
    text = page(comparison, {}, Findings(gallery=gallery))
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
    section = pictures_section(findings, 2000)
    assert [one.picture.name for one in section.images] == ["power"]
    assert section.not_shown == ("Other: no.", "Large: large.svg is too large for this page.")
    assert section.print_only == ("front.svg",)
    assert pictures_section(Findings(), 2000) is None


@pytest.mark.parametrize("folder", ["figures", "damping.figures"])
def test_the_folder_is_named_also_where_the_page_shows_no_picture(comparison, take_apart, folder):
    printed = replace(PLAIN, name="front", print_only=True)
    found = take_apart(page(comparison, {}, Findings(None, Gallery((printed,)), folder=folder)))
    assert not found.all("img")
    assert (
        f"The folder {folder} of this run has the pictures"
        in found.one("section", id="pictures").text
    )
    assert "among them front.svg for what" in found.one("section", id="pictures").text


def test_why_there_are_no_grades_stands_where_they_would(comparison, take_apart):
    findings = Findings(gallery=Gallery((PLAIN,)), not_graded=f"Not known: {HOSTILE}")
    section = take_apart(page(comparison, {}, findings)).one("section", id="pictures")
    assert f"Not known: {HOSTILE}" in section.text
    assert section.text.index("Not known") < section.text.index("Takes power.")
    assert "Not shown" not in section.text
    bare = take_apart(page(comparison, {}, Findings(not_graded="Not known.")))
    assert "Not known." in bare.one("section", id="pictures").text


def test_grades_stand_as_a_table(comparison, take_apart):
    found = take_apart(page(comparison, {}, Findings(graded("ddwwnn", excited=False))))
    section = found.one("section", id="pictures")
    assert "Coefficients of linear by how well they are known" in section.text
    assert "The folder" not in section.text
    section = pictures_section(Findings(graded("ddwwnn", excited=False)), 0)
    assert section.grades[0] == ("X", "6 of 6", "90 %", "yes", "2", "2", "2")
    assert section.grades[3] == ("K", "6 of 6", "10 %", "no", "2", "2", "2")
    assert not found.all("img")


@pytest.mark.parametrize(
    ("grades", "excited", "sentence"),
    [
        ("dddddd", True, "The log determined all 36 coefficients of this model"),
        (
            "dddddw",
            True,
            "The log determined 30 of its 36 coefficients; 6 are weak, to be used with the "
            "whole model only (X_r, Y_r, Z_r, K_r, M_r, N_r)",
        ),
        (
            "nnnnnn",
            False,
            "The log determined none of its 36 coefficients; 36 are not determined (X 6, Y 6, "
            "Z 6, K 6, M 6, N 6); axes whose response is not predicted, for want of "
            "motion or of the right terms (share): K 10 %",
        ),
    ],
)
def test_the_third_sentence_rests_on_the_grades(comparison, grades, excited, sentence):
    """The covariance is diag(1 ... 36) and the coefficients -1 ... -36: three intervals hold 0."""
    found = graded(grades, excited=excited)
    ending = "; by ls, the 95 % intervals of 3 coefficients hold zero."
    assert summary(comparison, found)[2] == f"{sentence}{ending}"
    assert not summary(comparison)[2].startswith(sentence)


@pytest.mark.parametrize(
    ("model", "method", "ending"),
    [
        ("linear", "ai", "of this model; by ai, the estimate has not settled."),
        ("uncoupled", "ls", "of this model; by ls, 3 coefficients cannot be told apart."),
    ],
)
def test_the_fit_has_its_say_after_the_grades(comparison, model, method, ending):
    row = comparison.row(model, method)
    fit = replace(row.fit, damping=replace(row.fit.damping, covariance=None))
    alone = hd.Comparison((replace(row, fit=fit),))
    assert summary(alone, graded("dddddd"))[2].endswith(ending)


def test_a_fit_with_nothing_to_add_adds_nothing(comparison):
    fit = comparison.row("linear", "ls").fit
    sure = replace(fit.damping, covariance=1e-6 * np.eye(36))
    alone = hd.Comparison((replace(comparison.rows[0], fit=replace(fit, damping=sure)),))
    assert summary(alone, graded("dddddd"))[2].endswith("all 36 coefficients of this model.")


def test_while_rows_are_missing_the_verdict_is_one_so_far(comparison):
    assert summary(comparison)[0].startswith("Take linear by ls")
    assert summary(unfinished(comparison, 9))[0].startswith("So far, take linear by ls")
    lost = unfinished(hd.Comparison(comparison.rows[1:2]), 9)
    assert summary(lost)[0].startswith("No model can be recommended so far: none of 1 fits")


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
    text = page(table, {}, Findings(gallery=Gallery(many)))
    assert len(text.encode()) < 5_000_000
    assert text.count("data:image/svg+xml") >= 4
    assert "too large for this page" in text
