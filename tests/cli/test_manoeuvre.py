"""`hydrodamp manoeuvre`: what it prints and writes, and refusals before work."""

import json

import numpy as np
import pytest

ZIGZAGS = "zigzag-10-10.svg", "zigzag-20-20.svg"
CALL = "manoeuvre boat.json --vehicle boat.yaml --speed 1.2 --out trials"


@pytest.mark.slow
def test_manoeuvres_are_printed_and_written(boat, call):
    done = call(f"{CALL} --json")
    document = json.loads(done.stdout)
    assert document["verdict"].startswith("boat does not meet the limits of IMO resolution MSC.137")
    assert "first overshoot of the zigzag 20/20 to port 31.2 > 25" in document["verdict"]
    assert document == json.loads((boat / "trials" / "manoeuvres.json").read_text("utf-8"))
    advance, *_ = document["numbers"]
    assert (advance["name"], advance["limit"], advance["band"]) == ("advance", 4.5, None)
    names = {path.name for path in (boat / "trials").glob("*.svg")}
    assert names == {"spiral.svg", "stopping.svg", "turning-circle.svg", *ZIGZAGS}
    assert np.isfinite(advance["value"])
