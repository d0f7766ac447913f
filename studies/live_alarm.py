"""Measure the alarm of a live run: ``python studies/live_alarm.py``.

A hundred campaigns in which nothing changes tell how often it rings for nothing. In others the
vehicle is another one after the first half: with a payload, fouled, with a fin or a thruster lost.
What a run is told of the vehicle stays the same.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

import hydrodamp as hd
from benchmark_campaigns import (
    SHIP_MODELS,
    THRUSTERS,
    joystick,
    noise,
    ship,
    tether,
    waves,
    zigzags,
)
from benchmark_crafts import Craft, Steered, heavy_rov, rov, sail
from benchmark_plans import Sea, crossflow, lagging, marginal, published, remus
from hydrodamp.arrays import FloatArray
from hydrodamp.live.estimator import LiveState, start, update
from hydrodamp.live.samples import Row, read_number, rows_of
from hydrodamp.simulation.campaign.conditions import Conditions
from hydrodamp.simulation.campaign.reenact import PAUSE
from hydrodamp.vehicle.actuators import Actuator
from tables import replace_table

PAGE = Path(__file__).parents[1] / "docs" / "explanation" / "change-detection.md"
"""Where the tables stand, between these marks."""

MARKS = ("<!-- vehicles -->", "<!-- end of vehicles -->")

DURATION = 150.0
"""Of each run [s]; six of them before the change and six after it."""

ARM = 0.13
"""Of the fin that is left, below the axis [m]."""

GRAVITY = 9.81


@dataclass(frozen=True)
class Change:
    """What happens to a vehicle: how, and how much of it."""

    kind: str
    share: float = 0.0

    def loaded(self, vehicle: hd.Vehicle) -> hd.Vehicle:
        """Return the vehicle with a payload at its origin, trimmed or heavy."""
        if not self.kind.startswith("payload"):
            return vehicle
        mass = vehicle.mass_matrix.copy()
        mass[range(3), range(3)] += self.share * vehicle.weight / GRAVITY
        heavy = self.share * vehicle.weight if self.kind == "payload, heavy" else 0.0
        return replace(vehicle, mass_matrix=mass, added_mass=None, weight=vehicle.weight + heavy)

    def finned(self, vehicle: hd.Vehicle) -> hd.Vehicle:
        """Return the vehicle with a part of the rudder lost, above the axis."""
        if self.kind != "actuator":
            return vehicle
        return replace(vehicle, actuators=tuple(map(self._left, vehicle.actuators)))

    def _left(self, one: Actuator) -> Actuator:
        if not isinstance(one, hd.Fin) or one.command != "rudder":
            return one
        force, left = dict(one.force), 1.0 - self.share
        roll = {"K": -ARM * self.share * force["Y"]}
        drag = {axis: left * gain for axis, gain in dict(one.drag).items()}
        return replace(
            one, force={axis: left * gain for axis, gain in force.items()} | roll, drag=drag
        )


@dataclass(frozen=True)
class Finned:
    """A vehicle with rudder, elevator and propeller, in its water."""

    sea: Callable[[], Sea]
    model: hd.DampingModel = hd.catalog["prestero"]

    @property
    def vehicle(self) -> hd.Vehicle:
        """What is told of it."""
        return self.sea().plan.vehicle

    def logs(self, change: Change, seeds: Sequence[int], conditions: Conditions) -> list[hd.Log]:
        """Return six runs a seed, those with a new heading first where something has changed."""
        plan = self.sea().plan
        runs = plan.training_runs + plan.test_runs
        runs = runs[::-1] if change.share else runs
        water = plan.truth
        if change.kind == "drag":
            water = replace(water, damping=dragged(water.damping, change.share))
        vehicle = change.finned(change.loaded(plan.vehicle))
        plan = replace(plan, vehicle=vehicle, truth=water, training_runs=runs, test_runs=runs[:1])
        return [one.train for one in plan.simulate(seeds, DURATION, conditions)]


def dragged(damping: hd.Damping, share: float) -> hd.Damping:
    more = {
        label: value * (1.0 + share if label.startswith("X") else 1.0)
        for label, value in damping.as_dict().items()
    }
    return hd.Damping.from_dict(damping.model, more)


@dataclass(frozen=True)
class Piloted:
    """An ROV or a ship."""

    make: Callable[[], Craft]
    steered: Callable[[int, int, float, float], Steered]
    model: hd.DampingModel
    speed: float = 0.0
    period: float = 0.1

    @property
    def vehicle(self) -> hd.Vehicle:
        """What is told of it."""
        return self.make().vehicle

    def logs(self, change: Change, seeds: Sequence[int], conditions: Conditions) -> list[hd.Log]:
        """Return six runs a seed."""
        craft = self.make()
        craft = replace(
            craft, vehicle=change.loaded(craft.vehicle), wrench=partial(_changed, craft, change)
        )
        return [self._log(craft, seed, conditions) for seed in seeds]

    def _log(self, craft: Craft, seed: int, conditions: Conditions) -> hd.Log:
        steered = self.steered(seed, 6, DURATION, self.period)
        speeds = [self.speed] * 6
        return sail(craft, steered, speeds, seed, DURATION, conditions, self.period).measured


def _changed(craft: Craft, change: Change, velocity: FloatArray, acting: FloatArray) -> FloatArray:
    """Return the wrench on an ROV that is fouled, or turns about with a part of its thrust."""
    if change.kind == "actuator":
        acting = acting * np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0 - change.share])
    wrench = craft.wrench(velocity, acting).copy()
    if change.kind == "drag":
        wrench[:, 0] += change.share * craft.wrench(velocity, 0.0 * acting)[:, 0]
    return wrench


World = Finned | Piloted

ROV = hd.catalog["fossen"].with_terms(THRUSTERS, key="fossen+channels")

WORLDS: dict[str, World] = {
    "re-enacted": Finned(published),
    "crossflow": Finned(crossflow),
    "remus": Finned(remus),
    "rov": Piloted(rov, joystick, ROV),
    "marginal": Finned(marginal),
    "lagging": Finned(lagging(published, 0.2)),
    "heavy rov": Piloted(heavy_rov, joystick, ROV),
    "tanker": Piloted(
        ship,
        zigzags((10, 10), (-20, 20), (30, 10), (-35, 20), (15, 5), (20, 10)),
        SHIP_MODELS[0],
        1.18,
        0.2,
    ),
}

CHANGED = ("re-enacted", "crossflow", "remus", "rov")
"""Worlds in which something changes."""

CHANGES = (
    Change("payload, trimmed", 0.05),
    Change("payload, trimmed", 0.2),
    Change("payload, heavy", 0.05),
    Change("drag", 0.05),
    Change("drag", 0.1),
    Change("drag", 0.2),
    Change("actuator", 0.2),
    Change("actuator", 0.5),
)

WHITE, COLOURED, NOISY = "white", "coloured, pushed", "white, 3x"


def conditions(world: str, kind: str) -> Conditions:
    """Return sensors' errors and pushes that are usual for a vehicle."""
    if kind != COLOURED:
        return noise(3.0 if kind == NOISY else 1.0)
    if "rov" in world:
        return tether(1.0, coloured=True)
    return waves(1.0, coloured=True) if world == "tanker" else noise(1.0, 1.0, coloured=True)


def told(
    state: LiveState | None, world: World, log: hd.Log, begins: float
) -> tuple[LiveState, list[float]]:
    """Return the state after a log that begins at a time, and when the alarm rang."""
    rang = []
    for row in _later(log, begins):
        if state is None:
            state = start(world.vehicle, world.model, "rls", row)
        before = state.alarm.changes
        state, _ = update(state, row)
        if state.alarm.changes > before:
            rang.append(state.validator.time)
    assert state is not None
    return state, rang


def _later(log: hd.Log, begins: float) -> Iterator[Row]:
    """Yield the rows of a log whose runs follow one another, the first at a time."""
    spans = [(log.time[part.start], log.time[part.stop - 1]) for part in log.segments]
    ends = np.cumsum([0.0, *(last - first + PAUSE for first, last in spans)])
    parts = {part.name: (ends[k] - spans[k][0]) for k, part in enumerate(log.segments)}
    for row in rows_of(log):
        name = str(row["segment"])
        time = read_number(row, "time") + begins + parts[name]
        yield {**row, "time": time, "segment": f"{begins:.0f} {name}"}


def quiet(seeds: dict[tuple[str, str], list[int]]) -> tuple[float, list[tuple[str, float]]]:
    """Return how long campaigns last in which nothing changes [h], and where an alarm rang."""
    hours, rang = 0.0, []
    for (name, kind), own in seeds.items():
        world, weather = WORLDS[name], conditions(name, kind)
        halves = [
            world.logs(Change("nothing"), [seed + half for seed in own], weather)
            for half in (0, HALF)
        ]
        for first, second in zip(*halves, strict=True):
            state, early = told(None, world, first, 0.0)
            state, late = told(state, world, second, state.validator.time + PAUSE)
            rang += [(f"{name}, {kind}", time) for time in early + late]
            hours += sum(part.n for part in (first, second)) * _period(first) / 3600.0
    return hours, rang


def _period(log: hd.Log) -> float:
    return float(np.median(log.steps))


HALF = 100_000
"""From the seed of a first half to that of the second."""


def changed(name: str, seeds: Sequence[int]) -> dict[Change, list[tuple[float, str] | None]]:
    """Return how long after each change the alarm rings in a world [s], and the axis it names."""
    world = WORLDS[name]
    found: dict[Change, list[tuple[float, str] | None]] = {change: [] for change in CHANGES}
    for kind in (WHITE, COLOURED):
        weather = conditions(name, kind)
        starts = [
            told(None, world, log, 0.0)[0] for log in world.logs(Change("nothing"), seeds, weather)
        ]
        for change in CHANGES:
            logs = world.logs(change, [seed + HALF for seed in seeds], weather)
            for state, log in zip(starts, logs, strict=True):
                begins = state.validator.time + PAUSE
                after, rang = told(state, world, log, begins)
                last = after.alarm.last
                ring = (rang[0] - begins, last.axes[0]) if rang and last else None
                found[change].append(ring)
    return found


def table(found: dict[str, dict[Change, list[tuple[float, str] | None]]]) -> str:
    """Return how many changes are found, the median delay [s] and the axes named, as Markdown."""
    lines = [f"| change | {' | '.join(found)} |", "|---" * (len(found) + 1) + "|"]
    for change in CHANGES:
        cells = [_cell(one[change]) for one in found.values()]
        lines.append(f"| {change.kind} {100 * change.share:.0f} % | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cell(rings: list[tuple[float, str] | None]) -> str:
    heard = [ring for ring in rings if ring]
    if not heard:
        return f"0 of {len(rings)}"
    axes = ", ".join(sorted({axis for _, axis in heard}, key="XYZKMN".index))
    return f"{len(heard)} of {len(rings)}, {np.median([t for t, _ in heard]):.0f} s, {axes}"


def main() -> None:
    """Measure, print, and put both on their page."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    seeds: dict[tuple[str, str], list[int]] = {}
    pairs = [(name, kind) for name in WORLDS for kind in (WHITE, COLOURED, NOISY)]
    for seed in range(100):
        seeds.setdefault(pairs[seed % len(pairs)], []).append(500 + seed)
    hours, rang = quiet(seeds)
    text = f"{len(rang)} false alarms in {hours:.0f} h of 100 quiet campaigns"
    print(text, *rang, sep="\n", flush=True)
    found = {}
    for name in CHANGED:
        found[name] = changed(name, (700, 701, 702))
        print(table({name: found[name]}), flush=True)
    replace_table(PAGE, MARKS, f"{text}.\n\n{table(found)}")


if __name__ == "__main__":
    main()
