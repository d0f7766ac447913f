"""ReportContent and the report they make: written, read, made again."""

import json
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import FileError
from hydrodamp.report.files import ReportContent, picture_files, read_content, save_comparison
from hydrodamp.results import MANIFEST, save_result, save_results
from table_rows import rows


@pytest.fixture
def home(sailed, findings, tmp_path):
    """A folder of results with findings."""
    save_comparison(sailed.table, tmp_path, findings)
    return tmp_path


def test_findings_read_back_as_they_were(sailed, findings, home):
    table, before = hd.read_comparison(home), findings
    found = read_content(home, table)
    assert found.pictures == before.pictures
    assert found.identifiability == before.identifiability
    np.testing.assert_array_equal(found.band.lower, before.band.lower)
    np.testing.assert_array_equal(found.band.upper, before.band.upper)
    assert found.band.level == 0.95
    np.testing.assert_allclose(found.band.velocity, before.band.velocity, atol=1e-9)
    assert table.verdict() == sailed.table.verdict()


def test_stale_findings_go_and_pictures_of_others_stay(sailed, home):
    (home / "figures" / "mine.svg").write_text("<svg/>", "utf-8")
    save_result("old", home / "report.html")
    hd.write_comparison(sailed.table, home)
    assert [path.name for path in (home / "figures").iterdir()] == ["mine.svg"]
    for name in ("report.html", "identifiability.json", "band.npz"):
        assert not (home / name).exists()


def test_a_condition_without_bound_reads_back(sailed, findings, home):
    found = findings.identifiability
    first, *others = found.axes
    endless = replace(found, axes=(replace(first, condition=float("inf")), *others))
    save_comparison(sailed.table, home, ReportContent(endless))
    assert read_content(home, hd.read_comparison(home)).identifiability == endless


@rows(("path", "old", "new"))
def test_spoilt_files_are_refused(home, path, old, new, refused):
    text = (home / path).read_text("utf-8")
    assert old in text
    (home / path).write_text(text.replace(old, new), "utf-8")
    refused(FileError, read_content, home, hd.read_comparison(home))


def test_a_picture_that_was_deleted_is_left_out_with_a_sentence(home):
    (home / "figures" / "residuals.svg").unlink()
    found = read_content(home, hd.read_comparison(home))
    assert "residuals" not in [one.name for one in found.pictures]
    assert found.not_shown == ("residuals.svg was deleted.",)


@pytest.mark.parametrize("content", [b"", b"no zip"])
def test_a_damaged_band_is_refused(home, content, refused):
    (home / "band.npz").write_bytes(content)
    refused(FileError, read_content, home, hd.read_comparison(home))


def test_pictures_stand_alone_beside_a_damping_file(findings, tmp_path, refused):
    home = tmp_path / "damping.figures"
    save_results(picture_files(findings, home), tmp_path)
    listed = json.loads((tmp_path / MANIFEST).read_text("utf-8"))["files"]
    assert {*listed} == {f"{home.name}/{path.name}" for path in home.iterdir()}
    (tmp_path / "file").write_text("", "utf-8")
    refused(FileError, save_results, picture_files(ReportContent(), tmp_path / "file"), tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {MANIFEST, home.name, "file"}
