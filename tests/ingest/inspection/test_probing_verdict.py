from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.conditioning.derivatives import rates_from_attitude
from hydrodamp.conditioning.outliers import remove_attitude_outliers
from hydrodamp.conditioning.quality_checks import Fix, QualityIssue
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.identification.log_requirements import find_requirements
from hydrodamp.ingest.inspection.draft_files import add_steps
from hydrodamp.ingest.inspection.probe import inspect, omit_applied_steps, probe
from hydrodamp.ingest.inspection.quality_report import Requirements, report_quality

TIME = np.arange(0.0, 60.0, 0.1)
LEVEL = np.tile([1.0, 0.0, 0.0, 0.0], (600, 1))
WAVES = np.sin(np.outer(TIME, np.linspace(0.3, 0.9, 6)))


def test_steps_and_changes_stay_within_segments():
    commands = {"rpm": np.tile([1.0, 1.0, 2.0], 2)}
    names = np.repeat(["run0", "run1"], 3).tolist()
    time = np.tile([0.0, 0.1, 0.3], 2)
    found = report_quality(Log.from_arrays(time, np.ones((6, 6)), commands=commands, segment=names))
    assert [part.longest_step for part in found.segments] == [0.3 - 0.1] * 2
    assert found.commands[0].n_changes == 2
    assert found.source == "in memory"


def test_a_sound_log_is_fit_for_the_job():
    force = np.tile([0.0, 0.0, -9.81], (600, 1))
    channels = {"attitude": LEVEL, "wrench": WAVES, "acceleration": WAVES, "specific_force": force}
    judged = report_quality(Log.from_arrays(TIME, WAVES, **channels))
    assert judged.verdict == "Suitable for identification."
    assert judged.frame.startswith("FRD by 99 %: 100% of the specific force points towards -z")
    assert judged.recorded == ("attitude", "acceleration", "wrench", "specific_force")


def test_a_planar_log_has_no_direction_of_z_and_minor_issues_need_no_remedy():
    waves = np.zeros((600, 6))
    waves[:, [0, 1, 5]] = np.sin(np.outer(TIME, [0.3, 0.6, 0.9]))
    log = Log.from_arrays(TIME, waves, attitude=LEVEL)
    six = Requirements(("u", "v", "w", "p", "q", "r"))
    assert "The direction of z is undetermined" in report_quality(log, six).verdict
    planar = report_quality(log, Requirements(("u", "v", "r")))
    assert (planar.is_planar, planar.frame) == (True, "")
    assert planar.is_usable
    assert planar.verdict == "Suitable for identification."
    minor = QualityIssue("yaw", "outliers", "3 samples", "", "", is_minor=True)
    stated = replace(planar, issues=(minor,)).verdict
    assert stated == f"{planar.verdict} The quality issues are minor."


@pytest.mark.parametrize("length", [None, 0.3])
def test_speeds_too_large_for_an_estimated_length_are_a_minor_issue(length):
    """A ship model at 0.3 m/s may be 3 m long, where a position leaps at 5 m/s."""
    velocity, place = 0.3 * np.abs(WAVES) * (1, 1, 0, 0, 0, 1), np.zeros((600, 3))
    place[:, 0] = np.cumsum(velocity[:, 0]) * 0.1 + 0.5 * (TIME > 30)
    log = Log.from_arrays(TIME, velocity, attitude=LEVEL, position=place)
    issues = report_quality(log, Requirements(("u", "v", "r"), length=length)).issues
    (leap,) = (issue for issue in issues if issue.channel == "position")
    assert leap.is_minor == ("--vehicle" in leap.remedy) == (length is None)


def test_gains_of_models_are_the_actuation_of_a_vehicle_without_actuators():
    log = Log.from_arrays(TIME, WAVES, attitude=LEVEL, commands={"throttle": WAVES[:, 0]})
    bare = replace(hd.fleet["bluerov2"], actuators=())
    gains = hd.catalog["linear"].with_terms({"X": "throttle"})
    message = "has no actuators"
    assert any(message in text for text in find_requirements(bare, log).reservations)
    with_gains = find_requirements(bare, log, [gains])
    assert not any(message in text for text in with_gains.reservations)
    assert not with_gains.missing


def test_the_draft_is_tried_before_a_preset():
    rng = np.random.default_rng(1)
    columns = {name: rng.standard_normal(600) for name in ("u", "v", "w", "p", "q", "r")}
    columns |= {f"{name}_rad": 0.1 * np.sin(TIME) for name in ("roll", "pitch", "yaw")}
    names = ("forward", "lateral", "heave", "roll", "pitch", "yaw")
    columns |= {f"ch_{name}": np.sign(np.sin(TIME)) for name in names}
    table = Topic("", None, {"time_s": TIME, **columns})
    recording = Recording((table,), "run.csv", "text in columns")
    found = probe(recording)
    assert [one.name for one in found.presets] == ["bluerov2-kth"]
    assert inspect(found, [recording]).mapping == "by the draft"


def test_a_current_is_minded():
    """Through the water 1 m/s straight ahead on turning headings, 0.3 m/s of tide to the east."""
    rng = np.random.default_rng(2)
    time = np.arange(0.0, 1200.0, 0.5)
    yaw = 0.02 * time
    ground = 1.0 + 0.3j * np.exp(-1j * yaw)
    noise = 0.01 * rng.standard_normal((2, len(time)))
    motion = {"u": ground.real + noise[0], "v": ground.imag + noise[1], "r": 0.02 + 0 * time}
    attitude = quaternion_from_euler(np.column_stack((0 * yaw, 0 * yaw, yaw)))
    log = Log.from_arrays(time, motion, attitude=attitude)
    (said,) = [each for each in report_quality(log).remarks if "current" in each]
    assert all(each in said for each in ("0.3 m/s", "`subtract_current`"))


@pytest.mark.parametrize("has", [True, False])
def test_what_can_be_derived_is_counted(has):
    yaw = np.sin(TIME)
    attitude = quaternion_from_euler(np.column_stack((0 * yaw, 0.2 * np.cos(0.6 * TIME), yaw)))
    said = report_quality(Log.from_arrays(TIME, {"u": yaw}, attitude=attitude if has else None))
    assert any("yaw" in each for each in said.identifiable) is has


def test_a_suspicion_of_a_step_that_is_there_says_so():
    log = report_quality(Log.from_arrays(TIME, {"u": np.sin(TIME)}))
    one = QualityIssue("yaw", "leaps", "once", fix=Fix("step", "remove_attitude_outliers"))
    found = omit_applied_steps(replace(log, issues=(one,)), (remove_attitude_outliers,))
    assert "`remove_attitude_outliers` of the mapping" in str(found.issues[0])
    assert "add `steps" not in str(found.issues[0])
    assert any("`rates_from_attitude`, `velocity" in each for each in log.missing)
    there = omit_applied_steps(log, (rates_from_attitude,))
    assert any("`rates_from_attitude` (already applied)" in each for each in there.missing)


def test_a_draft_cleans_a_pose_before_it_derives_rates():
    report = report_quality(Log.from_arrays(TIME, {"u": np.sin(TIME)}))
    steps = ("remove_outliers", "remove_attitude_outliers", "mask_frozen")
    issues = tuple(QualityIssue("yaw", "leaps", "once", fix=Fix("step", step)) for step in steps)
    for draft in ("steps: [rates_from_attitude]    # derived\n", "extends: avl690\n"):
        text = add_steps(draft, replace(report, issues=issues))
        (line,) = (each for each in text.splitlines() if each.startswith("steps"))
        assert line.split("    #")[0] == (
            "steps: [remove_attitude_outliers, mask_frozen, rates_from_attitude, remove_outliers]"
        )


def test_a_vehicle_that_pitches_is_no_boat():
    motion = {"u": 1.0 + 0.1 * np.sin(TIME), "v": 0.1 * np.cos(TIME), "r": 0.2 * np.sin(TIME)}
    for size, has_all in ((0.02, True), (0.4, False)):
        angles = np.column_stack((0 * TIME, size * np.sin(0.5 * TIME), 0 * TIME))
        attitude = quaternion_from_euler(angles)
        log = Log.from_arrays(TIME, motion, attitude=attitude, commands={"a": np.sin(TIME)})
        assert (not report_quality(log).missing) == has_all
