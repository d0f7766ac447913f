"""Files are read with line numbers and written whole or not at all."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
import yaml

import hydrodamp as hd
from hydrodamp.errors import FileError
from hydrodamp.files import (
    KINDS,
    load_json,
    load_text,
    load_yaml,
    missing_file_message,
    nearest_file,
    open_atomic,
    parse_yaml,
    save_all,
    save_bytes,
    save_json,
    save_text,
    wrong_kind_message,
)
from hydrodamp.ingest.formats.files import read_files

TABLES = json.loads(Path(__file__).with_name("files.json").read_text("utf-8"))


def test_a_file_is_replaced_and_nothing_else_is_left(tmp_path):
    for content in ("one", "two\r\nthree\n", "ν"):
        save_text(content, tmp_path / "a.txt")
        assert (tmp_path / "a.txt").read_bytes() == content.encode("utf-8")
    for raw in (b"one", b"\xff\r\n"):
        save_bytes(raw, str(tmp_path / "a.txt"))
        assert (tmp_path / "a.txt").read_bytes() == raw
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_permissions_are_those_of_any_new_file(tmp_path):
    (tmp_path / "a.txt").touch()
    save_bytes(b"one", tmp_path / "b.bin")
    assert len({path.stat().st_mode for path in tmp_path.iterdir()}) == 1


def test_a_failed_write_leaves_nothing(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    for path in ("folder", "none/a.txt", "file/a.txt"):
        with pytest.raises(FileError, match=f"{path}: cannot be written"):
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
def test_an_error_half_way_leaves_the_old_file(tmp_path, error, seen, words):
    save_text("old", tmp_path / "a.txt")

    def break_off():
        with open_atomic(tmp_path / "a.txt") as stream:
            stream.write("new")
            raise error

    with pytest.raises(seen, match=words):
        break_off()
    assert (tmp_path / "a.txt").read_text("utf-8") == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_a_file_is_on_the_disk_before_it_takes_its_name(tmp_path, monkeypatch):
    seen: list[bool] = []
    monkeypatch.setattr(os, "fsync", lambda _: seen.append((tmp_path / "a.txt").exists()))
    save_text("one", tmp_path / "a.txt")
    save_bytes(b"one", tmp_path / "b.txt")
    assert seen == [False, True]


def test_several_files_are_written_in_their_order(tmp_path):
    (tmp_path / "b.txt").mkdir()
    contents = {tmp_path / "deep" / "a.txt": b"a", tmp_path / "b.txt": b"b", tmp_path / "c": b"c"}
    with pytest.raises(FileError, match=r"b\.txt: cannot be written"):
        save_all(contents)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a.txt", "b.txt", "deep"]
    with pytest.raises(FileError, match=r"a\.txt: the folder"):
        save_all({tmp_path / "deep" / "a.txt" / "d": b"d"})


def test_what_cannot_be_read_is_named(tmp_path):
    (tmp_path / "latin.txt").write_bytes(b"caf\xe9")
    for load in (load_text, load_yaml, load_json):
        with pytest.raises(FileError, match=r"none\.txt: cannot be read: No such file"):
            load(tmp_path / "none.txt")
        with pytest.raises(FileError, match="cannot be read: "):
            load(tmp_path)
        with pytest.raises(FileError, match=r"latin\.txt: must be UTF-8 text; near byte 3"):
            load(tmp_path / "latin.txt")


@pytest.mark.parametrize(("wanted", "near"), TABLES["nearest"])
def test_the_nearest_neighbour_of_what_is_not_there(tmp_path, wanted, near):
    (tmp_path / "runs").mkdir()
    for name in ("mission.csv", "auv.yaml", "b.csv", "runs/day1.csv"):
        (tmp_path / name).touch()
    clause = "" if near is None else f" Did you mean '{tmp_path / near}'?"
    assert nearest_file(tmp_path / wanted) == clause
    assert missing_file_message(tmp_path / wanted).endswith(f"No such file or directory.{clause}")


@pytest.mark.parametrize(("text", "line"), TABLES["yaml lines"])
def test_unreadable_yaml_tells_its_line(tmp_path, text, line):
    path = tmp_path / "mine.yaml"
    path.write_text(text, "utf-8")
    with pytest.raises(FileError, match=rf"mine\.yaml, line {line}: cannot be read as YAML: \S"):
        load_yaml(path)


@pytest.mark.parametrize(("text", "line"), TABLES["keys twice"])
def test_a_key_that_comes_twice_is_refused(text, line):
    with pytest.raises(FileError, match=rf"mine, line {line}: .*the key `.` is in line ."):
        parse_yaml(text, "mine")


def test_the_same_key_in_different_mappings_is_none_that_comes_twice():
    text = "base: &base {a: 1, b: 2}\none: {<<: *base, a: 3}\ntwo: {<<: *base, b: {b: 4}}\n"
    assert parse_yaml(text, "mine")["one"] == {"a": 3, "b": 2}
    assert parse_yaml(text, "mine")["two"] == {"a": 1, "b": {"b": 4}}


READERS = {
    "vehicle.yaml": (hd.read_vehicle, "a vehicle", "--vehicle"),
    "mapping.yaml": (hd.read_mapping, "a mapping of a log", "--mapping"),
    "models.yaml": (hd.read_models, "a file of models", "--models"),
    "damping.json": (hd.read_damping, "a damping file", "--damping"),
}


@pytest.fixture
def files(tmp_path):
    """A folder with one file of every kind."""
    hd.write_vehicle(hd.fleet["lauv"], tmp_path / "vehicle.yaml")
    text = yaml.safe_dump({"time": "t", "velocity": {"u": "speed"}, "name": None})
    (tmp_path / "mapping.yaml").write_text(text.replace("name: null\n", ""), "utf-8")
    hd.write_model(hd.catalog["fossen"], tmp_path / "models.yaml")
    hd.write_damping(hd.Damping.from_dict(None, {"Y_v": -20.0}), tmp_path / "damping.json")
    return tmp_path


@pytest.mark.parametrize("given", READERS)
@pytest.mark.parametrize("wanted", READERS)
def test_every_reader_says_what_another_file_is(files, given, wanted):
    reader, name, _ = READERS[wanted]
    _, other, option = READERS[given]
    if given == wanted:
        assert reader(files / given)
        return
    with pytest.raises(hd.HydrodampError) as caught:
        reader(files / given)
    message = str(caught.value)
    assert f"{given} is {other} (it has " in message
    assert f"not {name}: give it as `{option}`" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    "content",
    [
        {"time": [0.0, 0.1], "velocity": [1.0, 1.1], "position": [0.0, 0.1]},  # a log as JSON
        {"extends": "mavros", "axes": ["X"]},  # a misplaced key
        {"name": "mine", "extends": "linear", "commands": ["rudder"]},  # a key of another kind
        *(None, [], "text", {}, {"name": "a"}, {1: 2}),
    ],
)
def test_a_key_or_two_make_no_other_file(content):
    assert [wrong_kind_message(content, "x", wanted) for wanted in KINDS] == [""] * len(KINDS)


@pytest.mark.parametrize("given", READERS)
def test_none_of_them_is_a_log(files, given):
    _, other, option = READERS[given]
    with pytest.raises(hd.HydrodampError, match=f"{given} is {other}.*not a log: .*`{option}`"):
        read_files(files / given)


def test_a_comparison_is_told(tmp_path):
    (tmp_path / "c.json").write_text(json.dumps({"rows": [], "units": {}, "provenance": {}}))
    with pytest.raises(hd.HydrodampError, match=r"result of a comparison.*hydrodamp report"):
        hd.read_damping(tmp_path / "c.json")


def test_json_is_strict_and_tells_its_line(tmp_path):
    path, content = tmp_path / "a.json", {"a": [1.5, None, True, "ν"]}
    save_json(content, path)
    with pytest.raises(ValueError, match="not JSON compliant"):
        save_json({"a": float("nan")}, path)
    assert load_json(path) == load_yaml(path) == content
    path.write_bytes(b'\xef\xbb\xbf{"format":\n !}')  # a byte-order mark is no fault
    with pytest.raises(FileError, match=r"a\.json, line 2: cannot be read as JSON: .*column 2"):
        load_json(path)


NUMBERS = ("1e-3", "2e5", "-2E5", ".5e3", "1.e3", "+1e+3", "1.5e-3")
WORDS = ("1e3x", "e3", "v1e3", "1e", "2022-05-01", "2024-13-45", "'1e3'")


@pytest.mark.parametrize(
    ("text", "value"),
    # YAML 1.2.2, section 10.3.2, as Python's float reads them; what is no number stays text.
    [*((text, float(text)) for text in NUMBERS), *((text, text.strip("'")) for text in WORDS)],
)
def test_powers_of_ten_are_numbers(text, value):
    (found,) = parse_yaml(f"a: [{text}]", "mine")["a"]
    assert found == value
    assert type(found) is type(value)
