from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from hydrodamp.errors import FileError
from hydrodamp.loading import load_json
from hydrodamp.saving import (
    check_file,
    check_folder,
    replacing,
    save_bytes,
    save_json,
    save_text,
    save_together,
)


@pytest.fixture
def narrow_umask() -> Iterator[None]:
    before = os.umask(0o027)
    yield
    os.umask(before)


def test_a_file_is_replaced_and_nothing_else_is_left(tmp_path: Path) -> None:
    for content in ("one", "two\r\nthree\n", "ν"):
        save_text(content, tmp_path / "a.txt")
        assert (tmp_path / "a.txt").read_bytes() == content.encode("utf-8")
    for raw in (b"one", b"\xff\r\n"):
        save_bytes(raw, str(tmp_path / "a.txt"))
        assert (tmp_path / "a.txt").read_bytes() == raw
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_a_name_as_long_as_a_name_can_be(tmp_path: Path) -> None:
    path = tmp_path / ("a" * 255)
    save_text("one", path)
    assert path.read_text("utf-8") == "one"


@pytest.mark.skipif(os.name != "posix", reason="other systems have no permission bits")
@pytest.mark.usefixtures("narrow_umask")
def test_permissions_are_those_of_any_new_file(tmp_path: Path) -> None:
    save_text("one", tmp_path / "a.txt")
    save_bytes(b"one", tmp_path / "b.bin")
    assert {path.stat().st_mode & 0o777 for path in tmp_path.iterdir()} == {0o640}


def test_a_failed_write_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    for path in ("folder", "none/a.txt", "file/a.txt"):
        with pytest.raises(FileError, match=f"{path}: cannot be written: .*a folder that exists"):
            save_text("one", tmp_path / path)
        with pytest.raises(FileError, match=f"{path}: cannot be written: .*a folder that exists"):
            save_bytes(b"one", tmp_path / path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder"]


@pytest.mark.parametrize(
    ("error", "seen", "words"),
    [
        (OSError(28, "No space left on device"), FileError, "cannot be written: No space left"),
        (KeyboardInterrupt("stop"), KeyboardInterrupt, "stop"),
        (ValueError("half way"), ValueError, "half way"),
    ],
)
def test_an_error_half_way_leaves_the_old_file(
    tmp_path: Path, error: BaseException, seen: type[BaseException], words: str
) -> None:
    save_text("old", tmp_path / "a.txt")

    def break_off() -> None:
        with replacing(tmp_path / "a.txt") as stream:
            stream.write("new")
            raise error

    with pytest.raises(seen, match=words):
        break_off()
    assert (tmp_path / "a.txt").read_text("utf-8") == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_the_new_file_appears_at_the_end(tmp_path: Path) -> None:
    save_text("old", tmp_path / "a.txt")
    with replacing(tmp_path / "a.txt") as stream:
        stream.write("new")
        stream.flush()
        assert (tmp_path / "a.txt").read_text("utf-8") == "old"
    assert (tmp_path / "a.txt").read_text("utf-8") == "new"


def test_json_is_strict(tmp_path: Path) -> None:
    save_json({"a": [1.5, None, "ν"]}, tmp_path / "a.json")
    assert load_json(tmp_path / "a.json") == {"a": [1.5, None, "ν"]}
    with pytest.raises(ValueError, match="not JSON compliant"):
        save_json({"a": float("nan")}, tmp_path / "a.json")
    assert load_json(tmp_path / "a.json") == {"a": [1.5, None, "ν"]}


def test_checking_a_folder_leaves_no_trace(tmp_path: Path) -> None:
    check_folder(tmp_path / "a" / "b")
    assert not [*tmp_path.iterdir()]
    (tmp_path / "kept").mkdir()
    check_folder(tmp_path / "kept")
    assert not [*(tmp_path / "kept").iterdir()]


def test_a_folder_below_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
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


def test_files_are_saved_together_and_others_removed(tmp_path: Path) -> None:
    (tmp_path / "old.txt").write_text("old", "utf-8")
    contents = {tmp_path / "a.txt": b"a", tmp_path / "deep" / "b.txt": b"b"}
    save_together(contents, [tmp_path / "old.txt"], last=tmp_path / "a.txt")
    assert {path: path.read_bytes() for path in tmp_path.rglob("*.txt")} == contents
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a.txt", "b.txt", "deep"]


def failing_at(patch: pytest.MonkeyPatch, name: str, at: int) -> None:
    """Let the n-th call of a method of paths fail, as where another program holds the file."""
    method, calls = getattr(Path, name), []

    def fail(path: Path, *given: object, **more: object) -> object:
        calls.append(path)
        if len(calls) == at:
            raise PermissionError(13, "Permission denied", str(path))
        return method(path, *given, **more)

    patch.setattr(Path, name, fail)


@pytest.mark.parametrize(
    ("name", "at", "said"),
    [
        ("write_bytes", 2, "new/b.txt"),
        ("rename", 1, "all.json"),  # what says that the others are there goes first
        ("rename", 2, "a.txt"),
        ("rename", 3, "old.txt"),
        ("replace", 1, "a.txt"),
        ("replace", 2, "new/b.txt"),
        ("replace", 3, "all.json"),
    ],
)
def test_a_failure_at_any_step_leaves_all_as_it_was_and_names_the_file(
    name: str, at: int, said: str, tmp_path: Path
) -> None:
    before = {tmp_path / each: each.encode() for each in ("a.txt", "all.json", "old.txt")}
    for path, content in before.items():
        path.write_bytes(content)
    contents = {tmp_path / each: b"after" for each in ("a.txt", "new/b.txt", "all.json")}
    with pytest.MonkeyPatch.context() as patch:
        failing_at(patch, name, at)
        with pytest.raises(FileError) as caught:
            save_together(contents, [tmp_path / "old.txt"], last=tmp_path / "all.json")
    assert str(caught.value).startswith(f"{tmp_path / said}: cannot be written: Permission denied")
    assert "close it in other programs" in str(caught.value)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*")} == before


def test_a_folder_in_the_place_of_a_file_is_refused_and_stays(tmp_path: Path) -> None:
    (tmp_path / "b.txt").mkdir()
    with pytest.raises(FileError, match=r"b\.txt: cannot be written"):
        save_together({tmp_path / "a.txt": b"a", tmp_path / "b.txt": b"b"})
    assert [path.name for path in tmp_path.rglob("*")] == ["b.txt"]


def test_cleaning_up_goes_on_where_one_file_cannot_be_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    contents = {tmp_path / each: b"after" for each in ("a.txt", "b.txt", "c.txt")}
    failing_at(monkeypatch, "replace", 1)
    failing_at(monkeypatch, "unlink", 1)
    with pytest.raises(FileError, match=r"a\.txt"):
        save_together(contents)
    assert len([*tmp_path.iterdir()]) == 1


def test_a_handler_that_is_not_of_python_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(signal, "getsignal", lambda _: None)
    monkeypatch.setattr(signal, "signal", lambda *_: pytest.fail("it cannot be put back"))
    save_together({tmp_path / "a.txt": b"a"})
    assert (tmp_path / "a.txt").read_bytes() == b"a"


@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError(28, "No space left on device")])
def test_what_interrupts_saving_together_leaves_all_as_it_was(
    error: BaseException, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.txt").write_text("before", "utf-8")
    write, calls = Path.write_bytes, []

    def failing(path: Path, content: bytes) -> int:
        calls.append(path)
        if len(calls) == 3:
            raise error
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", failing)
    contents = {tmp_path / name: b"after" for name in ("a.txt", "new/b.txt", "new/deep/c.txt")}
    with pytest.raises((KeyboardInterrupt, FileError)):
        save_together(contents, [tmp_path / "a.txt"], last=tmp_path / "a.txt")
    assert [path.name for path in tmp_path.rglob("*")] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text("utf-8") == "before"


def test_ctrl_c_waits_until_all_are_in_their_places(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace = Path.replace

    def interrupted(path: Path, target: Path) -> Path:
        signal.raise_signal(signal.SIGINT)
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", interrupted)
    contents = {tmp_path / "a.txt": b"a", tmp_path / "b.txt": b"b"}
    with pytest.raises(KeyboardInterrupt):
        save_together(contents)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == contents
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
