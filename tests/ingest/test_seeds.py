"""Measured logs renamed, resampled, in other units and files, a hundred times: right, or told."""

import warnings
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hydrodamp.ingest.inspection.probe import MIN_DRAFT_CONFIDENCE, probe
from hydrodamp.ingest.read import read_log, read_recording
from strangers import DEG, FLIP, clock, write

SEEDS = 100
ROWS = 700
SURE = 90  # %, below which probe says that the axes must be checked
STYLES = {
    "plain": ("u v w p q r", "roll pitch yaw", "north east down"),
    "words": ("surge sway heave roll_rate pitch_rate yaw_rate", "roll pitch heading", "x y depth"),
    "axes": ("vel_x vel_y vel_z gyro_x gyro_y gyro_z", "Roll Pitch Yaw", "pos_x pos_y pos_z"),
    "greek": ("u v w p q r", "phi theta psi", "x y z"),
    "dots": (
        "nav.velocity.x nav.velocity.y nav.velocity.z nav.rates.x nav.rates.y nav.rates.z",
        "nav.roll nav.pitch nav.yaw",
        "nav.position.x nav.position.y nav.position.z",
    ),
}


@cache
def base(folder, number):
    """Return one of the measured logs, a stretch of it."""
    positions = (
        ("bluerov2_kth/run_11_40_38.csv", "bluerov2-kth"),
        ("bluerov2_kth/run_11_57_50.csv", "bluerov2-kth"),
        ("campaigns/c21/estimation.csv", None),
        ("campaigns/c24/estimation.csv", None),
        ("kvlcc2_hsva/HSVA_CPMC_KVLCC2_Z_20_05.dat", "kvlcc2-hsva"),
        ("kvlcc2_hsva/HSVA_CPMC_KVLCC2_Z_10_10_P.dat", "kvlcc2-hsva"),
    )
    name, mapping = positions[number % len(positions)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        complete = read_log(folder / name, mapping)
    longest = max(complete.segments, key=len)
    return complete.select(longest.name)


def altered(log, seed, folder):
    """Write a log as somebody else might have."""
    rng = np.random.default_rng(seed)
    step = rng.choice([0.05, 0.1, 0.2])
    time = np.arange(0, min(log.duration, ROWS * step), step)
    index = np.unique(np.clip(np.searchsorted(log.elapsed, time + 1e-9) - 1, 0, log.n - 1))
    speeds, angles, positions = (names.split() for names in STYLES[rng.choice([*STYLES])])
    stated = bool(rng.integers(2))
    unit, factor = (("m/s", 1.0), ("kn", 0.514444444))[rng.integers(2) if stated else 0]
    turn, degrees = (("deg", DEG), ("rad", 1.0))[rng.integers(2)]
    euler, position = np.zeros((len(index), 3)), None
    if log.attitude is not None:
        euler = Rotation.from_quat(log.attitude[index], scalar_first=True).as_euler("ZYX")[:, ::-1]
    body = log.velocity[index]
    if log.position is not None and rng.integers(2):
        position = log.position[index]
    if rng.random() < 0.2:  # z up, about all axes
        body, euler = body * np.tile(FLIP, 2), euler * FLIP
        position = None if position is None else position * FLIP
    dropped = rng.choice(["", "", "", "pqr", "" if position is None else "uvw"])
    names = log.velocity_names
    kept = [name in names and name not in dropped for name in "uvwpqr"]
    groups = [(speeds[:3], body[:, :3] / factor, unit, kept[:3])]
    groups += [(speeds[3:], body[:, 3:] / degrees, f"{turn}/s", kept[3:])]
    if log.attitude is not None:
        groups.append((angles, euler / degrees, turn, ["p" in names, "p" in names, True]))
    if position is not None:
        groups.append((positions, position, "m", [True, True, "w" in names]))
    columns = {
        f"{name} [{text}]" if stated else name: values
        for labels, block, text, has in groups
        for name, values, has_it in zip(labels, block.T, has, strict=False)
        if has_it
    }
    columns |= {f"cmd_{name}": log.command(name)[index] for name in log.command_names}
    if log.wrench is not None:
        columns |= dict(zip("XYZKMN", log.wrench[index].T, strict=True))
    order = rng.permutation([*columns])
    clocks = (0.0, "t", 1.0), (1.7e9, "timestamp", 1.0), (5.0, "time_ms", 1e3)
    start, stamp, scale = clocks[rng.integers(3)]
    table = {stamp: (start + log.elapsed[index]) * scale} | {name: columns[name] for name in order}
    if rng.integers(5) == 0:
        table = {"Time": clock(80000 + log.elapsed[index])} | {
            name: columns[name] for name in order
        }
    separator = rng.choice([",", "\t", ";"])
    return write(folder / "log.csv", table, separator, "%.15g")


def amiss(found, log, known):
    """Return channels that are other than known, unless it is told that the axes may be."""
    at, messages = log.elapsed, []
    signs = [np.ones(6)]
    if found.roles.vertical_axis.confidence < SURE:
        signs.append(np.array([1.0, -1, -1, 1, -1, -1]))
    true = np.column_stack([np.interp(at, known.elapsed, item) for item in known.velocity.T])
    spread = np.maximum(known.velocity.std(axis=0), 1e-3)
    difference = min(
        (np.sqrt(np.mean((log.velocity - true * sign) ** 2, axis=0)) / spread for sign in signs),
        key=np.sum,
    )
    derived = "".join(
        note.partition(" from")[0] for note in log.notes if note.startswith("derived")
    )
    for k, name in enumerate("uvwpqr"):
        if name in derived.partition("`")[2]:
            continue  # as noisy as the attitude or the position
        if name in log.velocity_names and name in known.velocity_names and difference[k] > 0.02:
            messages.append(f"{name} by {difference[k]:.2g}")
        if name in known.velocity_names and name not in log.velocity_names:
            messages.append(f"no {name}")
    if log.attitude is not None and known.attitude is not None:
        near = np.searchsorted(known.elapsed, at).clip(0, known.n - 1)
        first, second = (
            Rotation.from_quat(it, scalar_first=True) for it in (log.attitude, known.attitude[near])
        )
        flip = Rotation.from_euler("X", [[180.0]], degrees=True)[0]
        sizes = [np.median((first * second.inv()).magnitude())]
        if len(signs) > 1:
            sizes.append(np.median((first * (flip * second * flip).inv()).magnitude()))
        if min(sizes) > 0.05:
            messages.append(f"attitude by {min(sizes):.2g}")
    return messages


@pytest.mark.slow
@pytest.mark.parametrize("part", range(10))
def test_seeds(part, tmp_path, measured_logs):
    data_folder = measured_logs("campaigns").parent
    for seed in range(part, SEEDS, 10):
        known = base(data_folder, seed)
        folder = tmp_path / str(seed)
        folder.mkdir()
        path = altered(known, seed, folder)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            recording = read_recording(path)
            probed = probe(recording)
            if probed.draft.confidence < MIN_DRAFT_CONFIDENCE:
                continue
            found = amiss(probed, probed.mapping().log(recording), known)
            assert found == [], f"{seed}\n{probed.draft.text}"
