"""Results replace only what hydrodamp wrote and nobody changed since, all of them or none."""

import errno
import json
import os
import shutil
import signal
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from hydrodamp.errors import FileError
from hydrodamp.files import protected_inputs
from hydrodamp.results import (
    MANIFEST,
    check_new_file,
    check_results,
    complete_exchange,
    complete_inputs,
    save_result,
    save_results,
)

NAMES = ("table.csv", "fits/*.json")
CHANGES = {"new.csv": b"3", "table.csv": b"2", "more/d.json": b"d"}
MINE = {"fits/mine.json": b"mine", "notes.md": b"notes"}

# JAX, if a test before has imported it, warns of forks; those here write files and end.
pytestmark = pytest.mark.filterwarnings(r"ignore:os\.fork\(\) was called:RuntimeWarning")


def contents(home: Path, **texts: bytes) -> dict[Path, bytes]:
    return {home / name.replace("__", "/").replace("_", "."): it for name, it in texts.items()}


def files_of(home: Path) -> dict[str, bytes]:
    """Return the files of a folder without the manifest."""
    paths = (path for path in home.rglob("*") if path.is_file() and path.name != MANIFEST)
    return {path.relative_to(home).as_posix(): path.read_bytes() for path in paths}


def remains(home: Path) -> list[Path]:
    """Return what an exchange leaves beside its files."""
    return [path for path in home.rglob(".hydrodamp*") if path.name != MANIFEST]


def change(home: Path) -> None:
    """Replace, add and remove results."""
    save_results({home / name: content for name, content in CHANGES.items()}, home, NAMES)


@pytest.fixture
def home(tmp_path):
    """A folder with results, and files of a user's beside them."""
    home = tmp_path / "out"
    save_results(contents(home, table_csv=b"1", fits__a_json=b"a", fits__b_json=b"b"), home)
    (home / "fits" / "mine.json").write_text("mine", "utf-8")
    (home / "notes.md").write_text("notes", "utf-8")
    return home


def test_a_file_that_exists_needs_force(tmp_path):
    path = tmp_path / "a.json"
    check_new_file(path, force=False)
    path.write_text("mine", "utf-8")
    with pytest.raises(FileError, match=r"a\.json: exists already\..*`--force`"):
        check_new_file(path, force=False)
    check_new_file(path, force=True)


def test_results_need_force_and_files_beside_them_do_not(home):
    check_results(home.with_name("new"), NAMES, force=False)
    check_results(home, ("other.csv", "other/*"), force=False)
    for names, example in ((NAMES, r"table\.csv"), (NAMES[1:], r"fits.a\.json")):
        with pytest.raises(FileError, match=rf"out: holds results already, such as {example}"):
            check_results(home, names, force=False)
    check_results(home, NAMES, force=True)


def test_force_replaces_nothing_of_a_users(home):
    (home / "fits" / "a.json").write_text("corrected", "utf-8")
    with pytest.raises(FileError, match=r"a\.json: was changed since hydrodamp wrote it"):
        check_results(home, NAMES, force=True)
    (home / "report.html").write_text("mine", "utf-8")
    with pytest.raises(FileError, match=r"report\.html: is not hydrodamp's"):
        check_results(home, ("report.html",), force=True)
    with pytest.raises(FileError, match=r"mine\.json: is not hydrodamp's"):
        save_results(contents(home, table_csv=b"2", fits__mine_json=b"c"), home)
    assert (home / "table.csv").read_bytes() == b"1"  # all or none


def test_inputs_are_no_results(home):
    link = home.with_name("link.csv")
    os.link(home / "table.csv", link)
    with protected_inputs([link]):
        with pytest.raises(FileError, match=r"table\.csv: is one of the inputs .*link\.csv"):
            check_results(home, NAMES, force=True)
        with pytest.raises(FileError, match=r"table\.csv: is one of the inputs"):
            save_results(contents(home, table_csv=b"2"), home)
    assert link.read_bytes() == (home / "table.csv").read_bytes() == b"1"
    check_results(home, NAMES, force=True)


def test_obsolete_files_are_removed_unless_changed(home):
    (home / "fits" / "b.json").write_text("corrected", "utf-8")
    save_results(contents(home, table_csv=b"2"), home, NAMES)
    assert files_of(home) == {"table.csv": b"2", "fits/b.json": b"corrected", **MINE}


def test_an_emptied_folder_goes_with_its_results_and_the_manifest(tmp_path):
    save_results(contents(tmp_path, bag__a_db3=b"1"), tmp_path)
    save_results({}, tmp_path, ("bag/*",))
    assert not [*tmp_path.iterdir()]


def test_files_beside_a_folder_are_replaced_with_it(home):
    named, page = home.with_name("damping.json"), home.with_name("page.html")
    named.write_text("anything", "utf-8")
    save_results(contents(home, table_csv=b"2"), home, NAMES, {named: b"new", page: b"page"})
    assert (named.read_bytes(), page.read_bytes()) == (b"new", b"page")
    assert (home / "table.csv").read_bytes() == b"2"
    assert not (home / "fits" / "a.json").exists()
    save_results({}, home, NAMES, {named: b"newer"})
    assert {path.name for path in home.parent.iterdir()} == {"damping.json", "out", "page.html"}
    assert files_of(home) == MINE


def at_call(patch, number, act, operations="mkdir fsync rename replace unlink rmdir"):
    """Act before the n-th operation on files; return the list of operations."""
    calls = []

    def patched(operation, function):
        def run(*given, **more):
            calls.append(operation)
            if len(calls) == number:
                act()
            return function(*given, **more)

        return run

    for name in operations.split():
        patch.setattr(os, name, patched(name, getattr(os, name)))
    return calls


def n_operations(home):
    with pytest.MonkeyPatch.context() as patch:
        calls = at_call(patch, 0, None)
        change(home)
    return len(calls)


def interrupt(folder, number):
    with pytest.MonkeyPatch.context() as patch, suppress(KeyboardInterrupt):
        at_call(patch, number, lambda: signal.raise_signal(signal.SIGINT))
        change(folder)


def kill(folder, number):
    if not (child := os.fork()):
        at_call(pytest.MonkeyPatch(), number, lambda: os.kill(os.getpid(), signal.SIGKILL))
        change(folder)
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL


@pytest.mark.skipif(sys.platform == "win32", reason="fork")
@pytest.mark.parametrize("end", [interrupt, pytest.param(kill, marks=pytest.mark.slow)])
def test_a_process_that_ends_at_any_operation_leaves_the_old_or_the_new_files(home, tmp_path, end):
    old, copy = files_of(home), tmp_path / "copy"
    shutil.copytree(home, copy)
    n, new = n_operations(copy), files_of(copy)
    assert new == {**CHANGES, **MINE}
    assert n > 20
    outcomes = []
    for number in range(1, n + 1):
        folder = tmp_path / str(number)
        shutil.copytree(home, folder)
        end(folder, number)
        complete_exchange(folder)
        assert files_of(folder) in (old, new)
        assert not remains(folder)
        outcomes.append(files_of(folder) == new)
        check_results(folder, (*NAMES, "new.csv"), force=True)
        change(folder)  # a killed process hinders no later one
        assert files_of(folder) == new
        listed = json.loads((folder / MANIFEST).read_text("utf-8"))["files"]
        assert {*listed} == {*CHANGES}
    assert outcomes == sorted(outcomes)  # one commit point
    assert {*outcomes} == {False, True}


@pytest.mark.parametrize("number", range(1, 5))
def test_a_full_disk_is_named_and_leaves_the_old_files(home, number):
    def fail():
        raise OSError(errno.ENOSPC, "No space left on device")

    for folder in (home, home.with_name("created")):
        old = files_of(folder)
        with pytest.MonkeyPatch.context() as patch:
            at_call(patch, number, fail, "fsync rename")
            with pytest.raises(FileError, match=r"cannot be written: No space.*Free disk"):
                change(folder)
        assert files_of(folder) == old
        assert not remains(folder)
    assert not home.with_name("created").exists()


def test_a_file_that_was_changed_after_an_abort_is_kept(home):
    commit_without_exchange(home)
    (home / "table.csv").write_text("mine", "utf-8")
    with pytest.raises(FileError, match=r"table\.csv: was changed while .* Move it elsewhere"):
        check_results(home, NAMES, force=True)
    (home / "table.csv").rename(home / "mine.csv")
    check_results(home, NAMES, force=True)
    assert (home / "table.csv").read_bytes() == b"2"
    assert (home / "mine.csv").read_bytes() == b"mine"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="fork")
def test_processes_that_write_into_a_folder_list_all_files(tmp_path):
    children = []
    for number in range(6):
        if child := os.fork():
            children.append(child)
            continue
        status = 1
        try:
            for k in range(15):
                save_results({tmp_path / f"{number}.json": f"{k}".encode()}, tmp_path)
            status = 0
        finally:
            os._exit(status)
    assert [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children] == [0] * 6
    names = [f"{number}.json" for number in range(6)]
    assert sorted(json.loads((tmp_path / MANIFEST).read_text("utf-8"))["files"]) == names
    assert sorted(path.name for path in tmp_path.iterdir()) == [MANIFEST, *names]
    check_results(tmp_path, names, force=True)


def test_a_file_that_the_user_named_is_listed_in_a_folder_of_results(home):
    save_result("page", home / "page.html")
    check_results(home, ("page.html",), force=True)
    save_result("page", home.with_name("page.html"))
    assert not (home.parent / MANIFEST).exists()


@pytest.mark.parametrize(
    "text",
    ["[]", "{", "{}"]
    + [rf'{{"files": {{"{name}": "1"}}}}' for name in ("../a", r"..\\..\\a", "C:a", "/a")],
)
def test_a_manifest_that_is_none_is_named(home, text):
    (home / MANIFEST).write_text(text, "utf-8")
    with pytest.raises(FileError, match=r"\.hydrodamp\.json"):
        check_results(home, NAMES, force=True)


@pytest.mark.parametrize("text", ["[]", "{}", '{"new": {}, "obsolete": {"../a": "1"}}'])
def test_a_journal_that_is_none_is_named(home, text):
    (home / ".hydrodamp-commit").mkdir()
    (home / ".hydrodamp-commit" / "journal.json").write_text(text, "utf-8")
    with pytest.raises(FileError, match=r"journal\.json: is not a journal"):
        check_results(home, NAMES, force=True)


def write_in_another_process(save):
    if not (child := os.fork()):
        save()
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0


@pytest.mark.skipif(sys.platform == "win32", reason="fork")
def test_results_of_another_process_are_not_replaced_without_force(tmp_path):
    home = tmp_path / "out"
    check_results(home, NAMES, force=False)
    write_in_another_process(lambda: save_results(contents(home, fits__a_json=b"theirs"), home))
    with pytest.raises(FileError, match=r"a\.json: was written by another program while"):
        save_results(contents(home, table_csv=b"1"), home, NAMES)
    assert files_of(home) == {"fits/a.json": b"theirs"}
    check_results(home, NAMES, force=True)
    change(home)


@pytest.mark.skipif(sys.platform == "win32", reason="fork")
def test_a_process_that_wrote_first_keeps_its_folder(tmp_path):
    check_results(tmp_path, NAMES, force=False)
    change(tmp_path)

    def save_other():
        with pytest.raises(FileError, match=r"holds results already"):
            check_results(tmp_path, NAMES, force=False)

    write_in_another_process(save_other)
    change(tmp_path)  # its own results


@pytest.mark.parametrize("name", ["damping.json", "a [1].json"])
def test_a_named_file_that_appeared_is_not_replaced_without_force(tmp_path, name):
    path, home = tmp_path / name, tmp_path / "figures"
    for save in (
        lambda: save_results(contents(home, table_csv=b"1"), home, (), {path: b"new"}),
        lambda: save_result("new", path),
    ):
        path.unlink(missing_ok=True)
        check_new_file(path, force=False)
        path.write_text("theirs", "utf-8")
        with pytest.raises(FileError, match=r"json: was written by another program"):
            save()
        assert path.read_text("utf-8") == "theirs"
        check_new_file(path, force=True)
        save()
        assert path.read_text("utf-8") == "new"


def test_a_file_beside_a_folder_is_listed_in_a_folder_of_results(home):
    figures = home / "table.figures"
    save_results(contents(figures, a_svg=b"1"), figures, (), {home / "table.csv": b"new"})
    check_results(home, NAMES, force=True)


def commit_without_exchange(home):
    """Leave a committed exchange, as a process that is killed after the commit point."""

    def fail(_, target):
        raise OSError(errno.EIO, "Input/output error")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "replace", fail)
        with pytest.raises(FileError, match=r"Input/output error.*\.hydrodamp-commit wait to be"):
            change(home)
    assert (home / ".hydrodamp-commit").is_dir()


def link_out(home, monkeypatch):
    (home.parent / "elsewhere").mkdir()
    (home / "more").symlink_to(home.parent / "elsewhere")
    return r"more.d\.json: is outside of"


def lock_up(home, monkeypatch, access=os.access):
    (home / "more").mkdir()
    monkeypatch.setattr(os, "access", lambda path, mode: path.name != "more" and access(path, mode))
    return r"more is not writable"


def mount(home, monkeypatch, stat=Path.stat):
    def stat_of_mount(path, **how):
        result = [*stat(path, **how)]
        result[2] += path.name == "more"
        return os.stat_result(result)

    (home / "more").mkdir()
    monkeypatch.setattr(Path, "stat", stat_of_mount)
    return r"more.d\.json: is outside of"


def occupy(home, monkeypatch):
    (home / MANIFEST).unlink()
    (home / MANIFEST).mkdir()
    (home / "table.csv").unlink()
    return r"\.hydrodamp\.json: is a folder"


@pytest.mark.parametrize("hinder", [link_out, lock_up, mount, occupy])
def test_what_hinders_an_exchange_is_refused_before_its_commit_point(home, hinder, monkeypatch):
    words = hinder(home, monkeypatch)
    old = files_of(home)
    with pytest.raises(FileError, match=words):
        change(home)
    assert files_of(home) == old
    assert not (home / ".hydrodamp-commit").exists()
    complete_exchange(home)


def test_an_exchange_writes_nothing_through_a_link(home, monkeypatch):
    commit_without_exchange(home)
    (home / "more").rmdir()
    link_out(home, monkeypatch)
    with pytest.raises(FileError, match=r"d\.json: is outside of .*\.hydrodamp-commit wait to be"):
        complete_exchange(home)
    assert not [*(home.parent / "elsewhere").iterdir()]
    assert (home / "table.csv").read_bytes() == b"1"


def test_new_files_behind_a_link_are_not_taken(home):
    commit_without_exchange(home)
    new, mine = home / ".hydrodamp-commit" / "new", home.with_name("mine")
    new.rename(mine)
    new.symlink_to(mine)
    with pytest.raises(FileError, match=r"is outside of"):
        complete_exchange(home)
    assert (mine / "table.csv").read_bytes() == b"2"


def test_the_rest_of_an_earlier_abort_hinders_no_completion(home):
    commit_without_exchange(home)
    (home / ".hydrodamp-staging").mkdir()
    (home / ".hydrodamp-staging" / "part").write_text("part", "utf-8")
    complete_exchange(home)
    assert (home / "table.csv").read_bytes() == b"2"
    assert not remains(home)


def test_a_commit_that_lacks_files_is_refused(home):
    commit_without_exchange(home)
    (home / ".hydrodamp-commit" / "new" / "table.csv").unlink()
    with pytest.raises(FileError, match=r"table\.csv: its new content is lost"):
        complete_exchange(home)
    assert not (home / "new.csv").exists()


def test_an_input_below_a_folder_is_read_after_its_exchange(home):
    commit_without_exchange(home)
    complete_inputs([home / "fits" / "mine.json"])
    assert (home / ".hydrodamp-commit").exists()  # it replaces no input
    complete_inputs([home / "fits" / "a.json"])
    assert not (home / ".hydrodamp-commit").exists()
    assert files_of(home) == {**CHANGES, **MINE}


def test_a_folder_that_cannot_be_opened_is_named(home, monkeypatch):
    def fail(*_):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(os, "open", fail)
    with pytest.raises(FileError, match=r"out: cannot be written: Permission denied"):
        save_results({}, home)
