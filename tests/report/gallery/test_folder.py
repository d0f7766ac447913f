"""Findings and the report they make: written, read, made again."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.report.files import is_result
from hydrodamp.report.findings import (
    Findings,
    Gallery,
    earlier_findings,
    read_findings,
    write_findings,
    write_gallery,
)
from hydrodamp.report.words import verdict


@pytest.fixture
def home(examined, tmp_path) -> Path:
    """A folder of results with findings."""
    hd.write_comparison(examined.table, tmp_path)
    write_findings(examined.findings, tmp_path)
    return tmp_path


def test_findings_read_back_as_they_were(examined, home):
    table = hd.read_comparison(home)
    found = read_findings(home, table)
    assert found.gallery == examined.findings.gallery
    assert found.identifiability == examined.findings.identifiability
    band, before = found.band, examined.findings.band
    np.testing.assert_array_equal(band.lower, before.lower)
    np.testing.assert_array_equal(band.upper, before.upper)
    assert (band.level, band.diverged) == (0.95, before.diverged)
    np.testing.assert_allclose(band.velocity, before.velocity, atol=1e-9)
    assert verdict(table, found.identifiability) == verdict(
        examined.table, examined.findings.identifiability
    )


def test_the_report_made_again_is_the_same_file(examined, home):
    first = hd.write_report(examined.table, home / "first.html", examined.findings)
    again = hd.write_report(home, home / "again.html")
    assert first.read_bytes() == again.read_bytes()
    text = again.read_text("utf-8")
    shown = [one for one in examined.findings.gallery.pictures if not one.print_only]
    assert text.count("data:image/svg+xml;base64,") == len(shown)
    assert "The log determined " in text
    row = examined.table.best()
    assert f"95 % band of {row.model} by {row.method}" in text


def test_without_findings_a_folder_makes_a_report_as_before(examined, tmp_path):
    hd.write_comparison(examined.table, tmp_path)
    assert read_findings(tmp_path, examined.table) == Findings()
    text = hd.write_report(tmp_path, tmp_path / "report.html").read_text("utf-8")
    assert "<img" not in text
    assert "Pictures and grades" not in text


def test_stale_pictures_go_and_those_of_others_stay(examined, home):
    (home / "figures" / "mine.svg").write_text("<svg/>", "utf-8")
    (home / "report.html").write_text("old", "utf-8")
    fewer = Gallery(examined.findings.gallery.pictures[3:4], ("Power: no.",))
    write_findings(Findings(None, fewer), home)
    names = sorted(path.name for path in (home / "figures").iterdir())
    assert names == ["excitation.svg", "index.json", "mine.svg"]
    assert not (home / "identifiability.json").exists()
    assert not (home / "band.npz").exists()
    hd.write_comparison(examined.table, home)
    assert [path.name for path in (home / "figures").iterdir()] == ["mine.svg"]
    assert not (home / "report.html").exists()


def test_the_files_are_results_and_no_input_may_be_among_them(home):
    assert is_result(home / "identifiability.json", home)
    assert is_result(home / "figures" / "power.svg", home)
    assert not is_result(home / "figures" / "power.csv", home)


def test_the_grades_are_strict_json_in_words(home):
    document = json.loads((home / "identifiability.json").read_text("utf-8"), parse_constant=int)
    assert [one["axis"] for one in document["axes"]] == list("XYZKMN")
    words = {grade.partition(":")[0] for one in document["axes"] for grade in one["grades"]}
    assert words <= {"determined", "weak", "not determined"}


def test_a_variance_inflation_without_bound_reads_back(examined, home):
    found = examined.findings.identifiability
    first, *others = found.axes
    first = replace(first, inflation=(float("inf"), *first.inflation[1:]))
    endless = replace(found, axes=(first, *others))
    write_findings(Findings(endless), home)
    assert read_findings(home, hd.read_comparison(home)).identifiability == endless


@pytest.mark.parametrize(
    ("path", "old", "new", "words"),
    [
        ("figures/index.json", '"excitation"', '"../excitation"', "pictures.3.name: String should"),
        ("figures/index.json", '"caption"', '"other"', "pictures.0.caption: Field required"),
        ("identifiability.json", '"determined: the', '"sure: the', r"axes\.0\.grades"),
        ("identifiability.json", '"X_q^2"', '"X_qq"', "the comparison chooses"),
        ("identifiability.json", '"model": "', '"model": "not-', "the comparison chooses"),
    ],
)
def test_spoilt_files_are_refused(home, path, old, new, words):
    text = (home / path).read_text("utf-8")
    assert old in text
    (home / path).write_text(text.replace(old, new), "utf-8")
    with pytest.raises(hd.FileError, match=words):
        read_findings(home, hd.read_comparison(home))


@pytest.mark.parametrize("content", [None, b"<html>", b'<svg width="0pt" height="9pt">'])
def test_a_picture_that_was_spoilt_is_left_out_with_a_sentence(home, content):
    drawing = home / "figures" / "excitation.svg"
    drawing.unlink() if content is None else drawing.write_bytes(content)
    gallery = read_findings(home, hd.read_comparison(home)).gallery
    assert "excitation" not in [one.name for one in gallery.pictures]
    (said,) = gallery.not_drawn
    assert said.startswith("Excitation by axis: excitation.svg is not there or is no picture")
    assert said.endswith("Run the command again that wrote the folder.")


def test_a_band_of_something_else_is_refused(home):
    table, path = hd.read_comparison(home), home / "band.npz"
    with np.load(path) as arrays:
        found = dict(arrays)
    np.savez(path, **{**found, "lower": found["lower"][:-1]})
    with pytest.raises(hd.FileError, match="the band of another replay"):
        read_findings(home, table)
    for content in (b"", b"no zip", path.read_bytes()[:200]):
        path.write_bytes(content)
        with pytest.raises(hd.FileError, match=r"band\.npz: is no band of hydrodamp"):
            read_findings(home, table)


def test_why_there_are_no_grades_reads_back(examined, tmp_path):
    hd.write_comparison(examined.table, tmp_path)
    found = Findings(not_graded="What the log determines is not known: too short.")
    write_findings(found, tmp_path)
    assert read_findings(tmp_path, examined.table) == found
    write_findings(Findings(), tmp_path)
    assert not (tmp_path / "identifiability.json").exists()


def test_an_index_that_names_files_elsewhere_removes_none_of_them(home):
    (home / "precious.svg").write_text("<svg/>", "utf-8")
    index = home / "figures" / "index.json"
    index.write_text('{"pictures": [{"name": "../precious", "title": "", "caption": ""}]}', "utf-8")
    assert earlier_findings(home) == [home / "identifiability.json", home / "band.npz"]
    index.write_text("[]", "utf-8")
    assert earlier_findings(home) == [home / "identifiability.json", home / "band.npz"]


def test_a_gallery_stands_alone_beside_a_damping_file(examined, tmp_path):
    write_gallery(examined.findings.gallery, tmp_path / "damping.figures")
    write_gallery(replace(examined.findings.gallery, pictures=()), tmp_path / "damping.figures")
    assert [path.name for path in (tmp_path / "damping.figures").iterdir()] == ["index.json"]
    (tmp_path / "file").write_text("", "utf-8")
    with pytest.raises(hd.FileError, match="cannot be"):
        write_gallery(Gallery(), tmp_path / "file")
