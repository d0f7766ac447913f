"""The envelope: what it refuses, and what follows from it."""

import json
from pathlib import Path

import pytest

import hydrodamp as hd
from hydrodamp.errors import FileError, ProblemError
from hydrodamp.experiment_design.autopilot_design import design_autopilot
from hydrodamp.experiment_design.ensemble import prior_damping
from hydrodamp.experiment_design.envelope import Envelope, LoopGains, read_envelope

TABLES = json.loads(Path(__file__).with_name("envelopes.json").read_text("utf-8"))
VEHICLE = hd.fleet["vt690"]
PRIOR = prior_damping(VEHICLE, hd.catalog["prestero"], None)


@pytest.fixture
def read(tmp_path):
    def read_text(text):
        path = tmp_path / "envelope.yaml"
        path.write_text(text, "utf-8")
        return read_envelope(path)

    return read_text


def test_an_envelope_ends_above_the_bottom(read):
    envelope = read("depth: [3, 30]\nbottom: 20\naltitude: 4\nnoise: {u: 0.1}")
    assert (envelope.max_depth, envelope.mid_depth, envelope.noise_std[0]) == (16.0, 9.5, 0.1)


@pytest.mark.parametrize(("text", "says"), TABLES["refused"])
def test_invalid_envelopes_are_refused_with_the_key(read, text, says):
    with pytest.raises(FileError, match=r"envelope\.yaml") as caught:
        read(text)
    assert says in str(caught.value)


@pytest.mark.parametrize("limit", [1e9, 1e5])
def test_a_limit_beyond_the_actuator_is_refused(limit):
    envelope = Envelope.model_validate({"commands": {"rpm": {"highest": limit}}})
    with pytest.raises(ProblemError, match=r"`commands.rpm.highest` must be within ±3.07e\+04"):
        design_autopilot(VEHICLE, PRIOR, envelope)


def test_gains_that_are_not_stated_are_assumptions():
    def assumptions(**loops):
        envelope = Envelope(autopilot=LoopGains(**loops))
        return " ".join(design_autopilot(VEHICLE, PRIOR, envelope).assumptions)

    assert "gains are assumed: heading: [" in assumptions()
    assert "State the vehicle's: `autopilot: {heading: [" in assumptions()
    gains = dict.fromkeys(("depth", "pitch"), (1.0, 0.1, 1.0))
    assert "pitch:" not in assumptions(**gains)
    assert "gains" not in assumptions(heading=(1.0, 0.1, 1.0), **gains)
