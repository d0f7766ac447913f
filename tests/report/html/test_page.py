import base64
import hashlib
import json
import re
from dataclasses import replace
from itertools import pairwise

import pytest

import hydrodamp as hd
from hydrodamp.data.log import Segment
from hydrodamp.report.files import ReportContent
from hydrodamp.report.page import comparison_page

from .conftest import make_band, make_comparison, make_log, take_apart

HOSTILE = "</script><script>alert('1')</script><img src=x onerror=\"alert(2)\">&amp;"


def made(comparison, **provenance):
    return comparison_page(replace(comparison, provenance={**comparison.provenance, **provenance}))


def test_nothing_is_asked_of_the_network(comparison):
    text = made(comparison)
    found = take_apart(text)
    for element in found.elements:
        for name in ("src", "href", "action", "data", "poster", "srcset"):
            target = element.attributes.get(name, "#")
            assert target.startswith(("#", "data:")), (element.name, target)
    for style in found.all("style"):
        assert "@import" not in style.text
        assert "url(" not in style.text
    scripts = [each for each in found.all("script") if "type" not in each.attributes]
    for word in ("fetch(", "XMLHttpRequest", "import(", "WebSocket", "sendBeacon", "eval("):
        assert not any(word in each.text for each in scripts)


def test_the_policy_names_every_script_by_its_digest(comparison):
    found = take_apart(made(comparison))
    (policy,) = (m.attributes["content"] for m in found.all("meta") if "http-equiv" in m.attributes)
    assert policy.startswith("default-src 'none'")
    scripts = [each for each in found.all("script") if "type" not in each.attributes]
    assert scripts
    for each in scripts:
        digest = base64.b64encode(hashlib.sha256(each.text.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in policy
    assert policy.count("sha256-") == len(scripts)


def hostile(comparison):
    rows = []
    for row in comparison.rows:
        fit = replace(
            row.fit,
            method=HOSTILE if row.method == "ai" else row.method,
            remarks=(HOSTILE, f"two\nlines {HOSTILE}"),
            provenance={"settings": HOSTILE},
            damping=replace(
                row.fit.damping,
                model=replace(row.fit.model, title=HOSTILE),
                vehicle=replace(row.fit.damping.vehicle, name=HOSTILE),
            ),
        )
        trajectory = row.trajectory
        if trajectory is not None:
            named = (Segment(HOSTILE, 0, 3), Segment("turn", 3, 5))
            trajectory = replace(trajectory, log=replace(trajectory.log, segments=named))
        diverged = tuple((HOSTILE, time) for _, time in row.score.diverged)
        score = replace(row.score, diverged=diverged)
        rows.append(replace(row, fit=fit, score=score, trajectory=trajectory))
    words = dict.fromkeys(
        ("vehicle", "train", "test", "test_segments", "command", HOSTILE), HOSTILE
    )
    return replace(comparison, rows=tuple(rows), provenance=words)


@pytest.mark.slow
def test_names_from_files_stay_text(comparison):
    plain = take_apart(made(comparison))
    text = made(hostile(comparison), files=f"0a  {HOSTILE}", warnings=HOSTILE)
    found = take_apart(text)
    assert "alert('1')</script>" not in text
    assert "<img" not in text
    assert len(found.all("script")) == len(plain.all("script"))
    assert not any(name.startswith("on") for e in found.elements for name in e.attributes)
    assert HOSTILE in found.one("h1").text
    data = json.loads(found.one("script", id="data").text)
    assert data["segments"][0]["name"] == HOSTILE
    assert any(HOSTILE in each["label"] for each in data["lines"])


def test_the_page_has_what_a_screen_reader_walks_by(comparison):
    found = take_apart(made(comparison))
    for landmark in ("header", "nav", "main", "footer", "h1"):
        assert found.one(landmark)
    assert found.one("html").attributes["lang"] == "en"
    tables, captions = found.all("table"), found.all("caption")
    assert len(tables) == len(captions) > 3
    assert all(caption.text.strip() for caption in captions)
    ids = [each.attributes["id"] for each in found.elements if "id" in each.attributes]
    assert len(ids) == len(set(ids))
    for each in found.elements:
        for label in each.attributes.get("aria-labelledby", "").split():
            assert label in ids
        target = each.attributes.get("href", "")
        assert target in ("", "data:,") or target[1:] in ids
    levels = [int(e.name[1]) for e in found.elements if re.fullmatch("h[1-6]", e.name)]
    assert levels[0] == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))


def test_rows_come_sorted_with_keys_to_sort_by(comparison):
    found = take_apart(made(comparison))
    place = next(k for k, e in enumerate(found.elements) if e.attributes.get("id") == "score-table")
    table = found.elements[place:]
    end = next(k for k, e in enumerate(table) if e.name == "tbody")
    heads = [e for e in table[:end] if e.name == "th"]
    names, width = [head.text for head in heads], len(heads)
    assert [head.attributes.get("aria-sort") for head in heads].count("ascending") == 1
    assert heads[names.index("error %")].attributes["aria-sort"] == "ascending"
    cells = [e for e in table if "data-key" in e.attributes][: width * len(comparison.rows)]
    rows = [cells[k : k + width] for k in range(0, len(cells), width)]
    assert len(rows) == len(comparison.rows)
    keys = [row[names.index("RMS")].attributes["data-key"] for row in rows]
    assert [float(key) for key in keys if key] == [0.46, 2.15, 14.02, 1234.5]
    assert keys[4:] == [""] * 3
    errors = [row[names.index("error %")].attributes["data-key"] for row in rows]
    assert [float(key) for key in errors if key] == sorted(float(key) for key in errors if key)
    told = [row[names.index("RMS")].text for row in rows[:4]]
    assert told == ["0.460", "2.150", "14.020", "1234"]
    buttons = [e for e in table[:end] if e.name == "button" and "th" in e.inside]
    assert len(buttons) == width


def test_lines_are_told_apart_by_samples_and_the_band_by_words():
    comparison = make_comparison(make_log(60.0, 10.0), ("linear", "fossen"), ("ls", "weak"))
    found = take_apart(comparison_page(comparison, ReportContent(band=make_band(comparison))))
    boxes = found.all("input", type="checkbox")
    assert [each.attributes.get("value") for each in boxes] == ["0", None, "1", "2", "3", "4", None]
    labels = [each.text.strip() for each in found.all("label")]
    assert labels[:2] == ["measured", "95 % band of linear by ls"]
    assert labels[2].startswith("linear by ls, ")
    lines = [e.attributes for e in found.all("path", d="M0 5H36") if "label" in e.inside]
    assert [bool(each.get("stroke-dasharray")) for each in lines[1:]] == [*(True, True, True, True)]
    band = found.one("input", id="band")
    told = found.one("p", id=band.attributes["aria-describedby"]).text
    assert told.startswith("Shaded: 95 % band of linear by ls")
    plain = take_apart(made(comparison))
    assert not plain.all("input", id="band")
    assert not plain.all("p", id="band-words")


def test_without_any_score_the_page_says_so(comparison):
    rows = tuple(row for row in comparison.rows if row.status is hd.Status.TOO_FEW_SAMPLES)
    found = take_apart(made(hd.Comparison(rows)))
    assert "No model can be recommended" in found.one("section", id="verdict").text
    assert not found.all("section", id="series")
    assert not found.all("script", id="data")
    assert not found.all("section", id="coefficients")
    assert take_apart(made(hd.Comparison(()))).one("h1").text == "Damping of a vehicle"


def test_warnings_files_and_words_of_the_run_are_told(comparison):
    words = {"overlap": "3 s", "options": "--train 0:20\n--test 20:30", "train_segments": "dive"}
    files, warnings = "00ff  a.csv\nbare", "the log was split\nno eta"
    found = take_apart(made(comparison, **words, files=files, warnings=warnings))
    verdict, origin = (found.one("section", id=name).text for name in ("verdict", "origin"))
    for word in ("the log was split", "no eta", "share 3 s", "Excluded: "):
        assert word in verdict
    for word in ("--train 0:20", "dive", "00ff", "bare"):
        assert word in origin
    headings = {each.text for each in found.all("dt")}
    assert {"options", "train segments", "overlap", "rate unit", "hydrodamp"} <= headings


def test_coefficients_that_models_share_are_drawn_on_scales_with_zero(comparison):
    found = take_apart(comparison_page(comparison))
    drawings = [e.attributes["aria-label"] for e in found.all("svg", role="img")]
    assert len(drawings) == 36 + 6  # all of linear, then its diagonal, which the others have too
    assert drawings[0] == "X_u, not determined: linear: -1.0 ± 2.0"
    assert drawings[36].startswith("X_u, not determined: linear: -1.0 ± 2.0; ")
    assert "uncoupled: -1" in drawings[36]
    summaries = [each.text for each in found.all("summary")]
    assert any(text.startswith("linear by ls") for text in summaries)
    assert not any(text.startswith("coe by ls") for text in summaries)


def test_a_report_is_made_again_with_what_the_run_wrote_of_itself(comparison, tmp_path):
    hd.write_comparison(comparison, tmp_path)
    first = hd.write_report(tmp_path, tmp_path / "report.html").read_bytes()
    again = hd.write_report(hd.read_comparison(tmp_path), tmp_path / "again.html")
    assert first == again.read_bytes()
    path = tmp_path / "comparison.json"
    path.write_text(path.read_text("utf-8").replace('"hydrodamp": "', '"hydrodamp": "9.'), "utf-8")
    assert "<dd>9." in hd.write_report(tmp_path, tmp_path / "report.html").read_text("utf-8")
