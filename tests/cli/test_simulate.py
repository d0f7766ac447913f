import json
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd


@pytest.fixture
def damping(folder):
    vehicle, log = hd.read_vehicle("planar.yaml"), hd.read_log("a.csv")
    fit = hd.identify(hd.catalog["linear"], vehicle, log, hd.LeastSquares())
    hd.write_damping(fit.damping, "d.json")
    return "d.json"


@pytest.mark.slow
def test_prints_the_score_and_writes_the_simulated_log(folder, call, damping):
    line = f"simulate b.csv --vehicle planar.yaml --damping {damping} --attitude simulated"
    done = call(line)
    assert "RMS error" in done.stdout
    assert done.stderr == ""
    score = json.loads(call(f"{line} --out t.csv --json").stdout)
    measured, simulated = hd.read_log("b.csv"), hd.read_log("t.csv")
    assert simulated.velocity_names == ("u", "v", "r")
    error = np.degrees(simulated.velocity[:, 5] - measured.velocity[:, 5])
    assert score["rms_by_axis"]["r"] == pytest.approx(np.sqrt(np.mean(error**2)))
    assert simulated.command_names == measured.command_names


def test_what_looks_wrong_about_the_log_is_told(folder, call, damping):
    log = hd.read_log("b.csv")
    velocity = log.velocity.copy()
    velocity[100:140, 5] = velocity[100, 5]
    hd.write_log(replace(log, velocity=velocity), "frozen.csv")
    done = call(f"simulate frozen.csv --vehicle planar.yaml --damping {damping}")
    assert "quality issue: `r` is frozen" in " ".join(done.stderr.split())


def test_a_replay_beyond_the_training_that_diverges_failed(folder, call):
    done = call("identify a.csv --vehicle planar.yaml --model fossen --method ls --json")
    document = json.loads(done.stdout)
    assert document["fit"]["training_range"].keys() == {"u", "v", "r"}
    document["fit"]["training_range"]["r"] = [-0.1, 0.1]
    document["coefficients"] |= {"N_r": -0.2, "N_r|r|": 2.0}
    (folder / "wild.json").write_text(json.dumps(document), "utf-8")
    line = "simulate b.csv --vehicle planar.yaml --damping wild.json --json --out t.csv"
    done = call(line, 1)
    assert json.loads(done.stdout)["rms"] is None
    assert json.loads(done.stdout)["diverged_at"][0]["segment"] == "1"
    assert not (folder / "t.csv").exists()
    told = done.stderr.splitlines()
    assert told[0].startswith("Extrapolation beyond the training data: r ")
    assert told[0].endswith(" in the test, 0.1 in training.")
    assert "injects energy into r beyond 0.1 rad/s" in told[1]
    assert "error: the replay diverged in segment 1 after" in told[-1]


@pytest.mark.slow
def test_a_fit_predicts_its_error_in_table_document_and_file(folder, call):
    call("identify a.csv --vehicle planar.yaml --model linear --method ls --out d.json")
    line = "simulate b.csv --vehicle planar.yaml --damping d.json --out t.csv"
    predicted = json.loads(call(f"{line} --json").stdout)["predicted_error_by_axis"]
    width = hd.read_log("t.csv").command("r_half_width")
    assert predicted["r"] == pytest.approx(np.degrees(np.sqrt(np.mean(width**2))))
    assert width[0] == 0.0 < width[-1]
    document = json.loads((folder / "d.json").read_text("utf-8"))
    document["fit"]["training_range"]["r"] = [-1e-3, 1e-3]
    (folder / "d.json").write_text(json.dumps(document), "utf-8")
    assert json.loads(call(f"{line} --force --json").stdout)["extrapolated"] == ["r"]
    shown = call(f"{line} --force").stdout
    assert "predicted (95 %)" in shown
    rows = shown.splitlines()
    assert [row.split()[0] for row in rows if row.endswith(" extrapolation")] == ["r"]


@pytest.mark.slow
def test_a_log_is_read_by_the_mapping_of_the_fit(folder, call):
    for name in ("a.csv", "b.csv"):
        text = (folder / name).read_text()
        (folder / f"raw-{name}").write_text(text.replace("time,", "stamp,", 1))
    mapping = "{time: stamp, velocity: {u: u, v: v, r: r}, commands: [ahead, turn]}"
    (folder / "raw.yaml").write_text(mapping, "utf-8")
    identify = "identify raw-a.csv --mapping raw.yaml --vehicle planar.yaml --model linear"
    call(f"{identify} --method ls --out raw.json")
    done = call("simulate raw-b.csv --damping raw.json")
    assert "raw.yaml, the mapping of the fit" in done.stderr
    call("simulate b.csv --damping raw.json")  # canonical: needs none
    other = call("simulate raw-b.csv --damping raw.json --mapping mavros", 2)
    assert "the mapping of the fit" not in other.stderr
