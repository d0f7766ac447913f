"""Measure what sensors at their own times cost: errors over the bound, coverage, replay error.

    python studies/sensors.py --draws 10 --out FOLDER [--data DATA] [--page PAGE]

A log is the replay of a model that was fitted to a simulated campaign, so model, mass matrix and
actuation are exact; `sname` is the vehicle of the paper with the terms of Prestero, `rov` a
BlueROV2 with a gain of each channel. Each draw adds white noise to the sensors of a mask. The bound
is that of `predict_standard_errors` at the true coefficients. FOLDER has one line a draw, and a
second call continues. With DATA, runs of a BlueROV2 are thinned to fixes of 1 Hz with noise, each
run held out in turn.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import hydrodamp as hd
from benchmark_crafts import CHANNELS, Joystick, rov, sail
from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.attitude import euler_from_quaternion, rotation_matrices
from hydrodamp.data.concatenation import concatenate
from hydrodamp.data.measurement import KINDS, Measurement
from hydrodamp.files import save_json
from hydrodamp.identification.information import predict_standard_errors
from hydrodamp.simulation.campaign.conditions import Conditions
from hydrodamp.simulation.replay import replay
from tables import replace_table

MARKS = "<!-- sensors -->", "<!-- end of sensors -->"
TANK_MARKS = "<!-- tank -->", "<!-- end of tank -->"

GYRO, DVL, DEPTH, FIX, HEADING, FORCE = 2e-3, 0.013, 0.02, 0.5, 5e-3, 0.05
"""Standard deviations [rad/s, m/s, m, m, rad, m/s^2]."""

GRAVITY = 9.80665


@dataclass(frozen=True)
class Case:
    """An exact log of a vehicle, the model and its true coefficients."""

    vehicle: hd.Vehicle
    log: hd.Log
    damping: hd.Damping


def exact_case(vehicle: hd.Vehicle, log: hd.Log, model: hd.DampingModel) -> Case:
    """Return the replay of a model that is fitted to an exact log."""
    problem = hd.prepare(vehicle, log, model)
    damping = hd.LeastSquares().identify(problem, model).damping
    motion = replay(problem, damping)
    return Case(vehicle, replace(log, velocity=motion.velocity, acceleration=None), damping)


def make_cases(seed: int) -> dict[str, tuple[Case, hd.Log]]:
    """Return the cases with a test log of each."""
    campaign = hd.reenact(seed=seed, duration=100.0)
    sname = exact_case(campaign.vehicle, campaign.exact_train, hd.catalog["prestero"])
    test = replace(campaign.exact_test, acceleration=None)
    craft, calm = rov(), Conditions(scale=0.0)
    pilots = (Joystick.drawn(seed + k, 4, 80.0, 0.1) for k in (0, 100))
    logs = [sail(craft, pilot, [0.0] * 4, seed, 80.0, calm, 0.1).exact for pilot in pilots]
    gains = dict(zip("XYZKMN", CHANNELS, strict=True))
    model = hd.catalog["fossen"].with_terms(
        {axis: (name,) for axis, name in gains.items()}, key="fossen-gains"
    )
    return {
        "sname": (sname, test),
        "rov": (exact_case(craft.vehicle, logs[0], model), replace(logs[1], acceleration=None)),
    }


class Mask:
    """Sensors of one draw: noise on the samples, and measurements at their own times."""

    def __init__(self, log: hd.Log, seed: int) -> None:
        self.log, self.rng = log, np.random.default_rng(seed)
        assert log.attitude is not None
        velocity, rotations = log.velocity, rotation_matrices(log.attitude)
        self.position = self._integrate(np.einsum("nij,nj->ni", rotations, velocity[:, :3]))
        self.euler = euler_from_quaternion(log.attitude)
        for start, stop in log.bounds.tolist():
            self.euler[start:stop] = np.unwrap(self.euler[start:stop], axis=0)
        rate = np.zeros_like(velocity)
        for start, stop in log.bounds.tolist():
            rate[start:stop] = np.gradient(velocity[start:stop], log.time[start:stop], axis=0)
        inner = np.cross(velocity[:, 3:], velocity[:, :3])
        self.force = rate[:, :3] + inner - GRAVITY * rotations[:, 2, :]

    def _integrate(self, rates: FloatArray) -> FloatArray:
        total = np.zeros_like(rates)
        for start, stop in self.log.bounds.tolist():
            step = np.diff(self.log.time[start:stop])[:, None]
            mean = 0.5 * (rates[start : stop - 1] + rates[start + 1 : stop])
            total[start + 1 : stop] = np.cumsum(step * mean, axis=0)
        return total

    def sensor(
        self, name: str, series: FloatArray, period: float, std: float, *components: str
    ) -> Measurement:
        """Return measurements of a series every period [s]."""
        kind = next(key for key, known in KINDS.items() if set(components) <= set(known))
        times, values, segment = [], [], []
        for number, (start, stop) in enumerate(self.log.bounds.tolist()):
            time = self.log.time[start:stop]
            moments = np.arange(time[0], time[-1], period)
            times.append(moments)
            values.append([np.interp(moments, time, each) for each in series[start:stop].T])
            segment.append(np.full(len(moments), number))
        table = np.hstack(values).T
        noisy = table + std * self.rng.standard_normal(table.shape)
        stds = np.full(len(components), std)
        return Measurement(
            name, kind, np.concatenate(times), noisy, components, stds, np.concatenate(segment)
        )

    def logs(self) -> Iterator[tuple[str, hd.Log]]:
        """Yield the log of each mask."""
        dvl = self.sensor("dvl", self.log.velocity[:, :3], 1.0, DVL, "u", "v", "w")
        fixes = self.sensor("usbl", self.position[:, :2], 1.0, FIX, "north", "east")
        depth = self.sensor("depth", self.position[:, 2:], 0.1, DEPTH, "down")
        heading = self.sensor("heading", self.euler[:, 2:], 0.2, HEADING, "yaw")
        attitude = self.sensor("ahrs", self.euler, 0.1, HEADING, "roll", "pitch", "yaw")
        force = self.sensor("accelerometer", self.force, 0.1, FORCE, "x", "y", "z")
        yield "all velocities", self.with_sensors("uvwpqr")
        yield "DVL 1 Hz, gyro", self.with_sensors("pqr", dvl)
        yield "USBL 1 Hz, depth, gyro", self.with_sensors("pqr", fixes, depth)
        yield "position, attitude, no gyro", self.with_sensors("", fixes, depth, attitude)
        yield "depth, gyro, accelerometer", self.with_sensors("pqr", depth, force)
        yield "position and heading, gyro p q", self.with_sensors("pq", fixes, depth, heading)

    def with_sensors(self, recorded: str, *sensors: Measurement) -> hd.Log:
        """Return the log with noisy velocities of some names, and sensors."""
        std = np.array([DVL] * 3 + [GYRO] * 3)
        noisy = self.log.velocity + std * self.rng.standard_normal(self.log.velocity.shape)
        noisy *= [name in recorded for name in VELOCITIES]
        names = tuple(name for name in VELOCITIES if name in recorded)
        return replace(self.log, velocity=noisy, velocity_names=names, measurements=sensors)


def measure(case: Case, test: hd.Log, log: hd.Log) -> dict[str, object]:
    """Return the errors of one fit over the bound, coverage of its intervals and replay fit."""
    model = case.damping.model
    problem = hd.prepare(case.vehicle, log, model)
    begin = time.process_time()
    fit = hd.OutputError().identify(problem, model)
    seconds = time.process_time() - begin
    truth = case.damping.coefficients
    bound = predict_standard_errors(problem, model, truth)["all sensors"]
    error = np.abs(fit.damping.coefficients - truth)
    uncertainty = fit.uncertainty
    half = np.full(len(truth), np.nan)
    if uncertainty is not None:
        half = uncertainty.critical_value() * uncertainty.standard_errors
    trial = hd.prepare(case.vehicle, test, model)
    motions = [replay(trial, each).velocity for each in (case.damping, fit.damping)]
    spread = np.std(motions[0], axis=0)
    rms = np.sqrt(np.nanmean((motions[1] - motions[0]) ** 2, axis=0)) / spread
    return {
        "status": fit.status.name,
        "ratio": (error / bound).tolist(),
        "covered": (error <= half).tolist(),
        "replay": rms[np.isfinite(rms)].tolist(),
        "cpu": seconds,
    }


TANK_RUNS = ("run_11_10_52", "run_11_40_38", "run_11_46_03", "run_11_57_50")
EXAMPLES = Path(__file__).parents[1] / "examples"


def fit_percent(damping: hd.Damping, vehicle: hd.Vehicle, test: hd.Log) -> list[float]:
    """Return 100 (1 - rmse/std) of each velocity of a replay."""
    motion = replay(hd.prepare(vehicle, test, damping.model), damping).velocity
    error = np.sqrt(np.nanmean((motion - test.velocity) ** 2, axis=0))
    spread = np.std(test.velocity, axis=0)
    return [
        100.0 * (1.0 - e / s) if s > 0.0 else np.nan for e, s in zip(error, spread, strict=True)
    ]


def tank(folder: Path, draws: int) -> Iterator[dict[str, object]]:
    """Yield the fit of each held-out BlueROV2 run, with all velocities and with thinned fixes."""
    home = EXAMPLES / "bluerov2"
    mapping, vehicle = (
        hd.read_mapping(home / "mapping.yaml"),
        hd.read_vehicle(home / "vehicle.yaml"),
    )
    logs = {name: hd.read_log(folder / f"{name}.csv", mapping) for name in TANK_RUNS}
    models = [each for each in hd.read_models(home / "models.yaml") if each.key in TANK_MODELS]
    for model in models:
        for held_out in TANK_RUNS:
            train = concatenate([logs[name] for name in TANK_RUNS if name != held_out])
            for std in (0.0, 0.1, 0.5):
                for draw in range(draws if std else 1):
                    mask = Mask(train, draw)
                    fixes = mask.sensor(
                        "usbl", mask.position[:, :2], 1.0, std or 1.0, "north", "east"
                    )
                    depth = mask.sensor("depth", mask.position[:, 2:], 0.2, DEPTH, "down")
                    velocity = train.velocity * [0, 0, 0, 1, 1, 1]
                    log = train if not std else replace(
                        train, velocity=velocity, velocity_names=("p", "q", "r"),
                        measurements=(fixes, depth),
                    )  # fmt: skip
                    fit = hd.OutputError().identify(hd.prepare(vehicle, log, model), model)
                    yield {
                        "case": f"BlueROV2, {model.key}, {held_out}", "mask": f"{std:g} m",
                        "draw": draw, "status": fit.status.name,
                        "fit": fit_percent(fit.damping, vehicle, logs[held_out])[:2],
                    }  # fmt: skip


TANK_MODELS = ("tank", "fossen+ch")


def measured_table(results: list[dict[str, object]]) -> str:
    """Return the fits of surge and sway by held-out run as Markdown."""
    masks = ("0 m", "0.1 m", "0.5 m")
    head = ("all velocities", "1 Hz, 0.1 m", "1 Hz, 0.5 m")
    rows = [f"| held out | {' | '.join(head)} |", "|---|---|---|---|"]
    for case in dict.fromkeys(each["case"] for each in results):
        cells = []
        for mask in masks:
            fits = np.array([
                each["fit"] for each in results if (each["case"], each["mask"]) == (case, mask)
            ])  # fmt: skip
            mean, low = np.mean(fits, axis=0), np.min(fits, axis=0)
            spread = f" ({low[0]:.0f}, {low[1]:.0f})" if len(fits) > 1 else ""
            cells.append(f"{mean[0]:.0f}, {mean[1]:.0f}{spread}")
        rows.append(f"| {case} | {' | '.join(cells)} |")
    return "\n".join(rows)


def run(
    out: Annotated[Path, typer.Option(help="Folder of the results.")],
    draws: int = 10,
    seed: int = 1,
    data: Annotated[Path | None, typer.Option(help="Folder with bluerov2_kth.")] = None,
    page: Annotated[Path | None, typer.Option(help="Page to insert the tables into.")] = None,
) -> None:
    """Run the draws that are missing, and print the tables."""
    out.mkdir(parents=True, exist_ok=True)
    path = out / "sensors.jsonl"
    lines = path.read_text("utf-8").splitlines() if path.is_file() else []
    results = [json.loads(line) for line in lines]
    finished = {(each["case"], each["mask"], each["draw"]) for each in results}
    with path.open("a", encoding="utf-8") as stream:
        for draw in range(draws):
            for name, (case, test) in make_cases(seed).items():
                for mask, log in Mask(case.log, 1000 * seed + draw).logs():
                    if (name, mask, draw) in finished:
                        continue
                    result = {"case": name, "mask": mask, "draw": draw, **measure(case, test, log)}
                    results.append(result)
                    stream.write(json.dumps(result) + "\n")
                    stream.flush()
    texts = {MARKS: table(results)}
    if data is not None:
        path = out / "tank.json"
        if not path.is_file():
            save_json([*tank(data / "bluerov2_kth", draws)], path)
        texts[TANK_MARKS] = measured_table(json.loads(path.read_text("utf-8")))
    for marks, text in texts.items():
        print(text)
        if page is not None:
            replace_table(page, marks, text)


def table(results: list[dict[str, object]]) -> str:
    """Return the results by case and mask as Markdown."""
    head = (
        "| case | sensors | draws | error / bound, median | 90 % | covered | replay error | CPU s |"
    )
    rows = [head, "|---|---|---|---|---|---|---|---|"]
    for case, mask in dict.fromkeys((each["case"], each["mask"]) for each in results):
        chosen = [each for each in results if (each["case"], each["mask"]) == (case, mask)]
        # |error| / bound has a median of 0.6745 where the bound is reached
        ratio = np.concatenate([each["ratio"] for each in chosen]) / 0.6745
        covered = np.mean(np.concatenate([each["covered"] for each in chosen]))
        error = np.median(np.concatenate([each["replay"] for each in chosen]))
        cpu = np.median([each["cpu"] for each in chosen])
        rows.append(
            f"| {case} | {mask} | {len(chosen)} | {np.median(ratio):.2f} | "
            f"{np.quantile(ratio, 0.9):.2f} | {100 * covered:.0f} % | {100 * error:.1f} % | "
            f"{cpu:.1f} |"
        )
    return "\n".join(rows)


if __name__ == "__main__":
    typer.run(run)
