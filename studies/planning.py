"""Sail planned dives and campaigns of steps on truths unlike the model, and compare.

    python studies/planning.py --dives 20 --out FOLDER

A dive is planned with the published set of the VT 690. Then it, and the campaign of steps of the
same length in the same envelope, are sailed with noise in waters that are not the one it was
planned with: the published hydrodynamics with every coefficient off as a draw says (`off`),
crossflow strips in place of the quadratic terms (`crossflow`), and strips with fins that meet the
drift (`drifting`). Every dive is identified by the recommended method.

Realised over predicted: the standard error that the fit of a sailed dive reports over the one that
the plan predicted, the median over coefficients of an axis and dives. Scatter: the standard
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
from hydrodamp.experiment_design.closed_loop import (
    ClosedLoopSimulator,
    Trajectories,
    limit_violations,
)
from hydrodamp.experiment_design.context import PlanningContext
from hydrodamp.experiment_design.ensemble import DampingEnsemble
from hydrodamp.experiment_design.feasibility import CandidateDive, enforce_envelope
from hydrodamp.experiment_design.plan import VERIFIED_MEMBERS, optimise
from hydrodamp.experiment_design.verification import verify
from hydrodamp.files import save_json, save_text
from hydrodamp.simulation.campaign.reenact import CampaignSetup
from hydrodamp.simulation.campaign.truth import Truth
from hydrodamp.simulation.parallel import run_parallel

ENVELOPE = hd.Envelope(
    depth=(3, 20),
    bottom=30,
    area={"north": (-150, 150), "east": (-150, 150)},
    commands={
        name: {"lowest": -0.26, "highest": 0.26, "rate": 1.0} for name in ("rudder", "elevator")
    },
)
"""What both may do."""

SEED = 40
"""Of the noise of the first dive."""


@dataclass(frozen=True)
class Sailed:
    """Estimates and reported standard errors of dives, shape (dives, p), and replay errors."""

    estimates: FloatArray
    errors: FloatArray
    replays: FloatArray
    within: float


def simulator_of_truth(
    simulator: ClosedLoopSimulator, truth: str
) -> tuple[ClosedLoopSimulator, hd.Log]:
    """Return the vehicle in the water of a truth, and its test runs."""
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
    (campaign,) = replace(plan, truth=truth_model).simulate((SEED,), 100.0, hd.WHITE_NOISE)
    made = ClosedLoopSimulator.of(
        simulator.vehicle,
        simulator.autopilot,
        simulator.envelope,
        DampingEnsemble((truth_model.damping,), simulator.ensemble.model),
    )
    return replace(
        made, disturbance=_unmodelled_wrench(truth_model, simulator)
    ), campaign.exact_test


def _unmodelled_wrench(
    truth: Truth, simulator: ClosedLoopSimulator
) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """Return what strips make, and fins that meet the drift."""
    fins = [one for one in simulator.vehicle.actuators if isinstance(one, hd.Fin)]
    places = [simulator.autopilot.names.index(one.command) for one in fins]
    forces = np.array([[dict(one.force).get(axis, 0.0) for axis in hd.AXES] for one in fins])

    def wrench(velocity: FloatArray, commands: FloatArray) -> FloatArray:
        angles = commands[:, places]
        more = truth.effective_fins(velocity, angles) - angles
        u = velocity[:, :1]
        made = (u * np.abs(u) * more) @ forces
        return made if truth.strips is None else made + truth.strips.wrench(velocity)

    return wrench


def sailed(
    simulator: ClosedLoopSimulator, candidate: CandidateDive, test: hd.Log, dives: int
) -> Sailed:
    """Sail a dive so many times, identify each, and replay the test runs with each fit."""
    setpoints = np.repeat(candidate.trajectories.setpoints[:, :1], dives, axis=1)
    overlays = np.repeat(candidate.overlays[:, None], dives, axis=1)
    trajectories = simulator.simulate((setpoints, overlays), SEED)
    far = [one.max(axis=0) for one in limit_violations(simulator.envelope, trajectories).values()]
    done = run_parallel(_one, [(simulator, trajectories.select([n]), test) for n in range(dives)])
    estimates, errors, replays = (np.array(one) for one in zip(*done, strict=True))
    return Sailed(estimates, errors, replays, float(np.mean(np.max(far, axis=0) <= 0.0)))


def _one(
    simulator: ClosedLoopSimulator, trajectories: Trajectories, test: hd.Log
) -> tuple[FloatArray, FloatArray, float]:
    model = simulator.ensemble.model
    log = trajectories.log(simulator.vehicle, simulator.autopilot.names)
    fit = hd.Recommended().identify(hd.prepare(simulator.vehicle, log, model), model)
    assert fit.damping.covariance is not None
    score = hd.score(hd.simulate(simulator.vehicle, fit.damping, test))
    error = np.nan if score.rms is None else score.rms
    return fit.damping.coefficients, np.sqrt(np.diag(fit.damping.covariance)), error


def studied(key: str, duration: float, dives: int) -> dict[str, Any]:
    """Return what came out for a model, truth by truth."""
    begin = time.process_time(), time.perf_counter()
    context = PlanningContext.of(
        hd.fleet["vt690"], hd.catalog[key], duration, None, ENVELOPE, 0, "overlays"
    )
    steps = enforce_envelope(context, context.baseline)
    known = verify(context.simulator, steps.trajectories.select(VERIFIED_MEMBERS), grading=False)
    candidate = optimise(context, "determinant", known, steps)
    predicted = verify(
        context.simulator, candidate.trajectories.select(VERIFIED_MEMBERS), grading=False
    ).std_errors
    took = time.process_time() - begin[0], time.perf_counter() - begin[1]
    axes = np.array([label[0] for label in context.model.labels])
    found: dict[str, Any] = {"seconds of CPU": took[0], "seconds": took[1]}
    for truth in ("off", "crossflow", "drifting"):
        simulator, test = simulator_of_truth(context.simulator, truth)
        by_plan, by_steps = (sailed(simulator, one, test, dives) for one in (candidate, steps))
        found[truth] = told(predicted, by_plan, by_steps, axes)
        typer.echo(f"{key} {truth} {json.dumps(found[truth])}", err=True)
    return found


def told(
    predicted: FloatArray, by_plan: Sailed, by_steps: Sailed, axes: np.ndarray
) -> dict[str, Any]:
    """Return the numbers of a truth."""
    scatter = [one.estimates.std(axis=0, ddof=1) for one in (by_plan, by_steps)]
    reported = [np.sqrt(np.mean(one.errors**2, axis=0)) for one in (by_plan, by_steps)]
    return {
        "realised": _by_axis(axes, np.median(by_plan.errors, axis=0) / predicted, np.median),
        "scatter": _by_axis(axes, scatter[0] / predicted, np.median),
        "gain": _gain(reported),
        "gain by axis": _by_axis(axes, (reported[1] / reported[0]) ** 2, _mean),
        "gain of scatter": _gain(scatter),
        "gain of scatter by axis": _by_axis(axes, (scatter[1] / scatter[0]) ** 2, _mean),
        "replay": [_middle(one.replays) for one in (by_plan, by_steps)],
        "diverged": [int(np.isnan(one.replays).sum()) for one in (by_plan, by_steps)],
        "within": [by_plan.within, by_steps.within],
    }


def _middle(errors: FloatArray) -> float | None:
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


def table(found: dict[str, dict[str, Any]]) -> str:
    """Return all numbers as a table of Markdown."""
    lines = [
        "| model | truth | realised / predicted X Y Z K M N | gain X Y Z K M N | gain "
        "| of scatter | replay: plan, steps |",
        "|---|---|---|---|---|---|---|",
    ]
    for key, by_truth in found.items():
        for truth, one in by_truth.items():
            if not isinstance(one, dict):
                continue
            words = [
                " ".join(f"{value:.2f}" for value in one["realised"].values()),
                " ".join(f"{value:.1f}" for value in one["gain by axis"].values()),
                f"{one['gain']:.1f}",
                f"{one['gain of scatter']:.1f}",
                ", ".join("-" if value is None else f"{value:.3f}" for value in one["replay"]),
            ]
            lines.append(f"| `{key}` | {truth} | " + " | ".join(words) + " |")
    return "\n".join(lines) + "\n"


def main(
    out: Annotated[Path, typer.Option(help="Folder for planning.md and planning.json.")],
    dives: Annotated[int, typer.Option(min=2, help="How many of each.")] = 20,
    duration: Annotated[float, typer.Option(help="Length of a dive [s].")] = 600.0,
    models: Annotated[
        str, typer.Option(help="Keys, join_setpoints by commas.")
    ] = "prestero,linear,fossen",
) -> None:
    """Sail planned dives and campaigns of steps on truths unlike the model."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    out.mkdir(parents=True, exist_ok=True)
    found = {}
    for key in models.split(","):
        found[key] = studied(key, duration, dives)
        save_json(found, out / "planning.json")
        save_text(table(found), out / "planning.md")
    typer.echo(table(found))


if __name__ == "__main__":
    typer.run(main)
