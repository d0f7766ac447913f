"""What lasts: junk by the thousand, and hours in which nothing happens."""

import gc
import tracemalloc

import numpy as np
import pytest

from hydrodamp.live.samples import rows_of
from hydrodamp.simulation.campaign.reenact import CampaignSetup, Motion


@pytest.mark.slow
def test_memory_does_not_grow(rows, run):
    row, tops = rows[0], []

    def endless():
        for k in range(3000):
            if k % 1000 == 0:
                gc.collect()  # Python keeps some hundred small tuples for later
                tops.append(tracemalloc.get_traced_memory()[0])
            yield {**row, "time": 0.1 * k, "u": 2.0 + 0.1 * (k % 7), "r": 0.01 * (k % 5)}

    tracemalloc.start()
    run(endless())
    tracemalloc.stop()
    assert tops[2] - tops[1] < 20_000


def straight(row, seconds, after):
    """Yield samples of a straight course at ten a second, with the noise of good sensors."""
    random = np.random.default_rng(13)
    still = dict.fromkeys("vwpqr", 0.0) | dict.fromkeys(("qx", "qy", "qz"), 0.0) | {"qw": 1.0}
    plan = CampaignSetup.of("sname")
    surge = Motion(plan.vehicle, plan.truth, np.array([row["rpm"]])).steady_surge[0]
    still |= {"rudder": 0.0, "elevator": 0.0, "u": surge, "rpm": row["rpm"], "segment": "line"}
    for k in range(10 * seconds):
        noise = (random.normal(size=6) * ([0.01] * 3 + [0.001] * 3)).tolist()
        moves = {name: still[name] + n for name, n in zip("uvwpqr", noise, strict=True)}
        yield {**still, **moves, "time": after + 0.1 * k}


@pytest.mark.slow
def test_a_straight_course_moves_no_estimate_out_of_its_interval(dive, run):
    rows = [*rows_of(dive[1])]
    before = run(rows).lines[-1]["coefficients"]
    line = straight(rows[0], 600, rows[-1]["time"] + 100.0)
    after = run([*rows, *line]).lines[-1]["coefficients"]
    for label, one in before.items():
        moved = abs(after[label]["value"] - one["value"])
        assert moved < 2 * after[label]["standard_error"], label
    drag = "X_u|u|"
    assert after[drag]["value"] == pytest.approx(before[drag]["value"], rel=0.01)
