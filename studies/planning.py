"""Compare planned dives with baseline campaigns of steps under true damping unlike the model.

    python studies/planning.py --dives 20 --out FOLDER

A dive is planned with the published set of the VT 690. Then it, and the baseline campaign of steps
of the same duration and envelope, are simulated with noise under damping that differs from the one
it was planned with: the published hydrodynamics with random errors of all coefficients (`off`),
crossflow strips in place of the quadratic terms (`crossflow`), and strips with fins whose inflow
depends on the drift angle (`drifting`). Every dive is identified by the recommended method.

Realised over predicted: the standard error that the fit of a simulated dive reports over the one
that the plan predicted, the median over coefficients of an axis and dives. Scatter: the standard
deviation of the estimates over dives, against the predicted. Gain: the geometric mean over
coefficients of the variance by steps over that by the plan, reported and scattered. Replay: the
RMS error (eq. 24) of fits on the test runs of the re-enacted campaign, the median over dives.
"""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import hydrodamp as hd
from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator, Trajectories
from hydrodamp.experiment_design.context import PlanningContext
from hydrodamp.experiment_design.ensemble import DampingEnsemble
from hydrodamp.experiment_design.plan import VERIFIED_MEMBERS, optimise
from hydrodamp.experiment_design.verification import (
    FeasibleDive,
    enforce_envelope,
    identify_simulated_logs,
)
from hydrodamp.files import save_json, save_text
from hydrodamp.progress import run_parallel
from hydrodamp.simulation.campaign.conditions import WHITE_NOISE, Truth
from hydrodamp.simulation.campaign.reenact import CampaignSetup

ENVELOPE = hd.Envelope(
    depth=(3, 20),
    bottom=30,
    area={"north": (-150, 150), "east": (-150, 150)},
    commands={
        name: {"lowest": -0.26, "highest": 0.26, "rate": 1.0} for name in ("rudder", "elevator")
    },
)
"""Constraints of both."""

SEED = 40
"""Seed of the noise."""


@dataclass(frozen=True)
class DiveStatistics:
    """Estimates and reported standard errors of dives, shape (dives, p), and replay errors."""

    estimates: FloatArray
    errors: FloatArray
    replays: FloatArray
    feasibility_rate: float


def simulator_of_truth(
    simulator: ClosedLoopSimulator, truth: str
) -> tuple[ClosedLoopSimulator, hd.Log]:
    """Return the simulator with the damping of a truth, and its test runs."""
    plan = CampaignSetup.of("sname" if truth == "off" else "crossflow")
    truth_model = plan.truth
    if truth == "off":
        rng = np.random.default_rng(7)
        values = truth_model.damping.coefficients
        off = replace(
            truth_model.damping, coefficients=values * (1 + 0.2 * rng.standard_normal(len(values)))
        )
        truth_model = replace(truth_model, damping=off)
    if truth == "crossflow":
        truth_model = replace(truth_model, drift_factor=0.0)
    truth_model = replace(truth_model, fin_lag=0.0)
    (campaign,) = replace(plan, truth=truth_model).simulate((SEED,), 100.0, WHITE_NOISE)
    simulator_with_truth = ClosedLoopSimulator.of(
        simulator.vehicle,
        simulator.autopilot,
        simulator.envelope,
        DampingEnsemble((truth_model.damping,), simulator.ensemble.model),
    )
    disturbance = _unmodelled_wrench(truth_model, simulator)
    return replace(simulator_with_truth, disturbance=disturbance), campaign.exact_test


def _unmodelled_wrench(
    truth: Truth, simulator: ClosedLoopSimulator
) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """Return the wrench of crossflow strips and of the drift angle at the fins."""
    fins = [item for item in simulator.vehicle.actuators if isinstance(item, hd.Fin)]
    indices = [simulator.autopilot.names.index(fin.command) for fin in fins]
    forces = np.array([[dict(fin.force).get(axis, 0.0) for axis in AXES] for fin in fins])

    def wrench(velocity: FloatArray, commands: FloatArray) -> FloatArray:
        angles = commands[:, indices]
        inflow = truth.effective_fins(velocity, angles) - angles
        u = velocity[:, :1]
        total = np.asarray((u * np.abs(u) * inflow) @ forces)
        return total if truth.strips is None else total + truth.strips.wrench(velocity)

    return wrench


def simulate_dives(
    simulator: ClosedLoopSimulator, candidate: FeasibleDive, test: hd.Log, dives: int
) -> DiveStatistics:
    """Simulate a dive with different noise, identify each, and replay the test runs."""
    setpoints = np.repeat(candidate.trajectories.setpoints[:, :1], dives, axis=1)
    overlays = np.repeat(candidate.overlays[:, None], dives, axis=1)
    trajectories = simulator.simulate((setpoints, overlays), SEED)
    violations = trajectories.limit_violations(simulator.envelope).values()
    worst = np.max([violation.max(axis=0) for violation in violations], axis=0)
    calls = [(simulator, trajectories.select([n]), test) for n in range(dives)]
    columns = zip(*run_parallel(_identify_dive, calls), strict=True)
    estimates, errors, replays = (np.array(column) for column in columns)
    return DiveStatistics(estimates, errors, replays, float(np.mean(worst <= 0.0)))


def _identify_dive(
    simulator: ClosedLoopSimulator, trajectories: Trajectories, test: hd.Log
) -> tuple[FloatArray, FloatArray, float]:
    model = simulator.ensemble.model
    log = trajectories.log(simulator.vehicle, simulator.autopilot.names)
    fit = hd.Recommended().identify(hd.prepare(simulator.vehicle, log, model), model)
    assert fit.damping.covariance is not None
    score = hd.score(hd.simulate(simulator.vehicle, fit.damping, test))
    error = np.nan if score.rms is None else score.rms
    return fit.damping.coefficients, np.sqrt(np.diag(fit.damping.covariance)), error


def study_model(key: str, duration: float, dives: int) -> dict[str, Any]:
    """Return the comparison for a model by truth."""
    begin = time.process_time(), time.perf_counter()
    context = PlanningContext.of(
        hd.fleet["vt690"], hd.catalog[key], duration, None, ENVELOPE, 0, "overlays"
    )
    steps = enforce_envelope(context, context.baseline)
    known = identify_simulated_logs(
        context.simulator, steps.trajectories.select(VERIFIED_MEMBERS), grading=False
    )
    candidate = optimise(context, known, steps)
    predicted = identify_simulated_logs(
        context.simulator, candidate.trajectories.select(VERIFIED_MEMBERS), grading=False
    ).std_errors
    took = time.process_time() - begin[0], time.perf_counter() - begin[1]
    axes = np.array([label[0] for label in context.model.labels])
    results: dict[str, Any] = {"seconds of CPU": took[0], "seconds": took[1]}
    for truth in ("off", "crossflow", "drifting"):
        simulator, test = simulator_of_truth(context.simulator, truth)
        by_plan, by_steps = (
            simulate_dives(simulator, dive, test, dives) for dive in (candidate, steps)
        )
        results[truth] = compare(predicted, by_plan, by_steps, axes)
        typer.echo(f"{key} {truth} {json.dumps(results[truth])}", err=True)
    return results


def compare(
    predicted: FloatArray, by_plan: DiveStatistics, by_steps: DiveStatistics, axes: np.ndarray
) -> dict[str, Any]:
    """Return ratios of standard errors and of scatter for a truth."""
    scatter = [dives.estimates.std(axis=0, ddof=1) for dives in (by_plan, by_steps)]
    reported = [np.sqrt(np.mean(dives.errors**2, axis=0)) for dives in (by_plan, by_steps)]
    return {
        "realised": _by_axis(axes, np.median(by_plan.errors, axis=0) / predicted, np.median),
        "scatter": _by_axis(axes, scatter[0] / predicted, np.median),
        "gain": _gain(reported),
        "gain by axis": _by_axis(axes, (reported[1] / reported[0]) ** 2, _mean),
        "gain of scatter": _gain(scatter),
        "gain of scatter by axis": _by_axis(axes, (scatter[1] / scatter[0]) ** 2, _mean),
        "replay": [_median(dives.replays) for dives in (by_plan, by_steps)],
        "diverged": [int(np.isnan(dives.replays).sum()) for dives in (by_plan, by_steps)],
        "feasibility_rate": [by_plan.feasibility_rate, by_steps.feasibility_rate],
    }


def _median(errors: FloatArray) -> float | None:
    """Return the median over dives, of which some diverged; None where all did."""
    return None if np.isnan(errors).all() else float(np.nanmedian(errors))


def _gain(pair: list[FloatArray]) -> float:
    return _mean((pair[1] / pair[0]) ** 2)


def _mean(values: FloatArray) -> float:
    return float(np.exp(np.mean(np.log(values))))


def _by_axis(
    axes: np.ndarray, values: FloatArray, of: Callable[[FloatArray], Any]
) -> dict[str, float]:
    return {
        axis: round(float(of(values[axes == axis])), 2) for axis in dict.fromkeys(axes.tolist())
    }


def table(results: dict[str, dict[str, Any]]) -> str:
    """Return all numbers as a table of Markdown."""
    lines = [
        "| model | truth | realised / predicted X Y Z K M N | gain X Y Z K M N | gain "
        "| of scatter | replay: plan, steps |",
        "|---|---|---|---|---|---|---|",
    ]
    for key, by_truth in results.items():
        for truth, entry in by_truth.items():
            if not isinstance(entry, dict):
                continue
            words = [
                " ".join(f"{value:.2f}" for value in entry["realised"].values()),
                " ".join(f"{value:.1f}" for value in entry["gain by axis"].values()),
                f"{entry['gain']:.1f}",
                f"{entry['gain of scatter']:.1f}",
                ", ".join("-" if value is None else f"{value:.3f}" for value in entry["replay"]),
            ]
            lines.append(f"| `{key}` | {truth} | " + " | ".join(words) + " |")
    return "\n".join(lines) + "\n"


def main(
    out: Annotated[Path, typer.Option(help="Folder for planning.md and planning.json.")],
    dives: Annotated[int, typer.Option(min=2, help="Number of dives of each.")] = 20,
    duration: Annotated[float, typer.Option(help="Duration of a dive [s].")] = 600.0,
    models: Annotated[
        str, typer.Option(help="Keys, separated by commas.")
    ] = "prestero,linear,fossen",
) -> None:
    """Compare planned dives with baseline campaigns under damping unlike the model."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    out.mkdir(parents=True, exist_ok=True)
    results = {}
    for key in models.split(","):
        results[key] = study_model(key, duration, dives)
        save_json(results, out / "planning.json")
        save_text(table(results), out / "planning.md")
    typer.echo(table(results))


if __name__ == "__main__":
    typer.run(main)
