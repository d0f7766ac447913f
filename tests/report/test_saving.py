from __future__ import annotations

from pathlib import Path

import pytest

from hydrodamp.errors import FileError
from hydrodamp.report.saving import check_file, check_folder, save_bytes


def test_bytes_replace_a_file_and_leave_nothing_else(tmp_path: Path) -> None:
    for content in (b"one", b"two"):
        save_bytes(content, tmp_path / "a.bin")
        assert (tmp_path / "a.bin").read_bytes() == content
    assert [path.name for path in tmp_path.iterdir()] == ["a.bin"]


def test_a_failed_write_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(FileError, match="cannot be written"):
        save_bytes(b"one", tmp_path / "folder")
    with pytest.raises(FileError, match="cannot be written"):
        save_bytes(b"one", tmp_path / "none" / "a.bin")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]


def test_checking_a_folder_leaves_no_trace(tmp_path: Path) -> None:
    check_folder(tmp_path / "a" / "b")
    assert not [*tmp_path.iterdir()]
    (tmp_path / "kept").mkdir()
    check_folder(tmp_path / "kept")
    assert (tmp_path / "kept").is_dir()


def test_a_folder_below_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", "utf-8")
    for path in (tmp_path / "file", tmp_path / "file" / "deep"):
        with pytest.raises(FileError, match="Give another one"):
            check_folder(path)


def test_a_file_needs_its_folder(tmp_path: Path) -> None:
    check_file(tmp_path / "a.json")
    assert not [*tmp_path.iterdir()]
    with pytest.raises(FileError, match="is a folder"):
        check_file(tmp_path)
    with pytest.raises(FileError, match="there is no folder"):
        check_file(tmp_path / "none" / "a.json")
