"""What is drawn and said of a run, and what is not."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest

import hydrodamp as hd
from hydrodamp.identification.grades import Grade
from hydrodamp.report.correlated import correlated_pairs
from hydrodamp.report.gallery import examine as examining, of_the_adaptation as adapting
from hydrodamp.report.gallery.examine import examine
from hydrodamp.report.gallery.findings import chosen_row
from hydrodamp.report.gallery.of_the_fit import sketches_of_fit
from hydrodamp.report.gallery.of_the_replays import best_of_each_method
from hydrodamp.report.gallery.picture import Drawn, Picture, Sketch, painted

HOSTILE = "</script><script>alert('1')</script><img src=x onerror=\"alert(2)\">&amp;$x$-->]]>"
SVG = "{http://www.w3.org/2000/svg}"


def test_everything_is_drawn_with_its_words(examined):
    gallery = examined.findings.gallery
    names = [picture.name for picture in gallery.pictures]
    assert names == [
        *("excitation", "correlation", "residuals", "power", "horizons"),
        *("replays", "front", "coefficients"),
        *("estimation-velocities", "estimation-actuation", "history-ai"),
    ]
    assert gallery.not_drawn == ()
    for picture in gallery.pictures:
        assert ElementTree.fromstring(picture.svg).tag == f"{SVG}svg"
        assert all(50.0 < side < 900.0 for side in picture.size)
        for words in (picture.caption, picture.alt):
            assert words.endswith(".")
            assert "  " not in words
        assert picture.alt != picture.caption
    assert [one.name for one in gallery.pictures if one.print_only] == [
        *("replays", "coefficients")
    ]


def test_captions_say_what_is_in_the_numbers(examined):
    found = examined.findings.identifiability
    words = {one.name: f"{one.caption} {one.alt}" for one in examined.findings.gallery.pictures}
    row = examined.table.best()
    assert found.model.labels == row.fit.model.labels
    assert f"{examined.train.n} samples" in words["estimation-velocities"]
    assert "(depth-2600, yaw-1800, yaw-2133 and yaw-2600)" in words["estimation-velocities"]
    assert "rudder, elevator and rpm" in words["estimation-actuation"]
    for one in found.axes:
        assert (
            f"{one.axis} {100 * one.share:.0f} %, {one.count(Grade.DETERMINED)} deter"
            in (words["excitation"])
        )
    quiet = [one.axis for one in found.axes if not one.excited]
    assert ("predicted on every axis" in words["excitation"]) == (not quiet)
    problem = hd.prepare(examined.vehicle, examined.train, row.fit.model)
    worst = hd.worst_power(row.fit.damping, hd.operating_box(problem)).power
    assert f"the greatest power found is {worst:.3g} W" in words["power"]
    assert ("Somewhere in the box" in words["power"]) == (worst > 0.0)
    scores = hd.horizon_scores(
        examined.vehicle, row.fit.damping, row.trajectory.log, ["step"], rate_unit="deg"
    )
    assert (
        f"{row.model} by {row.method}: one step {scores['step'].score.rms:.3f}"
        in (words["horizons"])
    )
    assert "one pass" in words["history-ai"]
    name = f"{row.model} by {row.method}"
    assert f"Shaded, of {name}: where 95 % of the replays" in words["replays"]
    pairs = correlated_pairs(row.fit.damping.covariance)
    labels = row.fit.model.labels
    most = f"{labels[pairs[0].first]} with {labels[pairs[0].second]} ({pairs[0].correlation:+.2f})"
    assert words["correlation"].count(f"the most correlated are {most}, ") == 2


def test_without_a_score_the_data_alone_are_drawn(examined):
    lost = tuple(
        replace(row, score=replace(row.score, rms=None)) for row in examined.table.rows[:2]
    )
    table = replace(examined.table, rows=lost)
    found = examine(table, examined.vehicle, examined.train)
    assert found.identifiability is None
    assert [one.name for one in found.gallery.pictures] == [
        *("estimation-velocities", "estimation-actuation")
    ]
    assert chosen_row(table) is None
    alone = replace(table, rows=lost[:1])
    assert chosen_row(alone) is lost[0]


def test_without_matplotlib_there_are_grades_alone(examined, monkeypatch):
    monkeypatch.setattr(examining, "find_spec", lambda _: None)
    found = examine(examined.table, examined.vehicle, examined.train)
    assert found.gallery.pictures == ()
    assert 'pip install "hydrodamp[report]"' in found.gallery.not_drawn[0]
    assert found.identifiability.grades == examined.findings.identifiability.grades


def test_a_log_too_short_to_grade_is_no_fault(examined):
    short = examined.train.between(0.0, 0.5)
    found = examine(examined.table, examined.vehicle, short)
    assert found.identifiability is None
    assert found.not_graded.startswith("What the log determines is not known: ")
    assert not any("determines" in one for one in found.gallery.not_drawn)
    assert "estimation-velocities" in [one.name for one in found.gallery.pictures]


def test_what_cannot_be_drawn_says_why(examined):
    fit = examined.table.best().fit
    bare = replace(fit, damping=replace(fit.damping, covariance=None))
    problem = hd.prepare(examined.vehicle, examined.train, fit.model)
    first = next(iter(sketches_of_fit(problem, bare, None, "deg")))
    (said,) = painted([first]).not_drawn
    assert said.startswith("Correlation of coefficients: '")
    assert said.endswith("use a method that gives one.")


@pytest.mark.parametrize(
    ("work", "settings", "words"),
    [
        (1.0, None, "takes too long here; draw it with `hd.history_figure(hd.find_method('ai')"),
        (1e9, "AdaptiveIdentifier(a=1.0)", "other settings than 'ai'"),
    ],
)
def test_a_history_that_is_not_to_hand_says_why(examined, monkeypatch, work, settings, words):
    monkeypatch.setattr(adapting, "_WORK", work)
    rows = [row for row in examined.table.rows if row.method == "ai"]
    if settings is not None:
        rows = [
            replace(row, fit=replace(row.fit, provenance={"settings": settings})) for row in rows
        ]
    table = replace(examined.table, rows=tuple(rows))
    (sketch,) = adapting.sketches_of_adaptation(table, examined.vehicle, examined.train, None)
    assert sketch.name == "history-ai"
    gallery = painted([sketch])
    assert gallery.pictures == ()
    assert words in gallery.not_drawn[0]


def test_methods_that_keep_no_history_have_none(examined):
    rows = tuple(row for row in examined.table.rows if row.method == "weak")
    table = replace(examined.table, rows=rows)
    assert not list(
        adapting.sketches_of_adaptation(table, examined.vehicle, examined.train, rows[0])
    )


def test_each_method_is_there_once_the_chosen_first(examined):
    chosen = examined.table.rows[1]
    rows = best_of_each_method(examined.table, chosen)
    assert rows[0] is chosen
    assert [row.method for row in rows] == ["weak", "ai"]
    scored = [row.rms for row in examined.table.rows if row.method == "ai" and row.rms is not None]
    assert rows[1].rms == min(scored)


def test_progress_is_told_for_every_sketch(examined):
    def refuse() -> Drawn:
        raise hd.MethodError("no")

    told: list[tuple[str, int, int]] = []
    gallery = painted(
        [Sketch("a", "A", refuse), Sketch("b", "B", refuse)], lambda *words: told.append(words)
    )
    assert told == [("A", 0, 2), ("B", 1, 2), ("", 2, 2)]
    assert gallery.not_drawn == ("A: no.", "B: no.")


def test_names_from_files_stay_text_in_words_and_drawings(examined):
    log = examined.train
    named = (
        replace(log.segments[0], name=HOSTILE),
        *(replace(one, name=f"{HOSTILE}{k}") for k, one in enumerate(log.segments[1:])),
    )
    train = replace(log, segments=named, source=HOSTILE)
    row = examined.table.rows[0]
    damping = replace(row.fit.damping, model=replace(row.fit.model, title=HOSTILE))
    fit = replace(row.fit, damping=damping, method=HOSTILE)
    rows = [replace(row, fit=fit)]
    gallery = examine(replace(examined.table, rows=tuple(rows)), examined.vehicle, train).gallery
    assert len(gallery.pictures) > 7
    assert any(HOSTILE in one.alt for one in gallery.pictures)
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


def test_a_drawing_without_a_size_is_refused():
    with pytest.raises(hd.FileError, match=r"a\.svg: must begin as an SVG"):
        _ = Picture("a", "A", "", "", b"<svg>").size
    assert Picture("a", "A", "", "", b'<svg width="72pt" x="1" height="36.5pt">').size == (72, 36.5)
