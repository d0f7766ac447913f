"""Which way is down: what decides it, in a canonical log and through a mapping."""

import numpy as np
import pytest

from hydrodamp.data.log import Log
from hydrodamp.ingest.inspection.probe import WITHOUT_MAPPING, inspect, probe
from hydrodamp.ingest.inspection.quality_report import report_quality
from hydrodamp.ingest.read import read_recording
from strangers import FLIP, Truth, name_columns, write

TRUTH = Truth()
UNDECIDED = "The direction of z is undetermined"
DEPTH, FORCE, NONE = {"depth": TRUTH.place[:, 2]}, "force", {}
MAPPING = """
frame: {frame}
time: time
attitude: {{roll: roll, pitch: pitch, yaw: yaw}}
velocity: {{u: u, v: v, w: w, p: p, q: q, r: r}}
position: {{depth: depth}}
commands: {{rudder: rudder}}
"""


def motion(turn):
    """Return the dive under its canonical names, y and z turned or not."""
    it, angles = TRUTH, name_columns("roll pitch yaw", TRUTH.angles * turn)
    both = name_columns("u v w p q r", np.hstack((it.body * turn, it.rates * turn)))
    return {"time": it.time, **angles, **both, "rudder": it.rudder}


def judged(folder, columns, mapping=None):
    recording = read_recording(write(folder / "a.csv", columns))
    if mapping is not None:
        (folder / "mapping.yaml").write_text(mapping, "utf-8")
        mapping = str(folder / "mapping.yaml")
    return inspect(probe(recording), [recording], mapping)


@pytest.mark.slow
@pytest.mark.parametrize("turn", [np.ones(3), FLIP], ids=["FRD", "FLU"])
@pytest.mark.parametrize("beside", [NONE, FORCE, DEPTH], ids=["nothing", "force", "depth"])
def test_a_canonical_log_with_z_up(turn, beside, tmp_path):
    columns = motion(turn)
    if beside == FORCE:
        columns |= name_columns("fx fy fz", TRUTH.force * turn)
    elif beside is DEPTH:
        columns |= DEPTH
    found = judged(tmp_path, columns).report
    if beside is NONE:
        assert UNDECIDED in found.verdict
        steps = np.random.default_rng(0).choice([-1.0, 1.0], 45).repeat(20)
        columns |= {"rudder": steps, "r": columns["r"] + 0.02 * np.cumsum(steps)}  # it turns
        found = judged(tmp_path, columns).report
        assert "increasing rudder moves the vehicle" in found.frame
        return
    assert UNDECIDED not in found.frame
    assert found.is_usable  # by the draft, which converts the axes
    assert (WITHOUT_MAPPING in found.remarks) == (turn[2] < 0)
    assert found.vertical_axis.body == "FRD"
    assert not found.issues
    assert all(one.command != "depth" for one in found.delays)


@pytest.mark.parametrize("frame", ["FRD", "FLU"])
def test_a_mapping_of_the_wrong_frame(frame, tmp_path):
    found = judged(tmp_path, motion(FLIP) | DEPTH, MAPPING.format(frame=frame)).report
    assert [one.channel for one in found.issues] == (["frame"] if frame == "FRD" else [])
    assert found.vertical_axis.is_sure


def test_positions_with_their_unit_are_no_commands(tmp_path):
    place = name_columns("x_m y_m z_m", TRUTH.place * FLIP)
    found = judged(tmp_path, motion(FLIP) | place).report
    assert WITHOUT_MAPPING in found.remarks
    assert found.is_usable
    assert "position" in found.recorded
    assert all("z_m" not in one for one in found.identifiable)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_wrench_against_its_sign(sign):
    """Heave with linear drag, driven by steps of a force that is recorded in either sign."""
    time = np.arange(0.0, 120.0, 0.1)
    force, heave = np.sign(np.sin(0.7 * time) + 0.4 * np.sin(1.9 * time)), np.zeros(len(time))
    for k in range(len(time) - 1):
        heave[k + 1] = heave[k] + 0.1 * (0.2 * force[k] - 0.5 * heave[k])
    wrench = np.outer(sign * 10 * force, (0, 0, 1, 0, 0, 0))
    found = report_quality(Log.from_arrays(time, {"w": heave}, wrench=wrench))
    against = [one.channel for one in found.issues if one.problem == "acts against its sign"]
    assert against == ([] if sign > 0 else ["Z"])
