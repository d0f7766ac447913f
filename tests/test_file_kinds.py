from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from hydrodamp.errors import HydrodampError
from hydrodamp.file_kinds import KINDS, LOG, MAPPING, VEHICLE, mistaken
from hydrodamp.ingest.formats.files import read
from hydrodamp.ingest.mapping import read_mapping
from hydrodamp.ingest.mapping.schema import MappingForm
from hydrodamp.models.catalog import catalog
from hydrodamp.models.damping import Damping
from hydrodamp.models.damping_file import read_damping, write_damping
from hydrodamp.models.files import read_models, write_model
from hydrodamp.vehicle.file import read_vehicle, write_vehicle
from hydrodamp.vehicle.fleet import fleet
from hydrodamp.vehicle.schema import VehicleEntry

READERS = {
    "vehicle.yaml": (read_vehicle, "a vehicle", "--vehicle"),
    "mapping.yaml": (read_mapping, "a mapping of a log", "--mapping"),
    "models.yaml": (read_models, "a file of models", "--models"),
    "damping.json": (read_damping, "a damping file", "--damping"),
}


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with one file of every kind."""
    write_vehicle(fleet["lauv"], tmp_path / "vehicle.yaml")
    text = yaml.safe_dump({"time": "t", "velocity": {"u": "speed"}, "name": None})
    (tmp_path / "mapping.yaml").write_text(text.replace("name: null\n", ""), "utf-8")
    write_model(catalog["fossen"], tmp_path / "models.yaml")
    write_damping(Damping.from_dict(None, {"Y_v": -20.0}), tmp_path / "damping.json")
    return tmp_path


@pytest.mark.parametrize("given", READERS)
@pytest.mark.parametrize("wanted", READERS)
def test_every_reader_says_what_another_file_is(files: Path, given: str, wanted: str) -> None:
    reader, name, _ = READERS[wanted]
    _, other, option = READERS[given]
    if given == wanted:
        assert reader(files / given)
        return
    with pytest.raises(HydrodampError) as caught:
        reader(files / given)
    message = str(caught.value)
    assert f"{given} is {other} (it has " in message
    assert f"not {name}: give it as `{option}`" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    "content",
    [
        {"time": [0.0, 0.1], "velocity": [1.0, 1.1], "position": [0.0, 0.1]},
        {"extends": "mavros", "axes": ["X"]},
        {"name": "mine", "extends": "linear", "commands": ["rudder"]},
    ],
    ids=["a log as JSON", "a misplaced key", "a key of another kind"],
)
def test_a_key_or_two_make_no_other_file(content: dict[str, object]) -> None:
    assert [mistaken(content, "x", wanted) for wanted in (*KINDS, LOG)] == [""] * (len(KINDS) + 1)


@pytest.mark.parametrize("given", READERS)
def test_none_of_them_is_a_log(files: Path, given: str) -> None:
    _, other, option = READERS[given]
    with pytest.raises(HydrodampError, match=f"{given} is {other}.*not a log: .*`{option}`"):
        read(files / given)


@pytest.mark.parametrize("text", ["- 1\n- 2\n", "a: 1\n", "a: [\n"])
@pytest.mark.parametrize("suffix", [".yaml", ".json"])
def test_what_is_none_of_ours_is_no_log_either(tmp_path: Path, text: str, suffix: str) -> None:
    (tmp_path / f"a{suffix}").write_text(text, "utf-8")
    with pytest.raises(HydrodampError, match=f"this is {suffix[1:].upper()}"):
        read(tmp_path / f"a{suffix}")


def test_a_comparison_is_told(tmp_path: Path) -> None:
    (tmp_path / "c.json").write_text(json.dumps({"rows": [], "units": {}, "provenance": {}}))
    with pytest.raises(HydrodampError, match=r"result of a comparison.*hydrodamp report"):
        read_damping(tmp_path / "c.json")


def test_keys_are_those_of_the_forms_and_of_one_kind_only() -> None:
    shared = {"name", "source", "note", "extends"}
    assert set(VEHICLE.keys) == set(VehicleEntry.model_fields) - shared
    assert set(MAPPING.keys) == set(MappingForm.model_fields) - shared
    keys = [key for kind in KINDS for key in kind.keys]
    assert len(keys) == len(set(keys))


@pytest.mark.parametrize("content", [None, [], "text", {}, {"name": "a"}, {1: 2}])
def test_what_has_no_key_of_ours_is_left_to_its_reader(content: object) -> None:
    assert mistaken(content, "a.yaml", VEHICLE) == ""
