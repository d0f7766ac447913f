"""Measured logs with fixed splits, and their table beside an earlier version of this project.

100 (1 - rmse/std) is the fit of a velocity over whole runs that are replayed open loop; the regret
is the RMS of equation 24 over that of the earlier version, same split, model and method. The method
``script`` has a form of its own, with free gains and without the vehicle file: an expert's script.
"""

from __future__ import annotations

import time
import tomllib
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import hydrodamp as hd
from benchmark_campaign import Campaign, Logs
from benchmark_campaigns import EXAMPLES, field_turns, field_vehicle, load_module, read_runs
from benchmark_tables import HORIZONS, Row, number, table
from expert_script import replay_script
from hydrodamp.basis.term import AXES
from hydrodamp.simulation.replay import Trajectory, score

SCRIPT = "script"
METHODS = ("weak", "oe", "recommended", SCRIPT)
EARLIER = Path(__file__).with_name("benchmark_afd9ded.toml")
BLUEROV2 = ("11_40_38", "11_57_50"), ("11_10_52", "11_46_03")
"""Runs to identify from, and runs that are replayed."""
LEAD = 3.0
"""Points of fit by which the script must be ahead for a mark."""


def measured(folder: Path) -> Iterator[Campaign]:
    """Yield the campaigns of the group ``measured`` whose files are in a folder."""
    if (place := folder / "bluerov2_kth").is_dir():
        train, test = ([place / f"run_{name}.csv" for name in names] for names in BLUEROV2)
        make = partial(read_runs, EXAMPLES / "bluerov2", train, test)
        yield Campaign("measured/bluerov2", _models("bluerov2", "tank"), make, "measured")
    if (place := folder / "vt690_field").is_dir():
        make = partial(_halves, place)
        yield Campaign("measured/vt690", _models("vt690", "steering"), make, "measured")
    if (place := folder / "esso_osaka").is_dir():
        make = partial(_pond, place)
        yield Campaign("measured/esso-osaka", _models("esso_osaka"), make, "measured")
    start = "HSVA_CPMC_KVLCC2_Z_"
    runs = sorted((folder / "kvlcc2_hsva").glob(f"{start}*.dat"))
    for held in runs:
        others = [run for run in runs if run != held]
        make = partial(read_runs, EXAMPLES / "kvlcc2", others, [held])
        name = f"measured/kvlcc2-{held.stem.removeprefix(start)}"
        yield Campaign(name, _models("kvlcc2", "fossen+rp", "tanker"), make, "measured")


def _models(example: str, *keys: str) -> tuple[hd.DampingModel, ...]:
    found = hd.read_models(EXAMPLES / example / "models.yaml")
    return tuple(model for model in found if not keys or model.key in keys)


def _pond(folder: Path) -> Logs:
    """Return the published split of the tests on a pond."""
    example = load_module(EXAMPLES / "esso_osaka" / "compare.py")
    vehicle = hd.read_vehicle(EXAMPLES / "esso_osaka" / "vehicle.yaml")
    train, test = example.split(folder)
    return Logs(vehicle, example.read(train), example.read(test))


def _halves(folder: Path) -> Logs:
    """Return the turns of the first half of the field log, and those of the second."""
    turns = field_turns(folder)
    middle = _middle(folder)
    train = [turn for turn in turns if turn.time[0] < middle]
    test = [turn for turn in turns if turn.time[0] >= middle]
    return Logs(field_vehicle(), hd.concatenate(train), hd.concatenate(test))


def _middle(folder: Path) -> float:
    """Return the time half-way through the field log."""
    time = hd.read_log(folder, EXAMPLES / "vt690" / "mapping.yaml").time
    return float(time[0] + time[-1]) / 2.0


def script_row(campaign: Campaign) -> Row:
    """Return the row of the script, with fins that act by the square of the speed on a ship."""
    axes = campaign.vehicle.axes
    train, test, began = campaign.train, campaign.test, time.process_time()
    places = [AXES.index(axis) for axis in axes]
    velocity = replay_script(train, test, places, has_fins="Z" not in axes)
    took, found = (
        time.process_time() - began,
        score(Trajectory(test, velocity, (), "measured", axes)),
    )
    rms: dict[str, float | None] = dict.fromkeys(HORIZONS) | {"run": found.rms}
    job = campaign.name, SCRIPT, SCRIPT
    return Row(*job, campaign.group, rms, "ok", False, took, fit=dict(found.fit_by_axis))


def measured_table(rows: Sequence[Row]) -> str:
    """Return the table of measured logs as Markdown."""
    earlier = {
        (one["campaign"], one["model"], one["method"]): one.get("rms")
        for one in tomllib.loads(EARLIER.read_text(encoding="utf-8"))["row"]
    }
    scripts = {row.campaign: row.fit for row in rows if row.method == SCRIPT}
    head = ("split", "model", "method", "RMS", "fit [%]", "RMS at afd9ded", "regret")
    lines = [
        _line(row, earlier.get(row.job), scripts.get(row.campaign, {}))
        for row in sorted(rows, key=lambda one: one.job)
    ]
    mark = f"Bold: the fit of `{SCRIPT}` on this split is more than {LEAD:g} points higher."
    return f"**Measured logs, whole runs**\n\n{table(head, lines)}\n\n{mark}\n"


def _line(row: Row, before: float | None, script: dict[str, float | None]) -> tuple[str, ...]:
    rms = row.rms["run"]
    fits = {axis: (one, script.get(axis)) for axis, one in row.fit.items() if one is not None}
    fit = ", ".join(
        f"**{axis} {one:.0f}**" if (other or 0.0) > max(one, 0.0) + LEAD else f"{axis} {one:.0f}"
        for axis, (one, other) in fits.items()
    )
    return (
        *(row.campaign.removeprefix("measured/"), f"`{row.model}`", f"`{row.method}`"),
        *("-" if rms is None else f"{rms:.3g}", fit or "-"),
        *("-" if before is None else f"{before:.3g}",),
        "-" if rms is None or before is None else number(rms / before),
    )
