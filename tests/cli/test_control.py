"""`hydrodamp control`: verdict, files, statuses and refusals."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.files import as_json
from hydrodamp.identification.fit_files import fit_document
from hydrodamp.simulation.damping_estimate import published_damping

CALL = "control damping.json --draws 10 --out autopilot --speed 1.5"


@pytest.fixture
def home(folder):
    vehicle = hd.fleet["vt690"]
    damping = published_damping(vehicle)
    damping = replace(damping, covariance=np.diag((0.05 * damping.coefficients) ** 2))
    fit = hd.Fit(damping, "ls", hd.Status.OK, training_range={"u": (1.2, 2.0)}, vehicle=vehicle)
    (folder / "damping.json").write_text(as_json(fit_document(fit)), "utf-8")
    return folder


@pytest.mark.slow
def test_a_design_is_printed_and_written(home, call):
    done = call(f"{CALL} --speed 2.5")
    assert done.stdout.startswith("Verdict: Acceptable: the smallest modulus margin over 10 draws")
    warning = "2.5 m/s is outside the training data, 1.2 to 2 m/s; the predicted error of its"
    assert warning in " ".join(done.stderr.split())
    document = json.loads((home / "autopilot" / "control.json").read_text("utf-8"))
    speeds = document["speeds"]
    assert [each["speed"] for each in speeds] == [1.5, 2.5]
    assert speeds[0]["feed_forward"]["wrench"]["X"] == pytest.approx(3.244 * 2.25, rel=1e-4)
    assert np.shape(speeds[0]["a"]) == (10, 10)
    assert (home / "autopilot" / "step.svg").is_file()


@pytest.mark.slow
def test_python_control_has_the_same_margins(home, call):
    call(CALL)
    folder = home / "autopilot"
    entry = json.loads((folder / "control.json").read_text("utf-8"))["speeds"][0]
    done = subprocess.run(
        [sys.executable, "control_design.py"], cwd=folder, capture_output=True, text=True
    )
    if "No module named 'control'" in done.stderr:
        pytest.skip("needs python-control")
    for name in ("rudder", "elevator", "rpm"):
        expected = entry["margins"][name]["modulus"]["estimate"]
        assert f"  {name}: modulus margin {expected:.3f}" in done.stdout


@pytest.mark.slow
def test_a_speed_without_trim_fails_the_work_and_keeps_the_others(home, call):
    done = call(f"{CALL} --speed 9 --json", 1)
    outcomes = [each["outcome"].partition(":")[0] for each in json.loads(done.stdout)["speeds"]]
    assert outcomes == ["ok", "no trim"]
    assert "no autopilot holds 9 m/s" in done.stderr


@pytest.mark.slow
def test_assumed_values_are_named_with_their_keys(home, call):
    (home / "limits.yaml").write_text("period: 0.2", "utf-8")
    text = " ".join(call(f"{CALL} --json").stdout.split())
    for words in ("`period: 0.1`", "`pitch: 35`", "in the file of `--envelope`"):
        assert words in text
    text = call(f"{CALL} --envelope limits.yaml --force --json").stdout
    assert "`period: 0.2`" not in text
    assert "`pitch: 35`" in text
