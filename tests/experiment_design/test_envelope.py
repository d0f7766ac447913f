"""The envelope: what it refuses, and what follows from it."""

import json
from pathlib import Path

import pytest

import hydrodamp as hd
from hydrodamp.errors import FileError, ProblemError
from hydrodamp.experiment_design.autopilot_design import design_autopilot
from hydrodamp.experiment_design.ensemble import prior_damping
from hydrodamp.experiment_design.envelope import (
    Envelope,
    LoopGains,
    read_envelope,
    read_envelope as public_read_envelope,
)

TABLES = json.loads(Path(__file__).with_name("envelopes.json").read_text("utf-8"))


def write_envelope(folder, text):
    path = folder / "envelope.yaml"
    path.write_text(text, "utf-8")
    return path


def test_an_envelope_ends_above_the_bottom(tmp_path):
    path = write_envelope(tmp_path, "depth: [3, 30]\nbottom: 20\naltitude: 4\nnoise: {u: 0.1}")
    envelope = public_read_envelope(path)
    assert (envelope.max_depth, envelope.mid_depth, envelope.noise_std[0]) == (16.0, 9.5, 0.1)


@pytest.mark.parametrize(("text", "says"), TABLES["refused"])
def test_invalid_envelopes_are_refused_with_the_key(tmp_path, text, says):
    with pytest.raises(FileError, match=r"envelope\.yaml") as caught:
        public_read_envelope(write_envelope(tmp_path, text))
    assert says in str(caught.value)


def test_implausible_noise_is_refused(tmp_path):
    path = tmp_path / "band.yaml"
    path.write_text("noise: {u: 1.0e300}", "utf-8")
    with pytest.raises(FileError, match=r"`noise.u` must be at most 13.3, in SI units; got"):
        read_envelope(path)


@pytest.mark.parametrize("limit", [1e9, 1e5])
def test_a_limit_beyond_the_actuator_is_refused(limit):
    vehicle = hd.fleet["vt690"]
    prior = prior_damping(vehicle, hd.catalog["prestero"], None)
    envelope = Envelope.model_validate({"commands": {"rpm": {"highest": limit}}})
    with pytest.raises(ProblemError, match=r"`commands.rpm.highest` must be within ±3.07e\+04"):
        design_autopilot(vehicle, prior, envelope)


def test_gains_that_are_not_stated_are_assumptions():
    vehicle = hd.fleet["vt690"]
    prior = prior_damping(vehicle, hd.catalog["prestero"], None)

    def assumptions(**loops):
        envelope = Envelope(autopilot=LoopGains(**loops))
        return " ".join(design_autopilot(vehicle, prior, envelope).assumptions)

    assert "gains are assumed: heading: [" in assumptions()
    assert "State the vehicle's: `autopilot: {heading: [" in assumptions()
    gains = dict.fromkeys(("depth", "pitch"), (1.0, 0.1, 1.0))
    assert "pitch:" not in assumptions(**gains)
    assert "gains" not in assumptions(heading=(1.0, 0.1, 1.0), **gains)
