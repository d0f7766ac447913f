"""A short simulated campaign, and the record of a live run over rows."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import partial
from itertools import islice

import pytest

import hydrodamp as hd
from hydrodamp.live.estimator import METHODS
from hydrodamp.live.runner import LiveRun
from hydrodamp.live.samples import rows_of
from hydrodamp.live.sources import open_source

MODEL = hd.catalog["prestero"]


@dataclass
class LiveRecord:
    """Estimate lines and messages of a live run."""

    lines: list = field(default_factory=list)
    messages: list = field(default_factory=list)
    run: LiveRun | None = None

    @property
    def counts(self):
        return {name: n for name, n in self.lines[-1]["counts"].items() if n}

    @property
    def coefficients(self):
        return [entry["value"] for entry in self.lines[-1]["coefficients"].values()]


def run_live(rows, vehicle, method="rls", model=MODEL, output_interval=1e9, **settings):
    """Run over rows; without an output interval, only the last estimate is emitted."""
    record = LiveRecord()

    def on_estimate(line):
        record.lines.append(json.loads(json.dumps(line, allow_nan=False)))

    settings["output_interval"] = output_interval
    record.run = LiveRun(vehicle, model, method, on_estimate, record.messages.append, **settings)
    record.run.process_rows(rows)
    return record


def open_stream(address, mapping=None, on_message=print):
    """Open a source of the same machine, as fast as it comes."""
    return open_source(address, mapping, allow_remote=False, real_time=False, on_message=on_message)


def angles(row):
    """Return a row with Euler angles that turn as the vehicle does."""
    others = {name: value for name, value in row.items() if name not in ("qw", "qx", "qy", "qz")}
    return others | {"roll": 0.02, "pitch": 0.1 * row["q"], "yaw": 0.5}


def wrench(row):
    others = {name: row[name] for name in row if name not in ("rudder", "elevator", "rpm")}
    return others | dict.fromkeys("XYZKMN", 0.0) | {"X": 1e-2 * row["rpm"], "eta": 1.2}


@pytest.fixture(scope="session")
def dive():
    """Four segments of 50 s, commands as recorded."""
    campaign = hd.reenact(seed=0, duration=50.0)
    return campaign.vehicle, campaign.train


@pytest.fixture(scope="session")
def rows(dive):
    """The first half minute of the dive, of one segment."""
    return [*islice(rows_of(dive[1]), 300)]


@pytest.fixture(scope="session")
def run(dive):
    """Run over rows of the vehicle of the dive."""
    return partial(run_live, vehicle=dive[0])


@pytest.fixture(scope="session")
def reference(dive):
    """The record of the whole dive by each method, with an estimate a second."""
    vehicle, log = dive
    return {
        method: run_live(rows_of(log), vehicle, method, output_interval=1.0) for method in METHODS
    }
