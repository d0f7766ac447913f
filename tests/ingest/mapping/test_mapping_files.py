"""Mapping files: presets, overrides, faults, and the schema for editors."""

from pathlib import Path

import pytest

from hydrodamp.errors import FileError, LogError
from hydrodamp.files import parse_yaml
from hydrodamp.ingest.mapping import LogMapping, json_schema, presets, read_mapping
from hydrodamp.ingest.mapping.log_mapping import resolve_extends
from table_rows import rows

UP_TO_MAVROS = "ardusub ardusub-mavlink avl690 bluerov2-kth esso-osaka kvlcc2-hsva mavros"
NAMES = (*UP_TO_MAVROS.split(), "px4-uuv", "rep103-odometry")


def test_the_presets_are_those_promised_and_name_their_sources():
    assert presets() == NAMES
    for name in NAMES:
        content = resolve_extends({"extends": name})
        assert "github.com" in content["source"], name
        assert read_mapping(name).name == name


def test_a_file_changes_what_it_extends(tmp_path):
    text = "extends: rep103-odometry\ntopics: {odometry: /rov/odom}\ncommands: [a, b]\n"
    text += "velocity: {p: /imu.gyro.x, w: null}\n"
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    text = "extends: [mine.yaml]\ncommands: {b: {column: bb}}\nclock: {rate: 10}\nposition: null\n"
    (tmp_path / "yours.yaml").write_text(text, encoding="utf-8")
    mine, yours = (read_mapping(tmp_path / name) for name in ("mine.yaml", "yours.yaml"))
    columns = {entry.name: entry.column for entry in mine.entries}
    assert columns["p"] == "/imu.gyro.x"
    assert columns["q"] == "odometry.twist.twist.angular.y"
    assert "w" not in columns
    assert dict(mine.topics) == {"odometry": ("/rov/odom",)}
    assert mine.world == "ENU"
    assert {entry.column for entry in yours.entries if entry.group == "commands"} == {"a", "bb"}
    assert yours.clock.rate == 10
    assert not any(entry.group == "position" for entry in yours.entries)


def test_a_ring_of_files_is_refused(tmp_path, refused):
    (tmp_path / "a.yaml").write_text("extends: b.yaml\n", encoding="utf-8")
    (tmp_path / "b.yaml").write_text("extends: a.yaml\n", encoding="utf-8")
    refused(LogError, lambda: read_mapping(tmp_path / "a.yaml"))


def test_what_cannot_be_extended_is_told(tmp_path, refused):
    refused(LogError, LogMapping.from_dict, {"extends": "mavross"})
    refused(LogError, LogMapping.from_dict, {"extends": [3]})
    (tmp_path / "list.yaml").write_text("[1, 2]\n", encoding="utf-8")
    path = str(tmp_path / "map.yaml")
    refused(LogError, lambda: LogMapping.from_dict({"extends": "list.yaml"}, path))
    with pytest.raises(FileError, match="cannot be read"):
        LogMapping.from_dict({"extends": "absent.yaml"}, path)
    refused(LogError, read_mapping, "ardu")


@rows("content")
def test_all_faults_of_a_mapping_are_told_at_once(content, refused):
    """Each at its place; `name` and `one` are also what pydantic calls the form it tried."""
    refused(LogError, LogMapping.from_dict, content, "map.yaml")


BASE = {"time": "t", "velocity": {"u": "u", "v": "v", "w": "w", "p": "p", "q": "q", "r": "r"}}


@rows("more")
def test_what_makes_no_sense_is_told(more, refused):
    refused(LogError, LogMapping.from_dict, {**BASE, **more}, "map.yaml")


def test_the_schema_knows_every_key_and_takes_the_presets():
    jsonschema = pytest.importorskip("jsonschema", reason="jsonschema is not installed")
    schema = json_schema()
    assert set(schema["properties"]) >= {"extends", "velocity", "sensors", "clock", "topics"}
    validator = jsonschema.Draft202012Validator(schema)
    for name in NAMES:
        assert [*validator.iter_errors(resolve_extends({"extends": name}))] == []
    assert [*validator.iter_errors({"velocty": {}})]
    assert [*validator.iter_errors({"velocity": {"u": {"colum": "a"}}})]


def test_the_mappings_of_the_documentation_are_sound():
    page = Path(__file__).resolve().parents[3] / "docs" / "how-to" / "write-a-mapping.md"
    blocks = page.read_text(encoding="utf-8").split("```yaml\n")[1:]
    mappings = [
        LogMapping.from_dict(parse_yaml(block.partition("```")[0], page.name)) for block in blocks
    ]
    assert [mapping.world for mapping in mappings[1:3]] == ["ENU", "ENU"]
    assert tuple(mappings[1].commands) == (*(f"servo{k}" for k in (1, 2, 3, 4, 5, 6, 8)), "lights")
    assert mappings[2].clock.rate == 20
