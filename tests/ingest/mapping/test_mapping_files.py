"""Mapping files: presets, overrides, faults, and the schema for editors."""

from pathlib import Path

import pytest

from hydrodamp.errors import FileError, LogError
from hydrodamp.files import parse_yaml
from hydrodamp.ingest.mapping import LogMapping, json_schema, presets, read_mapping
from hydrodamp.ingest.mapping.log_mapping import resolve_extends

NAMES = (
    "ardusub",
    "ardusub-mavlink",
    "avl690",
    "bluerov2-kth",
    "esso-osaka",
    "kvlcc2-hsva",
    "mavros",
    "px4-uuv",
    "rep103-odometry",
)


def faults(content):
    with pytest.raises(LogError) as caught:
        LogMapping.from_dict(content, "map.yaml")
    return caught.value.faults


def test_the_presets_are_those_promised_and_name_their_sources():
    assert presets() == NAMES
    for name in NAMES:
        content = resolve_extends({"extends": name})
        assert "github.com" in content["source"], name
        assert read_mapping(name).name == name


def test_a_file_changes_what_it_extends(tmp_path):
    (tmp_path / "mine.yaml").write_text(
        "extends: rep103-odometry\n"
        "topics: {odometry: /rov/odom}\n"
        "velocity: {p: /imu.gyro.x, w: null}\n"
        "commands: [a, b]\n",
        encoding="utf-8",
    )
    (tmp_path / "yours.yaml").write_text(
        "extends: [mine.yaml]\ncommands: {b: {column: bb}}\nclock: {rate: 10}\nposition: null\n",
        encoding="utf-8",
    )
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
    refused(
        LogError, lambda: LogMapping.from_dict({"extends": "list.yaml"}, str(tmp_path / "map.yaml"))
    )
    with pytest.raises(FileError, match="cannot be read"):
        LogMapping.from_dict({"extends": "absent.yaml"}, str(tmp_path / "map.yaml"))
    refused(LogError, read_mapping, "ardu")


def test_all_faults_of_a_mapping_are_told_at_once():
    """Each at its place; `name` and `one` are also what pydantic calls the form it tried."""
    messages = faults(
        {
            "frames": "FLU",
            "name": "x",
            "frame": "NED",
            "segment": 3,
            "wrench": ["X"],
            "velocity": {
                "u": 3,
                "v": {"column": "a", "sign": 2, "scale": "x", "where": 3},
                "w": [],
                "p": ["a", {"column": 3}],
                "q": {"value": "x", "colum": "a"},
                "r": {"column": "r", "plus": {"s": "t"}},
                "one": "b",
            },
            "acceleration": {"dp": {"column": "p", "unit": "deg"}},
            "commands": {"a": None, "b": 3, "uv": "c", "fin": {"column": "f", "hold": "yes"}},
            "clock": {"rat": 3, "rate": -1},
            "sensors": {"velocity": {"position": [1, 2], "rotation": {"rol": 1}}, "dvl": {}},
            "attitude": {"quaternion": "q"},
            "topics": {"imu": 3},
        }
    )
    for says in (
        "unknown key `frames`. Did you mean 'frame'?",
        "unknown key `name`",
        "`frame` must be FRD or FLU; got 'NED'",
        "`time` is missing",
        "`segment` must be text; got 3",
        "`wrench` must be a table; got ['X']",
        "`clock.rate` must be greater than 0; got -1",
        "`clock` has no `rat`. Did you mean 'rate'? It takes: topic rate",
        "`attitude.quaternion` must be a table; got 'q'",
        "`velocity.u` must name a column; got 3",
        "`velocity.v.sign` must be 1 or -1; got 2",
        "`velocity.v.scale` must be a number; got 'x'",
        "`velocity.v.where` must be the name of a field, or a table of fields and values; got 3",
        "`velocity.w` must be a list of at least one column; got []",
        "`velocity.p[1].column` must be text; got 3",
        "`velocity.q.value` must be a number; got 'x'",
        "`velocity.q` has no `colum`. Did you mean 'column'?",
        "`velocity.r.plus.s` must be a number; got 't'",
        "`velocity` has no `one`",
        "`acceleration.dp`: 'deg' is no unit of angular acceleration",
        "`commands.b` must name a column; got 3",
        "`commands.uv`: Command name `uv` reads as the product",
        "`commands.fin.hold` must be true or false; got 'yes'",
        "`sensors.velocity.rotation` has no `rol`. Did you mean 'roll'? It takes: roll pitch yaw"
        " unit",
        "`sensors.velocity.position` must be a list of 3; got [1, 2]",
        "`sensors.dvl.kind` is missing",
        "`sensors.dvl.columns` is missing",
        "`topics.imu` must be a list; got 3",
    ):
        (matching,) = (fault for fault in messages if fault.startswith(says))
        messages = tuple(fault for fault in messages if fault != matching)
    assert messages == ()


BASE = {"time": "t", "velocity": {"u": "u", "v": "v", "w": "w", "p": "p", "q": "q", "r": "r"}}


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (
            {"attitude": {"roll": "a", "quaternion": {"column": "q"}}},
            "must be given once; got both",
        ),
        ({"attitude": {"yaw": "a", "heading": "b"}}, "takes `yaw` or `heading`, not both"),
        (
            {"attitude": {"quaternion": {"column": "q"}, "qw": "w"}},
            "must be given once; got both `qw` and `quaternion`",
        ),
        ({"attitude": {"quaternion": {"column": 3}}}, "`attitude.quaternion.column` must be text"),
        ({"velocity": {"u": "u", "north": "n"}}, "got both `u` and `north`"),
        ({"velocity": {"north": "n", "east": "e"}}, "`velocity.north` needs `attitude`"),
        (
            {"velocity": {"north": "n"}, "attitude": {"yaw": "y"}},
            "needs `north` and `east`, or `speed` and `course`",
        ),
        (
            {
                "velocity": {"north": "n", "east": "e"},
                "attitude": {"roll": "r", "pitch": "p", "yaw": "y"},
            },
            "needs `down` or `up`",
        ),
        (
            {"velocity": {"course": "c"}, "attitude": {"yaw": "y"}},
            "needs `north` and `east`, or `speed` and `course`",
        ),
        ({"velocity": {"u": "u", "speed": "s"}}, "takes `u` or `speed`"),
        ({"velocity": {"speed": "s", "course": "c"}}, "`velocity.speed` needs `attitude`"),
        ({"position": {"up": "z", "depth": "d"}}, "takes one of `up depth`"),
        ({"position": {"latitude": "a"}}, "needs both `latitude` and `longitude`"),
        (
            {"position": {"north": "n", "latitude": "a", "longitude": "b"}},
            "takes `north` or `latitude longitude`",
        ),
        ({"frame": "FLU", "world": "NED"}, "must be NWU or ENU"),
        ({"world": "UTM"}, "`world` must be NED, NWU or ENU; got 'UTM'"),
        ({"clock": 3}, "`clock` must be a topic, or a table of `topic` or `rate`; got 3"),
        (
            {"velocity": {"u": "u"}, "sensors": {"velocity": {"rotation": {"yaw": 9}}}},
            "`sensors.velocity.rotation` needs all three",
        ),
        (
            {"velocity": {"u": "u"}, "sensors": {"velocity": {"position": [1, 0, 0]}}},
            "needs the rates p q r",
        ),
        ({"sensors": {"rates": {"position": [1, 0, 0]}}}, "`sensors.rates.position` has no effect"),
        ({"sensors": 3}, "`sensors` must be a table"),
        ({"commands": "rpm"}, "`commands` must be a table; got 'rpm'"),
        ({"eta": [1]}, "`eta[0]` must name a column; got 1"),
        ({"eta": {"column": "e", "unit": "deg"}}, "`eta`: 'deg' is no unit of ratio"),
        ({"velocity": {"u": [{"column": "a", "unit": "rad"}]}}, "`velocity.u`: 'rad' is no"),
        ({"time": None}, "`time: recorded`"),
        ({"eta": {"unit": "%"}}, "`eta` must have a `column`"),
        ({"eta": {"value": 1, "scale": 2}}, "`eta` allows only `unit` and `sign`"),
        ({"commands": ["yaw"]}, "`commands.yaw` is the reserved name"),
        ({"steps": "low_pass"}, "`steps` must be a list; got 'low_pass'"),
    ],
)
def test_what_makes_no_sense_is_told(more, says):
    assert says in "\n".join(faults({**BASE, **more}))


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
