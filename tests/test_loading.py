from __future__ import annotations

from pathlib import Path

import pytest

from hydrodamp.errors import FileError
from hydrodamp.loading import absent, load_json, load_text, load_yaml, neighbour, parse_yaml


def test_text_comes_without_its_byte_order_mark(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes(b"\xef\xbb\xbf\xce\xbd\n")
    assert load_text(tmp_path / "a.txt") == "ν\n"


def test_what_cannot_be_read_is_named(tmp_path: Path) -> None:
    (tmp_path / "latin.txt").write_bytes(b"caf\xe9")
    for load in (load_text, load_yaml, load_json):
        with pytest.raises(FileError, match=r"none\.txt: cannot be read: No such file"):
            load(tmp_path / "none.txt")
        with pytest.raises(FileError, match="cannot be read: "):
            load(tmp_path)
        with pytest.raises(FileError, match=r"latin\.txt: must be UTF-8 text; near byte 3"):
            load(tmp_path / "latin.txt")


@pytest.mark.parametrize(
    ("wanted", "near"),
    [
        ("missoin.csv", "mission.csv"),
        ("MISSION.CSV", "mission.csv"),
        ("mission.cvs", "mission.csv"),
        ("auw.yml", "auv.yaml"),
        ("auv", "auv.yaml"),
        ("rnus/day1.csv", "runs/day1.csv"),
        ("rnus/day2.csv", "runs/day1.csv"),
        ("a.csv", None),
        ("none.csv", None),
        ("mission.yaml", None),
        ("elsewhere/mission.csv", None),
        ("mission.csv/a.csv", None),
    ],
)
def test_the_nearest_neighbour_of_what_is_not_there(
    tmp_path: Path, wanted: str, near: str | None
) -> None:
    (tmp_path / "runs").mkdir()
    for name in ("mission.csv", "auv.yaml", "b.csv", "runs/day1.csv"):
        (tmp_path / name).touch()
    assert neighbour(tmp_path / wanted) == (None if near is None else tmp_path / near)
    assert absent(tmp_path / wanted).endswith(
        "No such file or directory." if near is None else f"Did you mean '{tmp_path / near}'?"
    )


def test_yaml_and_json_of_a_file(tmp_path: Path) -> None:
    for name, load in (("a.yaml", load_yaml), ("a.json", load_json)):
        (tmp_path / name).write_text('{"a": [1, 2.5, null, true, "ν"]}', "utf-8")
        assert load(tmp_path / name) == {"a": [1, 2.5, None, True, "ν"]}


@pytest.mark.parametrize(
    ("text", "number"),
    # YAML 1.2.2, section 10.3.2, as Python's float reads them.
    [(text, float(text)) for text in ("1e-3", "2e5", "-2E5", ".5e3", "1.e3", "+1e+3", "1.5e-3")],
)
def test_powers_of_ten_are_numbers(text: str, number: float) -> None:
    value = parse_yaml(f"a: [{text}]", "mine")
    assert value == {"a": [number]}
    assert isinstance(value["a"][0], float)


@pytest.mark.parametrize("text", ["1e3x", "e3", "v1e3", "1e", "2022-05-01", "2024-13-45", "'1e3'"])
def test_what_is_no_number_stays_text(text: str) -> None:
    assert parse_yaml(text, "mine") == text.strip("'")


def test_an_empty_text_holds_nothing() -> None:
    assert parse_yaml("", "mine") is None


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("name: mine\nweight: [1, 2\nbuoyancy: 3\n", 3),
        ("name: mine\n  wrong: [1,\n", 2),
        ("a: 'x\n", 2),
        ("a: 1\nb: *c\n", 2),
        ("--- 1\n--- 2\n", 2),
        ("a: 1\n[b]: 2\n", 2),
        ("a: 1\n\nb: \x07\n", 3),
        ("\x00", 1),
        ("a: 1\nb: !!python/object:os.system {}\n", 2),
        ("a: 1\nb: !!bool maybe\n", 2),
        ("a: 1\nb: !!float ''\n", 2),
        ("a: 1\nb: !!timestamp noon\n", 2),
        ("a: 1\nb: 0b_\n", 2),
    ],
)
def test_unreadable_yaml_tells_its_line(tmp_path: Path, text: str, line: int) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(text, "utf-8")
    with pytest.raises(FileError, match=rf"mine\.yaml, line {line}: cannot be read as YAML: \S"):
        load_yaml(path)


@pytest.mark.parametrize(
    ("text", "line"),
    [("a: 1\nb: 2\na: 3\n", 3), ("x:\n  - a: 1\n    'a': 2\n", 3), ("1: a\n1: b\n", 2)],
)
def test_a_key_that_comes_twice_is_refused(text: str, line: int) -> None:
    with pytest.raises(FileError, match=rf"mine, line {line}: .*the key `.` stands in line . alre"):
        parse_yaml(text, "mine")


def test_the_same_key_in_different_mappings_is_none_that_comes_twice() -> None:
    text = "base: &base {a: 1, b: 2}\none: {<<: *base, a: 3}\ntwo: {<<: *base, b: {b: 4}}\n"
    assert parse_yaml(text, "mine") == {
        "base": {"a": 1, "b": 2},
        "one": {"a": 3, "b": 2},
        "two": {"a": 1, "b": {"b": 4}},
    }


def test_bad_json_tells_its_line(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text('{"format":\n !}', "utf-8")
    with pytest.raises(FileError, match=r"a\.json, line 2: cannot be read as JSON: .*column 2"):
        load_json(path)


def test_what_is_nested_too_deeply_is_refused(tmp_path: Path) -> None:
    (tmp_path / "deep").write_text("[" * 200_000, "utf-8")
    for load in (load_yaml, load_json):
        with pytest.raises(FileError, match="deep: cannot be read as"):
            load(tmp_path / "deep")


def test_a_drive_that_is_not_there_has_no_neighbour(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "is_dir", lambda _: False)
    assert neighbour(Path("/gone/log.csv")) is None


def test_neighbours_may_be_of_some_suffixes_only(tmp_path: Path) -> None:
    (tmp_path / "lauvv.csv").touch()
    assert neighbour(tmp_path / "lauvv") == tmp_path / "lauvv.csv"
    assert neighbour(tmp_path / "lauvv", (".yaml",)) is None
