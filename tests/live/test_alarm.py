"""Change detection: no alarm without a change, an alarm after one, and a resumed test."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.live.change_detection import THRESHOLD, CusumTest
from hydrodamp.live.samples import rows_of
from hydrodamp.simulation.campaign.conditions import WHITE_NOISE
from hydrodamp.simulation.campaign.reenact import CampaignSetup
from live.conftest import run_live

MASS, DRAG, CHANGED = 60.0, 3.0, 900

VEHICLE = hd.Vehicle("sled", np.diag([MASS] + [1.0] * 5), 0.0, 0.0, axes=("X",))


def push(time):
    return 25.0 + 20.0 * math.sin(time / 9.0) + 10.0 * math.sin(time / 31.0)


def sled(n, more=0.0, seed=0, noise=0.01, pull=push, u=0.0):
    """Yield a second each of a sled that is pushed to and fro; its drag grows at ``CHANGED``."""
    rng = np.random.default_rng(seed)
    for k in range(n):
        drag = DRAG * (1.0 + more * (k >= CHANGED))
        yield {"time": float(k), "u": u + noise * rng.standard_normal(), "X": pull(k)}
        for part in range(20):
            u += 0.05 * (pull(k + part / 20.0) - drag * u * abs(u)) / MASS


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_it_is_quiet_where_nothing_changes(seed):
    record = run_live(sled(1500, seed=seed), VEHICLE, output_interval=200.0)
    quiet = {"armed": ["X"], "not_armed": {}, "changes": 0, "last": None}
    assert record.lines[-1]["alarm"] == quiet
    assert "starting" in record.lines[0]["alarm"]["not_armed"]["X"]
    assert not record.messages


@pytest.mark.slow
@pytest.mark.parametrize("key", ["prestero", "linear"])
def test_it_names_the_axis_and_the_time_of_a_change(key):
    record = run_live(sled(1500, more=0.2), VEHICLE, model=hd.catalog[key])
    alarm = record.lines[-1]["alarm"]
    assert alarm["changes"] == 1
    assert alarm["last"]["axes"] == ["X"]
    assert CHANGED <= alarm["last"]["since"] < alarm["last"]["time"] < CHANGED + 60
    assert ["detected on X at" in message for message in record.messages] == [True]


@pytest.mark.slow
def test_an_axis_is_armed_again_after_a_change():
    lines = run_live(sled(1500, more=0.2), VEHICLE, output_interval=10.0).lines
    alarms = {line["time"] - CHANGED: line["alarm"] for line in lines}
    assert alarms[100.0]["not_armed"]["X"].startswith("starting")
    assert alarms[400.0]["armed"] == ["X"]


@pytest.mark.slow
def test_an_axis_with_much_noise_is_not_armed_and_says_so():
    alarm = run_live(sled(600, noise=0.3), VEHICLE).lines[-1]["alarm"]
    assert alarm["not_armed"]["X"].startswith("noise: it hides a change")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("turn", [450, 900])
def test_the_first_manoeuvre_after_a_transit_is_no_change(turn, seed):
    def pull(time):
        return 25.0 if time < turn else push(time - turn)

    steady = (25.0 / DRAG) ** 0.5
    record = run_live(sled(turn + 600, seed=seed, pull=pull, u=steady), VEHICLE)
    assert record.lines[-1]["alarm"]["changes"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_persistent_form_error_in_a_new_motion_of_small_force_is_no_change(seed):
    rng, test, peak = np.random.default_rng(seed), CusumTest(), 0.0
    for k in range(2000):
        amplitude, gain = (10.0, 1.0) if k < 1000 else (0.35, 1.2)
        terms = np.array([amplitude * math.sin(k / 9.0)])
        target = gain * terms[0] + 0.15 * rng.standard_normal()
        test = test.absorb(test.evidence.absorb(terms, target, 0.0, 0.0), terms, target, float(k))
        peak = max(peak, test.cusums.max())
    assert test.disarm_reason is None
    assert peak < THRESHOLD


@pytest.mark.slow
def test_an_axis_whose_model_lacks_terms_says_so():
    campaign = hd.reenact(seed=1, duration=150.0)
    model = hd.catalog["linear"]
    line = run_live(rows_of(campaign.train), campaign.vehicle, model=model).lines[-1]
    assert line["alarm"]["changes"] == 0
    assert "X" in line["model_form"]
    assert line["coefficients"]["X_u"]["standard_error"] is None


@pytest.mark.slow
@pytest.mark.parametrize("key", ["fossen", "linear"])
def test_a_new_propeller_speed_is_no_change(key):
    still = CampaignSetup.of("crossflow")
    runs = [replace(run, rpm=1800.0) for run in 3 * still.training_runs[:2]]
    plan = replace(still, training_runs=(*runs, replace(runs[0], rpm=2600.0)))
    campaign = plan.simulate((1,), 150.0, WHITE_NOISE)[0]
    record = run_live(rows_of(campaign.train), campaign.vehicle, model=hd.catalog[key])
    assert record.lines[-1]["alarm"]["changes"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["published", "crossflow"])
def test_first_manoeuvres_of_a_campaign_are_no_changes(kind):
    truth = "sname" if kind == "published" else kind
    campaign = hd.reenact(seed=2, duration=300.0, truth=truth)
    record = run_live(rows_of(campaign.train), campaign.vehicle)
    alarm = record.lines[-1]["alarm"]
    assert (alarm["changes"], set(alarm["armed"]) >= set("XYN")) == (0, True)


@pytest.fixture(scope="module")
def uninterrupted():
    rows = [*sled(1100, more=0.2)]
    return rows, run_live(rows, VEHICLE)


@pytest.mark.slow
@pytest.mark.parametrize("stop", [250, 350, CHANGED + 4, CHANGED + 80])
def test_change_detection_resumes_bit_for_bit(tmp_path, uninterrupted, stop):
    path, (rows, expected) = tmp_path / "state.json", uninterrupted
    first = run_live(itertools.islice(rows, stop), VEHICLE, checkpoint_path=path)
    second = run_live(rows[stop:], VEHICLE, checkpoint_path=path)
    assert second.lines[-1] == expected.lines[-1]
    tests = [record.run.state.alarm.axes[0] for record in (second, expected)]
    assert tests[0].cusums.tolist() == tests[1].cusums.tolist()
    assert first.messages + second.messages == expected.messages
