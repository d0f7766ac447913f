"""The examples on their measured logs, where these are at hand."""

import json
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.attitude import euler_from_quaternion

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("bluerov2", ("run_11_40_38.csv", "saabmarineMEX_learning")),
        ("kvlcc2", ("HSVA_CPMC_KVLCC2_Z_05_01.dat", "martinlarsalbert")),
        ("esso_osaka", ("zigzag_31-Jul-2020_13_42_53.csv", "NAOE-5thLab/FRT-DS-ESSO")),
        ("vt690", ("ECE-MDE/AUV-Fault-Detection",)),
    ],
)
def test_a_folder_without_the_log_is_named(run, tmp_path, name, words):
    ended = run(name, tmp_path)
    assert ended.status == 2
    for word in (str(tmp_path), *words):
        assert word in ended.stderr


@pytest.mark.parametrize(
    ("name", "suffix", "own", "commands"),
    [
        ("bluerov2", "+ch", "tank", "ch_forward ch_lateral ch_heave ch_roll ch_pitch ch_yaw"),
        ("kvlcc2", "+rp", "tanker", "thrust rudder"),
    ],
)
def test_every_model_of_the_paper_is_extended_alike(name, suffix, own, commands):
    models = hd.read_models(EXAMPLES / name / "models.yaml")
    assert [model.key for model in models] == [*(f"{k}{suffix}" for k in hd.PAPER_MODELS), own]
    for key, model in zip(hd.PAPER_MODELS, models, strict=False):
        for had, has in zip(hd.find_model(key).terms, model.terms, strict=True):
            assert set(had) <= set(has)
        assert set(model.commands) == set(commands.split())


def test_the_rov_beats_a_decoupled_fit(run, measured_logs, tmp_path):
    assert hd.read_vehicle(EXAMPLES / "bluerov2" / "vehicle.yaml").actuators == ()
    ended = run("bluerov2", measured_logs("bluerov2_kth"), "--out", tmp_path / "out")
    assert ended.status == 0, ended.stderr
    assert "saabmarineMEX_learning, commit dda3f3d" in ended.stdout
    rows = json.loads((tmp_path / "out" / "comparison.json").read_text("utf-8"))["rows"]
    assert len(rows) == 9 * 4
    (fit,) = (row["fit_by_axis"] for row in rows if (row["model"], row["method"]) == ("tank", "ls"))
    # What a decoupled fit per axis reaches, open loop on the same two runs [%].
    decoupled = {"u": 74.0, "v": 70.0, "w": 66.0, "p": -1.0, "q": -190.0, "r": -8.0}
    assert [name for name in decoupled if fit[name] <= decoupled[name]] == []
    assert min(fit["p"], fit["q"], fit["r"]) > 45.0


def test_whole_zigzags_that_were_held_out(run, measured_logs, tmp_path):
    """At or above 82 % everywhere: what an independent fit of the same terms reaches, at least."""
    asked = ("--models", "tanker", "--methods", "weak,recommended", "--out", tmp_path / "out")
    ended = run("kvlcc2", measured_logs("kvlcc2_hsva"), *asked)
    assert ended.status == 0, ended.stderr
    rows = json.loads((tmp_path / "out" / "comparison.json").read_text("utf-8"))["rows"]
    weak, recommended = rows
    assert min(recommended["fit_by_axis"][axis] for axis in "uvr") > 82.0
    assert recommended["rms"] < weak["rms"]


def test_the_published_split_of_a_tanker_on_a_pond(run, measured_logs, tmp_path):
    """The RMS error of `oe` in an independent trial with guessed added mass and 36 terms."""
    ended = run("esso_osaka", measured_logs("esso_osaka"), "--methods", "oe", "--out", tmp_path)
    assert ended.status == 0, ended.stderr
    rows = json.loads((tmp_path / "comparison.json").read_text("utf-8"))["rows"]
    assert [row["model"] for row in rows] == ["manoeuvring", "low-speed"]
    assert max(row["rms"] for row in rows) < 0.311


def test_held_out_turns_from_the_raw_topics(run, measured_logs, tmp_path):
    models = {model.key: model for model in hd.read_models(EXAMPLES / "vt690" / "models.yaml")}
    assert list(models) == ["yaw", "steering", "whole"]
    assert models["steering"].commands == ("rudder", "speed")
    assert models["whole"].commands == ("elevator", "rudder")
    out = tmp_path / "out"
    ended = run("vt690", measured_logs("vt690_field"), "--methods", "oe", "--out", out)
    assert ended.status == 0, ended.stderr
    assert re.search(r"Identification: turns (\d+ to \d+ s(, )?){3}\n", ended.stdout)
    assert re.search(r"Held out: turns (\d+ to \d+ s(, )?){4}\n", ended.stdout)
    found = re.search(r"^steering +oe +(\d+) +(\d+) +(\d+) +(\d+)$", ended.stdout, re.MULTILINE)
    assert found is not None
    # An independent fit of dr/dt = a U r + b U^2 rudder + c on four held-out turns [%], with other
    # limits of the turns: the mean difference is within two standard errors over the turns.
    difference = np.array([int(each) for each in found.groups()]) - (79, 54, 71, 83)
    assert difference.mean() > -2.0 * difference.std(ddof=1) / np.sqrt(len(difference))
    graded = dict(re.findall(r"^([XYZKMN]) +(?:yes|no) +(\d+) +", ended.stdout, re.MULTILINE))
    assert [graded[axis] for axis in "YZM"] == ["0", "0", "0"]
    assert all(int(graded[axis]) > 0 for axis in "KN")
    assert hd.read_damping(out / "steering.yaml").model.key == "steering"
    log = hd.read_log(out / "log.csv")
    derived = np.genfromtxt(
        measured_logs("vt690_field") / "derived_10hz.csv", delimiter=",", names=True
    )
    inside = (log.time > derived["time_s"][0]) & (log.time < derived["time_s"][-1])
    reference = np.interp(log.time, derived["time_s"], derived["roll_rad"])  # by other means
    roll = euler_from_quaternion(log.attitude)[:, 0]
    assert np.sqrt(np.mean((reference - roll)[inside] ** 2)) < 0.011


@pytest.mark.slow
def test_a_filter_estimates_velocity_without_dvl(measured_logs):
    """The errors of docs/how-to/navigation-filter.md."""
    example = runpy.run_path(str(EXAMPLES / "bluerov2" / "velocity_filter.py"))
    error = example["main"](measured_logs("bluerov2_kth"))
    assert error == pytest.approx({"u": 0.047, "v": 0.029, "w": 0.022}, abs=0.0006)
