"""`hydrodamp manoeuvre`: what it prints and writes, and refusals before work."""

import json

import numpy as np
import pytest

import hydrodamp as hd

CALL = "manoeuvre known.json --vehicle boat.yaml --speed 1.2 --out trials"


@pytest.fixture
def home(boat):
    known = {"X_u|u|": -8.0, "Y_v": -30.0, "Y_uv": -20.0, "N_r": -4.0, "N_ur": -8.0}
    damping = hd.Damping.from_dict(None, known)
    hd.write_damping(damping, boat / "known.json")
    return boat


@pytest.mark.slow
def test_manoeuvres_are_printed_and_written(home, call):
    done = call(f"{CALL} --json")
    document = json.loads(done.stdout)
    assert document["verdict"].startswith("boat does not meet the limits of IMO resolution MSC.137")
    assert "first overshoot of the zigzag 20/20 to port 31.2 > 25" in document["verdict"]
    assert document == json.loads((home / "trials" / "manoeuvres.json").read_text("utf-8"))
    advance, *_ = document["numbers"]
    assert (advance["name"], advance["limit"], advance["band"]) == ("advance", 4.5, None)
    names = {path.name for path in (home / "trials").glob("*.svg")}
    assert names == {
        *("spiral.svg", "stopping.svg", "turning-circle.svg"),
        *("zigzag-10-10.svg", "zigzag-20-20.svg"),
    }
    assert np.isfinite(advance["value"])
