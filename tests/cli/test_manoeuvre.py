"""`hydrodamp manoeuvre`: what it prints and writes, and refusals before work."""

import json

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.export.export import list_reservations
from hydrodamp.files import as_json
from hydrodamp.identification.fit_files import fit_document

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


@pytest.mark.slow
def test_the_verdict_begins_with_the_test_of_the_fit_and_its_reservations(boat, call):
    damping, vehicle = hd.read_damping(boat / "boat.json"), hd.read_vehicle(boat / "boat.yaml")
    ranges = {"u": (1.0, 1.4), "r": (-0.01, 0.01)}
    fit = hd.Fit(damping, "ls", hd.Status.NOT_CONVERGED, training_range=ranges, vehicle=vehicle)
    content = fit_document(fit) | {"verdict": {"text": "Not tested: boat.\nFit: none."}}
    (boat / "fit.json").write_text(as_json(content), "utf-8")
    document = json.loads(call("manoeuvre fit.json --out trials --json").stdout)
    expected = ["Not tested: boat.", *list_reservations(fit)]
    assert document["reservations"] == expected
    assert document["verdict"].startswith(" ".join(expected))
