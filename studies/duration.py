"""Compute the seconds of log that determine each coefficient, for some manoeuvres.

    python studies/duration.py --page docs/explanation/results.md

With the Cramér-Rao bound b of 200 s of a manoeuvre, κ is determined (±25 %, 95 %) after
200 s (1.96 b / 0.25 κ)². The last row is the median of (standard error by `recommended` / b)².
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import hydrodamp as hd
from benchmark_tables import table
from hydrodamp.experiment_design.context import PlanningContext
from hydrodamp.experiment_design.guidance import Manoeuvre
from hydrodamp.experiment_design.optimise import ensemble_information
from hydrodamp.experiment_design.verification import identify_simulated_logs
from hydrodamp.identification.grades import MAX_RELATIVE_HALF_WIDTH, critical_value
from tables import replace_table

MARKS = ("<!-- duration -->", "<!-- end of duration -->")

SECONDS, MIN_SECONDS, MAX_SECONDS = 200.0, 20.0, 36_000.0
"""Duration of a manoeuvre, of one window of the information, and of the longest dive [s]."""

STRENGTHS: dict[str, Any] = {  # of speed, heading, depth, rudder and elevator
    "speed": ("steps", 0.5, 0.0, 0.0, 0.0, 0.0),
    "heading": ("steps", 0.0, 0.5, 0.0, 0.0, 0.0),
    "depth": ("steps", 0.0, 0.0, 0.4, 0.0, 0.0),
    "heading, depth": ("steps", 0.0, 0.5, 0.4, 0.0, 0.0),
    "all three": ("steps", 0.5, 0.5, 0.4, 0.0, 0.0),
    "multisine": ("multisine", 0.5, 0.2, 0.2, 0.8, 0.8),
}
"""Shape and strengths of each manoeuvre, as shares of the limits of the envelope."""


def duration_table() -> str:
    """Return seconds by coefficient and manoeuvre of the VT 690 with its published set."""
    damping = hd.published["vt690-sname2022"]
    damping = hd.Damping.from_dict(None, {k: v for k, v in damping.as_dict().items() if v})
    envelope = hd.Envelope(depth=(3, 25), bottom=30)
    problem = hd.fleet["vt690"], damping.model, SECONDS, damping
    context = PlanningContext.of(*problem, envelope, 0, "overlays")
    simulator, samples = context.simulator.with_members([0]), round(SECONDS / envelope.period)
    manoeuvres = [Manoeuvre(shape, 0.5, 0.4, tuple(rest)) for shape, *rest in STRENGTHS.values()]
    pairs = [each.setpoints(simulator.autopilot, envelope, samples) for each in manoeuvres]
    setpoints, overlays = (np.stack(arrays, axis=1) for arrays in zip(*pairs, strict=True))
    setpoints[:, :, 2] += envelope.mid_depth
    logs = simulator.simulate((setpoints, overlays), 0)
    information = ensemble_information(simulator, logs, context.time_scale)
    information += context.weak_prior_information
    bounds = np.sqrt(np.diagonal(np.linalg.inv(information), axis1=1, axis2=2))
    wanted = MAX_RELATIVE_HALF_WIDTH * np.abs(context.prior_coefficients) / critical_value()
    seconds = SECONDS * (bounds / wanted) ** 2
    dives = (logs.select([index]) for index in range(len(pairs)))
    fits = [identify_simulated_logs(simulator, dive, grading=False).std_errors for dive in dives]
    ratios = np.where(seconds < MAX_SECONDS, (fits / bounds) ** 2, np.nan)
    rows = [[f"`{label.replace('|', chr(92) + '|')}`", *map(_cell, column)]
            for label, column in zip(context.model.labels, seconds.T, strict=True)]  # fmt: skip
    last = ["`recommended` / bound", *(f"{ratio:.1f}" for ratio in np.nanmedian(ratios, axis=1))]
    return table(["coefficient", *STRENGTHS], [*rows, last])


def _cell(seconds: float) -> str:
    text = f"{float(f'{seconds:.2g}'):.0f}" if seconds <= MAX_SECONDS else "-"
    return text if seconds >= MIN_SECONDS else f"< {MIN_SECONDS:.0f}"


def main(page: Annotated[Path, typer.Option()]) -> None:
    """Write the table into a page."""
    replace_table(page, MARKS, duration_table())


if __name__ == "__main__":
    typer.run(main)
