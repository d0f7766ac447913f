"""`hydrodamp manoeuvre`: what it prints and writes."""

import json

import pytest

import hydrodamp as hd
from hydrodamp.export.export import list_reservations
from hydrodamp.files import as_json
from hydrodamp.identification.fit_files import fit_document
from hydrodamp.report.manoeuvre_report import RESULTS

CALL = "manoeuvre fit.json --vehicle boat.yaml --speed 1.2 --out trials --json"


@pytest.mark.slow
def test_manoeuvres_are_printed_and_written_with_the_reservations_of_the_fit(boat, call):
    damping, vehicle = hd.read_damping(boat / "boat.json"), hd.read_vehicle(boat / "boat.yaml")
    ranges = {"u": (1.0, 1.4), "r": (-0.01, 0.01)}
    fit = hd.Fit(damping, "ls", hd.Status.NOT_CONVERGED, training_range=ranges, vehicle=vehicle)
    content = fit_document(fit) | {"verdict": {"text": "Not tested: boat.\nFit: none."}}
    (boat / "fit.json").write_text(as_json(content), "utf-8")
    document = json.loads(call(CALL).stdout)
    reservations = ["Not tested: boat.", *list_reservations(fit)]
    assert document["reservations"] == reservations
    assert document["verdict"].startswith(" ".join(reservations))
    assert "first overshoot of the zigzag 20/20 to port 31.2 > 25" in document["verdict"]
    assert document == json.loads((boat / "trials" / "manoeuvres.json").read_text("utf-8"))
    advance, *_ = document["numbers"]
    assert (advance["name"], advance["limit"], advance["band"]) == ("advance", 4.5, None)
    assert advance["value"] > 0.0
    assert {path.name for path in (boat / "trials").glob("[!.]*")} == {*RESULTS}
