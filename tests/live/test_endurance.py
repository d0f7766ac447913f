"""What lasts: junk by the thousand, and hours in which nothing happens."""

import gc
import json
import tracemalloc
from itertools import islice

import numpy as np
import pytest

from hydrodamp.ingest.formats.mavlink import Decoder
from hydrodamp.ingest.mapping import read_mapping
from hydrodamp.live import readers
from hydrodamp.live.samples import rows_of
from hydrodamp.live.synchroniser import MessageSynchroniser, stream_mapping
from hydrodamp.simulation.campaign.reenact import CampaignSetup, Motion
from live.conftest import run_live


def received(parse, datagrams):
    """Return what a parser makes of datagrams."""
    return [item for data in datagrams for item in parse(data[: readers.MAX_DATAGRAM_SIZE])]


def junk(seed, n, good):
    """Return noise, other people's JSON, floods of NaN, and datagrams as large as they come."""
    random = np.random.default_rng(seed)
    for k in range(n):
        yield (
            random.bytes(int(random.integers(1, 300))),
            b"\xfd" + random.bytes(int(random.integers(1, 290))),
            json.dumps({**good, "u": float("nan")}).encode(),
            json.dumps({**good, "time": 1e300, "v": 1e308, "roll": [k], "qw": {}}).encode(),
            json.dumps([k]).encode(),
            b"{" * int(random.integers(1, 3000)),
            bytes(65_507),
        )[k % 7 if k % 70 else 6]


def among(rows, noise):
    """Yield samples as datagrams with junk before each."""
    each = len(noise) // len(rows)
    for k, row in enumerate(rows):
        yield from noise[k * each : (k + 1) * each]
        yield json.dumps(row).encode()


@pytest.mark.slow
def test_samples_among_junk_are_all_taken(dive):
    vehicle, log = dive
    rows = [*islice(rows_of(log), 300)]
    datagrams = [*among(rows, [*junk(11, 6000, rows[0])])]
    record = run_live(received(readers.parse_datagram, datagrams), vehicle)
    counts = record.counts
    assert counts["taken"] == 300
    assert sum(counts.values()) - counts["first"] - counts["again"] >= 6300
    assert counts["incomplete"] > 800
    assert len(record.messages) < 30


@pytest.mark.slow
def test_noise_at_the_port_of_mavlink_is_counted():
    noise = [*junk(12, 6000, {"time": 0.0})]
    decoder = Decoder()
    received_messages = received(readers.packet_parser(decoder), noise)
    mapping = stream_mapping(read_mapping("ardusub-mavlink"), print)
    synchroniser = MessageSynchroniser(mapping, print)
    rows = [row for row in synchroniser.synchronise(received_messages) if row is not None]
    assert rows == [{}] * len(rows)
    assert len(rows) >= 6000


@pytest.mark.slow
def test_memory_does_not_grow(dive):
    vehicle, log = dive
    row, tops = next(iter(rows_of(log))), []

    def endless():
        for k in range(3000):
            if k % 1000 == 0:
                gc.collect()  # Python keeps some hundred small tuples for later
                tops.append(tracemalloc.get_traced_memory()[0])
            yield {**row, "time": 0.1 * k, "u": 2.0 + 0.1 * (k % 7), "r": 0.01 * (k % 5)}

    tracemalloc.start()
    run_live(endless(), vehicle)
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
def test_a_straight_course_moves_no_estimate_out_of_its_interval(dive):
    vehicle, log = dive
    rows = [*rows_of(log)]
    before = run_live(rows, vehicle).lines[-1]["coefficients"]
    line = straight(rows[0], 600, rows[-1]["time"] + 100.0)
    after = run_live([*rows, *line], vehicle).lines[-1]["coefficients"]
    for label, one in before.items():
        moved = abs(after[label]["value"] - one["value"])
        assert moved < 2 * after[label]["standard_error"], label
    drag = "X_u|u|"
    assert after[drag]["value"] == pytest.approx(before[drag]["value"], rel=0.01)
