"""Results replace only what hydrodamp wrote and nobody changed since."""

from pathlib import Path

import pytest

import hydrodamp as hd
from hydrodamp.results import (
    MANIFEST,
    check_new_file,
    check_results,
    register_results,
    remove_results,
    save_result,
    save_results,
)

NAMES = ("table.csv", "fits/*.json")


def contents(home: Path, **texts: bytes) -> dict[Path, bytes]:
    return {home / name.replace("__", "/").replace("_", "."): it for name, it in texts.items()}


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
    with pytest.raises(hd.FileError, match=r"a\.json: exists already\..*`--force`"):
        check_new_file(path, force=False)
    check_new_file(path, force=True)


def test_results_need_force_and_files_beside_them_do_not(home):
    check_results(home.with_name("new"), NAMES, force=False)
    check_results(home, ("other.csv", "other/*"), force=False)
    with pytest.raises(hd.FileError, match=r"out: holds results already, such as table\.csv"):
        check_results(home, NAMES, force=False)
    with pytest.raises(hd.FileError, match=r"such as fits.a\.json"):
        check_results(home, NAMES[1:], force=False)
    check_results(home, NAMES, force=True)


def test_force_replaces_nothing_of_a_users(home):
    (home / "fits" / "a.json").write_text("corrected", "utf-8")
    with pytest.raises(hd.FileError, match=r"a\.json: was changed since hydrodamp wrote it"):
        check_results(home, NAMES, force=True)
    (home / "report.html").write_text("mine", "utf-8")
    with pytest.raises(hd.FileError, match=r"report\.html: is not hydrodamp's"):
        check_results(home, ("report.html",), force=True)
    with pytest.raises(hd.FileError, match=r"mine\.json: is not hydrodamp's"):
        save_results(contents(home, table_csv=b"2", fits__mine_json=b"c"), home)
    assert (home / "table.csv").read_bytes() == b"1"  # all or none


def test_old_results_are_removed_and_nothing_else(home):
    (home / "fits" / "b.json").write_text("corrected", "utf-8")
    remove_results(home, NAMES, keep=[home / "table.csv"])
    left = sorted(path.name for path in home.rglob("*") if path.is_file())
    assert left == [MANIFEST, "b.json", "mine.json", "notes.md", "table.csv"]
    save_results(contents(home, fits__a_json=b"a2"), home)
    remove_results(home, NAMES)
    assert not (home / "table.csv").exists()
    assert not (home / "fits" / "a.json").exists()


def test_an_emptied_folder_goes_with_its_results(tmp_path):
    save_results(contents(tmp_path, bag__a_db3=b"1"), tmp_path)
    remove_results(tmp_path, ("bag/*",))
    assert [path.name for path in tmp_path.iterdir()] == [MANIFEST]


def test_a_write_that_is_interrupted_leaves_the_old_results_replaceable(home, monkeypatch):
    def fail(_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("hydrodamp.results.save_all", fail)
        with pytest.raises(KeyboardInterrupt):
            save_results(contents(home, table_csv=b"2"), home)
    check_results(home, NAMES, force=True)
    save_results(contents(home, table_csv=b"3"), home)
    assert (home / "table.csv").read_bytes() == b"3"


def test_obsolete_files_are_removed_unless_changed(home):
    (home / "fits" / "b.json").write_text("corrected", "utf-8")
    obsolete = [home / "fits" / f"{name}.json" for name in ("a", "b", "mine")]
    save_results(contents(home, table_csv=b"2"), home, obsolete)
    assert sorted(path.name for path in (home / "fits").iterdir()) == ["b.json", "mine.json"]
    assert (home / "table.csv").read_bytes() == b"2"


def test_a_failed_move_restores_the_earlier_files(home, monkeypatch):
    rename = Path.rename

    def fail(path, target):
        if path.name == "new.csv":
            raise OSError(28, "No space left on device")
        return rename(path, target)

    before = {path: path.read_bytes() for path in home.rglob("*") if path.is_file()}
    monkeypatch.setattr(Path, "rename", fail)
    for content in (b"2", b"3", b"4"):
        with pytest.raises(hd.FileError, match="No space left"):
            save_results(contents(home, table_csv=content, new_csv=b"3"), home)
    after = {path: path.read_bytes() for path in home.rglob("*") if path.is_file()}
    assert {**after, home / MANIFEST: b""} == {**before, home / MANIFEST: b""}
    check_results(home, NAMES, force=True)


def test_files_written_by_other_means_are_listed(home):
    (home / "track.csv").write_text("1", "utf-8")
    register_results([home / "track.csv", home / "none.csv"], home)
    check_results(home, ("track.csv",), force=True)
    save_result("page", home / "page.html")
    check_results(home, ("page.html",), force=True)
    save_result("page", home.with_name("page.html"))
    assert not (home.parent / MANIFEST).exists()


@pytest.mark.parametrize("text", ["[]", "{", '{"files": {"../mine.json": 1}}'])
def test_a_manifest_that_is_none_is_named(home, text):
    (home / MANIFEST).write_text(text, "utf-8")
    with pytest.raises(hd.FileError, match=r"\.hydrodamp\.json"):
        check_results(home, NAMES, force=True)
