"""Measured logs renamed, resampled, in other units and files, a hundred times: right, or told."""

import gzip
import warnings
from functools import cache

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from hydrodamp.ingest.inspection.probe import MIN_DRAFT_CONFIDENCE, probe
from hydrodamp.ingest.read import read_log, read_recording
from strangers import DEG, clock, write

SEEDS = 100
ROWS = 700
MIRROR = np.array([1.0, -1.0, -1.0])
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
    "arrays": (
        " ".join(f"nu[{k}]" for k in range(6)),
        "rpy[0] rpy[1] psi",
        " ".join(f"position[{k}]" for k in range(3)),
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
    index = np.clip(np.searchsorted(log.elapsed, time + 1e-9) - 1, 0, log.n - 1)
    ticks = log.elapsed[index]
    ticks, index = np.unique(ticks, return_index=True)[0], np.unique(index)
    style = rng.choice([*STYLES])
    speeds, angles, positions = (names.split() for names in STYLES[style])
    stated = bool(rng.integers(2))
    columns = {}
    unit, factor = rng.choice([("m/s", 1.0), ("kn", 0.514444444)]) if stated else ("m/s", 1.0)
    turn, degrees = (("deg", DEG), ("rad", 1.0))[rng.integers(2)]
    is_array = style == "arrays"

    def name(plain, unit):
        return f"{plain} [{unit}]" if stated and not is_array else plain

    if is_array:
        unit, factor, turn, degrees = "m/s", 1.0, "rad", 1.0
    euler = np.zeros((len(index), 3))
    if log.attitude is not None:
        euler = Rotation.from_quat(log.attitude[index], scalar_first=True).as_euler("ZYX")[:, ::-1]
    body, is_placed = log.velocity[index], log.position is not None and bool(rng.integers(2))
    position = None if log.position is None else log.position[index]
    if rng.random() < 0.2:  # z up, about all axes
        body, euler = body * np.tile(MIRROR, 2), euler * MIRROR
        position = None if position is None else position * MIRROR
    dropped = rng.choice(["", "", "", "pqr", "uvw" if is_placed else ""])
    if is_array and dropped == "pqr" and "w" in log.velocity_names:
        speeds = [f"velocities[{k}]" for k in range(6)]
    for k, plain in enumerate(speeds):
        if "uvwpqr"[k] in log.velocity_names and "uvwpqr"[k] not in dropped:
            scale, unit = (float(factor), unit) if k < 3 else (degrees, f"{turn}/s")
            columns[name(plain, str(unit))] = body[:, k] / scale
    if log.attitude is not None:
        for k, plain in enumerate(angles):
            if k == 2 or "p" in log.velocity_names:
                columns[name(plain, turn)] = euler[:, k] / degrees
    if is_placed and position is not None:
        for k, plain in enumerate(positions):
            if k < 2 or "w" in log.velocity_names:
                columns[name(plain, "m")] = position[:, k]
    for plain in log.command_names:
        columns[f"cmd_{plain}"] = log.command(plain)[index]
    if log.wrench is not None:
        columns |= dict(zip("XYZKMN", log.wrench[index].T, strict=True))
    order = rng.permutation(len(columns))
    shuffled = {key: columns[key] for key in np.array([*columns], object)[order]}
    return save(shuffled if not is_array else columns, ticks, rng, folder, is_array)


def save(columns, ticks, rng, folder, is_array):
    kinds = ["npz", "mat"] if is_array else ["csv", "tsv", "comma", "gz", "npz", "parquet", "day"]
    kind = str(rng.choice(kinds))
    start, unit, scale = [(0.0, "t", 1.0), (1.7e9, "timestamp", 1.0), (5.0, "time_ms", 1e3)][
        rng.integers(3)
    ]
    stamps = {unit: (start + ticks) * scale}
    path = folder / f"log.{kind}"
    if kind == "day":
        return write(folder / "log.csv", {"Time": clock(80000 + ticks), **columns})
    table = {**stamps, **columns}
    if kind == "parquet":
        arrow, parquet = (pytest.importorskip(f"pyarrow{tail}") for tail in ("", ".parquet"))
        parquet.write_table(arrow.table(table), path)
    elif kind in ("npz", "mat"):
        grouped = {}
        for key in table:
            stem = key.partition("[")[0] if is_array else key
            if stem not in grouped:
                tables = [
                    table[item]
                    for item in table
                    if item == key or (is_array and item.startswith(f"{stem}["))
                ]
                grouped[stem] = np.column_stack(tables).squeeze()
        np.savez(path, **grouped) if kind == "npz" else savemat(path, grouped)
    elif kind == "gz":
        plain = write(folder / "log.csv", table, form="%.15g")
        path = folder / "log.csv.gz"
        path.write_bytes(gzip.compress(plain.read_bytes()))
    else:
        sep = {"csv": ",", "tsv": "\t", "comma": ";"}[kind]
        path = write(folder / f"log.{'tsv' if kind == 'tsv' else 'csv'}", table, sep, "%.15g")
        if kind == "comma":
            path.write_text(path.read_text("utf-8").replace(".", ","), "utf-8")
    return path


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
            probed = probe(read_recording(path))
            if probed.draft.confidence < MIN_DRAFT_CONFIDENCE:
                continue
            assert amiss(probed, probed.mapping().log(read_recording(path)), known) == [], (
                f"{seed}\n{probed.draft.text}"
            )
