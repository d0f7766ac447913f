"""Topics brought to one clock, against interpolating their channels with NumPy alone."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from interleaving import interleaved

from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import GapWarning
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.mapping.assemble import build_record

pytestmark = pytest.mark.usefixtures("one_core")
MESSAGES = 1_000_000
SECONDS = 2.0
"""What bringing ten topics of 1e6 messages to one clock may take."""


@pytest.fixture(scope="module")
def recording() -> Recording:
    """A Doppler log, a gyroscope, an attitude, a depth and six actuators, jittered at 100 Hz."""
    rng = np.random.default_rng(0)
    clocks = [
        np.arange(MESSAGES) * 0.01 + 0.001 * k + rng.uniform(0, 0.002, MESSAGES) for k in range(10)
    ]
    wave = [np.sin(0.1 * time) for time in clocks]
    still = np.zeros(MESSAGES)
    turned = {"w": np.cos(0.1 * wave[2]), "x": still, "y": still, "z": np.sin(0.1 * wave[2])}
    topics = [
        Topic("dvl", clocks[0], dict.fromkeys("uvw", wave[0])),
        Topic("gyro", clocks[1], dict.fromkeys("pqr", 0.002 * np.cos(0.1 * clocks[1]))),
        Topic(
            "attitude",
            clocks[2],
            {f"q.{component}": values for component, values in turned.items()},
        ),
        Topic("depth", clocks[3], {"d": wave[3]}),
        *(
            Topic(f"motor{k}", clocks[4 + k], {"set": np.sign(wave[4 + k]), "rpm": wave[4 + k]})
            for k in range(6)
        ),
    ]
    return Recording(tuple(topics), "bench.bag", "a benchmark")


@pytest.fixture(scope="module")
def mapping() -> LogMapping:
    motors = {f"{name}{k}": f"motor{k}.{name}" for k in range(6) for name in ("set", "rpm")}
    velocity = {name: f"dvl.{name}" for name in "uvw"} | {name: f"gyro.{name}" for name in "pqr"}
    return LogMapping.from_dict(
        {
            "time": "recorded",
            "attitude": {"quaternion": {"column": "attitude.q"}},
            "velocity": velocity,
            "position": {"depth": "depth.d"},
            "commands": motors,
        }
    )


def interpolate(recording: Recording) -> None:
    """Interpolate every channel and do nothing else: no gaps, no turning, no repair."""
    base = recording.topics[0].time
    for topic in recording.topics:
        for values in topic.fields.values():
            np.interp(base, topic.time, values)


def test_ten_topics_on_one_clock(benchmark, ledger, recording, mapping):
    """Clocks set right, gaps found, attitude turned, commands held: a record, not yet checked."""
    ours, alone = interleaved(
        benchmark,
        lambda: build_record(mapping, recording),
        lambda: interpolate(recording),
        rounds=3,
    )
    ledger.within("ten topics of 1e6 on one clock: np.interp of each channel", ours, alone)
    ledger.within("ten topics of 1e6 on one clock: what was asked for", ours, SECONDS, target=1.0)


def test_ten_topics_to_a_checked_log(benchmark, ledger, recording, mapping):
    """The same to the end: checked, cut and frozen."""

    def run_all() -> Log:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", GapWarning)
            return mapping.log(recording)

    ours, alone = interleaved(benchmark, run_all, lambda: interpolate(recording), rounds=3)
    ledger.within("ten topics of 1e6 to a checked log: np.interp of each channel", ours, alone)
