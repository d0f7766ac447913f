"""Logs of a vessel in many names, units, signs, frames and clocks: drafts are right, or refuse."""

import warnings
from collections import Counter
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.errors import HydrodampError
from hydrodamp.ingest.inspection.draft import SURE_CONFIDENCE
from hydrodamp.ingest.inspection.probe import inspect
from strangers import FLIP, write_columns

SEEDS, PARTS, STEP, N = 300, 10, 0.1, 600
MIN_RIGHT = 0.85
START = datetime(2024, 5, 13, 9, 59, 40, tzinfo=UTC)
KNOT = 1852.0 / 3600.0
EXAMPLES = Path(__file__).parents[2] / "examples"


def sail(rng):
    """Return time, u, v, r, heading, north and east."""
    time, phase = STEP * np.arange(N), rng.uniform(-np.pi, np.pi, 2)
    rate = 0.2 * np.sin(0.5 * time + phase[0]) + 0.1 * np.sin(0.13 * time + phase[1])
    heading = np.cumsum(STEP * rate) + rng.uniform(-3.0, 3.0)
    surge = 2.0 + 0.1 * np.sin(0.3 * time)
    sway = -0.5 * rate
    north = np.cumsum(STEP * (surge * np.cos(heading) - sway * np.sin(heading)))
    east = np.cumsum(STEP * (surge * np.sin(heading) + sway * np.cos(heading)))
    return time, surge, sway, rate, heading, north, east


def measured_sail(path):
    """Return the same of a measured log."""
    mapping = "kvlcc2-hsva" if path.suffix == ".dat" else EXAMPLES / "esso_osaka/mapping.yaml"
    log = hd.read_log(path, mapping)
    log = log.select(max(log.segments, key=len).name)
    heading = np.unwrap(euler_from_quaternion(log.attitude)[:, 2])
    return log.elapsed, *log.velocity.T[[0, 1, 5]], heading, *log.position.T[:2]


DAY = (START - datetime(1899, 12, 30, tzinfo=UTC)).total_seconds() / 86400.0
CLOCKS = (
    lambda time, _: {"time": time},
    lambda time, _: {"timestamp": START.timestamp() + time},
    lambda time, _: {"time_ms": 1e3 * time + 5e3},
    lambda _, moments: {
        "utc": [f"{each:%H%M%S}.{each.microsecond // 10000:02d}" for each in moments]
    },
    lambda _, moments: {"time": [each.isoformat() for each in moments]},
    lambda _, moments: {
        "Date": [f"{each:%d/%m/%Y}" for each in moments],
        "Time": [f"{each:%H:%M:%S}.{each.microsecond // 1000:03d}" for each in moments],
    },
    lambda time, _: {"datenum": [f"{DAY + each / 86400.0:.10f}" for each in time]},
    lambda time, _: {"time_us": [f"{x:.0f}" for x in (2**32 - 20_000_000 + 1e6 * time) % 2**32]},
    lambda time, _: {"tow (ms)": 320.0 + time},  # a header that says ms of seconds
)


def write_clock(rng, time):
    """Return columns of texts of a clock."""
    moments = [START + timedelta(seconds=each) for each in time.tolist()]
    return CLOCKS[rng.integers(len(CLOCKS))](time, moments)


def write_table(rng, path, motion):
    """Write a table of a motion."""
    time, surge, sway, rate, heading, north, east = motion
    columns = {}
    is_stated = bool(rng.integers(2))
    place = rng.choice(["none", "named", "ned", "enu", "geographic"])
    speed = rng.choice(["plain", "words", "velocities", "topics", "over ground"])
    if speed == "over ground" and place != "geographic":
        speed = "plain"
    turn, factor = (("rad", 1.0), ("deg", np.degrees(1.0)))[rng.integers(2)]
    names = {
        "plain": ("u", "v", "r"),
        "words": ("surge", "sway", "yaw_rate"),
        "velocities": ("surge_vel", "sway_vel", "yaw_vel"),
        "topics": ("u_speed", "v_speed", "r_speed"),
    }
    if speed == "over ground":
        course = heading + np.arctan2(sway, surge)
        columns["SOG (kn)"] = np.hypot(surge, sway) / KNOT
        columns["COG"] = np.degrees(course) % 360.0
        columns["ROT (deg/min)"] = 60.0 * np.degrees(rate)
        turn, factor = "deg", np.degrees(1.0)
    else:
        units = ("m/s", 1.0), ("cm/s", 100.0), ("kn", 1.0 / KNOT)
        unit, scale = units[rng.integers(3) * is_stated]
        for name, values in zip(names[speed], (surge, sway, rate), strict=True):
            text, size = (f"{turn}/s", factor) if values is rate else (unit, scale)
            columns[f"{name} [{text}]" if is_stated else name] = values * size
    convention = rng.choice(["true", "opposite", "mathematical", "south"])
    if place not in ("named", "geographic") or speed == "over ground":
        convention = "true"
    yaw = {"true": heading, "opposite": -heading, "mathematical": np.pi / 2 - heading}.get(
        convention, heading + np.pi
    )
    yaw = yaw % (2 * np.pi) if rng.integers(2) else (yaw + np.pi) % (2 * np.pi) - np.pi
    name = "heading" if place == "enu" else rng.choice(["yaw", "psi", "heading", "hdg"])
    columns[f"{name} [{turn}]" if is_stated else name] = yaw * factor
    if place == "geographic":
        latitude = rng.uniform(-60.0, 60.0)
        columns["lat"] = latitude + np.degrees(north / 6.371e6)
        columns["lon"] = 10.0 + np.degrees(east / 6.371e6 / np.cos(np.radians(latitude)))
    elif place != "none":
        pair = (east, north) if place == "enu" else (north, east)
        labels = ("x_north", "y_east") if place == "named" else ("x", "y")
        columns |= dict(zip(labels, pair, strict=True))
    columns["rudder_deg"] = np.degrees(-0.8 * rate)
    columns["rpm"] = 900.0 + 10.0 * np.sin(0.3 * time)
    columns = write_clock(rng, time) | columns
    cells = [
        each if isinstance(each, list) else [f"{value:.14g}" for value in each]
        for each in columns.values()
    ]
    separator = rng.choice([",", "\t", ";"])
    rows = [separator.join(columns), *(separator.join(row) for row in zip(*cells, strict=True))]
    path.write_text("\n".join(rows), encoding="utf-8")


def judge(path, motion):
    """Return whether the draft of a table is right, refused, flagged or wrong, and why."""
    recording = hd.read_recording(path)
    found = hd.probe(recording)
    judged = inspect(found, [recording])
    if judged.log is None:
        return "refused", judged.reason
    try:
        log = found.mapping().log(recording)
    except HydrodampError as error:
        return "refused", str(error)
    time, *speeds = motion[:4]
    step = np.median(np.diff(time))
    faults = [] if abs(np.median(log.steps) / step - 1.0) < 0.01 else ["step"]
    faults += [] if log.n > 0.9 * len(time) else ["samples"]
    for name, values in zip("uvr", speeds, strict=True):
        ours = log.velocity[:, "uvwpqr".index(name)]
        low, high = np.quantile(values, (0.1, 0.9))
        error = np.abs(np.quantile(ours, (0.1, 0.9)) - (low, high)).max()
        faults += [] if error < 0.05 * (high - low) else [name]
    if not faults:
        return "right", ""
    is_flagged = bool(judged.report.issues) or bool(judged.report.missing)
    return ("flagged" if is_flagged else "wrong"), " ".join(faults)


def count_outcomes(folder, seeds, motions):
    """Return how many drafts are right, refused or flagged; none is wrong without an issue."""
    outcomes = Counter[str]()
    for seed in seeds:
        rng, path = np.random.default_rng(seed), folder / f"{seed}.csv"
        motion = motions[seed % len(motions)] if motions else sail(rng)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", hd.HydrodampWarning)
            write_table(rng, path, motion)
            outcome, reason = judge(path, motion)
        assert outcome != "wrong", (seed, reason)
        outcomes[outcome] += 1
    return outcomes


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_drafts_are_right_or_refuse(tmp_path, part):
    outcomes = count_outcomes(tmp_path, range(part, SEEDS, PARTS), [])
    assert outcomes["right"] >= MIN_RIGHT * outcomes.total(), outcomes


@pytest.mark.slow
def test_drafts_of_measured_motions_are_right_or_refuse(tmp_path, measured_logs):
    tanks, ponds = measured_logs("kvlcc2_hsva"), measured_logs("esso_osaka")
    motions = [*map(measured_sail, [*tanks.glob("*_[12]0_*.dat"), *ponds.glob("zigzag*.csv")])]
    assert len(motions) > 9
    outcomes = count_outcomes(tmp_path, range(5 * len(motions)), motions)
    assert outcomes["right"] >= MIN_RIGHT * outcomes.total(), outcomes


@pytest.mark.slow
@pytest.mark.parametrize("sign", [1.0, FLIP], ids=["down", "up"])
def test_the_draft_of_a_measured_rov_is_right_but_for_an_unsure_vertical(
    tmp_path, measured_logs, sign
):
    log = hd.read_log(measured_logs("bluerov2_kth") / "run_11_40_38.csv", "bluerov2-kth")
    parts = *np.split(log.velocity, 2, 1), euler_from_quaternion(log.attitude)
    names = ["surge", "sway", "heave", "roll_rate", "pitch_rate", "yaw_rate"]
    names += ["roll", "pitch", "heading"]
    table = dict(zip(names, np.hstack([part * sign for part in parts]).T, strict=True))
    table = {"t": log.elapsed, **table, "u1": log.commands[:, 0]}
    recording = hd.read_recording(write_columns(tmp_path / "a.csv", table))
    probed = hd.probe(recording)
    drafted = probed.mapping().log(recording)
    true = log.velocity[np.searchsorted(log.elapsed, drafted.elapsed)]
    is_sure = probed.roles.vertical_axis.confidence >= SURE_CONFIDENCE
    signs = [1.0] if is_sure else [1.0, np.tile(FLIP, 2)]
    errors = [np.sqrt(np.mean((drafted.velocity - true * each) ** 2, axis=0)) for each in signs]
    assert any((each < 0.02 * true.std(axis=0)).all() for each in errors)
