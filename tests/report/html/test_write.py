from __future__ import annotations

import pytest

from hydrodamp.errors import FileError
from hydrodamp.report.files import read_comparison, write_comparison
from hydrodamp.report.html.write import REPORT, write_report


def test_a_report_is_made_again_from_the_folder(comparison, tmp_path):
    write_comparison(comparison, tmp_path)
    path = write_report(tmp_path, tmp_path / REPORT)
    assert path == tmp_path / "report.html"
    again = write_report(read_comparison(tmp_path), tmp_path / "again.html")
    assert path.read_bytes() == again.read_bytes()
    assert [each.name for each in tmp_path.glob(".hydrodamp-*")] == []


def test_what_the_run_wrote_of_itself_stays(comparison, tmp_path):
    write_comparison(comparison, tmp_path)
    path = tmp_path / "comparison.json"
    path.write_text(path.read_text("utf-8").replace('"hydrodamp": "', '"hydrodamp": "9.'), "utf-8")
    assert "<dd>9." in write_report(tmp_path, tmp_path / REPORT).read_text("utf-8")


def test_a_folder_of_something_else_is_refused(tmp_path):
    with pytest.raises(FileError, match="cannot be read"):
        write_report(tmp_path, tmp_path / REPORT)
    assert not list(tmp_path.iterdir())
