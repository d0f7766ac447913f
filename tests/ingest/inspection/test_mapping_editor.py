"""Edits of the content of a mapping."""

import pytest

from hydrodamp.errors import FileError
from hydrodamp.ingest.inspection.mapping_editor import (
    Assignment,
    add_step,
    assign,
    assignments,
    format_content,
    parse_content,
    roles,
    set_frame,
    units_of,
)
from hydrodamp.ingest.mapping import LogMapping

TEXT = """
time: t
velocity: {u: speed, r: {column: yaw_rate, unit: deg/s, sign: -1}}
attitude: {yaw: [{column: heading, unit: deg}]}
commands: [rudder, rpm]
"""


def test_assignments_name_column_role_unit_and_sign():
    found = {each.column: each for each in assignments(parse_content(TEXT, "m"))}
    assert found["yaw_rate"] == Assignment("yaw_rate", "velocity.r", "deg/s", -1, "r")
    assert found["heading"] == Assignment("heading", "attitude.yaw", "deg", 1, "yaw")
    assert found["t"].role == "time"
    assert found["rpm"].role == "commands"


@pytest.mark.parametrize("role", [name for group in roles().values() for name in group])
def test_a_column_has_the_role_that_it_was_given_and_no_other(role):
    """The content is that of a mapping, and a second assignment replaces the first."""
    content = assign(parse_content(TEXT, "m"), Assignment("speed", role))
    found = [each for each in assignments(content) if each.column == "speed"]
    assert [each.role for each in found] == ([role] if role else [])
    again = assign(content, Assignment("speed", "velocity.u", "kn", -1))
    assert Assignment("speed", "velocity.u", "kn", -1, "u") in [*assignments(again)]
    assert len([each for each in assignments(again) if each.column == "speed"]) == 1


def test_the_text_reads_back_as_a_mapping():
    content = parse_content(TEXT, "m")
    content = assign(content, Assignment("/imu.gyro[0]", "commands"))
    content = set_frame(add_step(content, "remove_outliers"), "FLU", "NWU")
    text = format_content(content)
    mapping = LogMapping.from_dict(parse_content(text, "m"), "m")
    assert mapping.frame == "FLU"
    assert len(mapping.steps) == 1
    assert "gyro_0" in mapping.commands


def test_the_first_unit_of_a_role_is_its_own():
    assert units_of("velocity.u")[:2] == ["", "m/s"]
    assert units_of("commands") == []


def test_names_of_commands_are_valid_in_terms_and_distinct():
    content = {"commands": {"rpm": "a"}}
    for column, name in (("<script>", "script"), ("7/thrust", "c7_thrust"), ("u", "u_command")):
        changed = assign(content, Assignment(column, "commands"), {})
        assert changed["commands"] == {"rpm": "a", name: column}


def test_a_text_that_is_no_mapping_is_refused(refused):
    refused(FileError, parse_content, "a: [1", "m")


def test_a_change_of_sign_keeps_the_other_keys_and_the_name_of_a_command():
    content = {
        "velocity": {"u": {"column": "a", "scale": 0.5, "delay": 0.1}, "v": ["b", "c"]},
        "commands": {"thrust": "rpm|a"},
    }
    changed = assign(content, Assignment("a", "velocity.u", "kn", -1))
    entry = {"column": "a", "scale": 0.5, "delay": 0.1, "unit": "kn", "sign": -1}
    assert changed["velocity"]["u"] == entry
    changed = assign(content, Assignment("c", "velocity.v", "", -1))
    assert changed["velocity"]["v"] == ["b", {"column": "c", "sign": -1}]
    changed = assign(content, Assignment("rpm|a", "commands", "", -1))
    assert changed["commands"] == {"thrust": {"column": "rpm|a", "sign": -1}}
    moved = assign(content, Assignment("a", "velocity.w"))
    assert moved["velocity"]["w"] == {"column": "a", "scale": 0.5, "delay": 0.1}
    assert "u" not in moved["velocity"]


def test_a_column_of_an_extended_mapping_is_removed_by_null():
    content = {"extends": "base", "velocity": {"v": "b"}}
    inherited = {"time": "t", "velocity": {"u": "a", "v": "b"}}
    removed = assign(content, Assignment("a", ""), inherited)
    assert removed["velocity"] == {"v": "b", "u": None}


@pytest.mark.parametrize("content", [{"commands": 5}, {"velocity": "x"}, {"commands": [{"a": 1}]}])
def test_groups_of_another_kind_have_no_columns(content):
    assert [*assignments(content)] == []
    assert assign(content, Assignment("a", "velocity.u"))["velocity"] == {"u": "a"}
