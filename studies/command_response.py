"""Estimate the first-order lag of commands of every campaign of the benchmark and of measured logs.

    HYDRODAMP_DATA=DATA python studies/command_response.py [--page PAGE]

Each row compares the lag that the log was simulated with and the estimate of
:func:`~hydrodamp.identification.command_response.estimate_command_response`.
Where a simulated log has a wrench in place of commands, the wrench was held from sample to sample;
the row states whether ``probe`` says so.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import track

import hydrodamp as hd
from benchmark_campaign import Campaign, Sail
from benchmark_campaigns import campaigns
from benchmark_tables import table
from hydrodamp.identification.command_response import (
    estimate_command_response,
    interpolation_remarks,
)
from measured_splits import measured
from tables import replace_table

MARKS = ("<!-- command response -->", "<!-- end of command response -->")
"""Marks of the page between which the table stands."""

MODELS = ("prestero", "prestero+channels", "tanker", "tank", "steering")
"""Of each campaign, the first model with one of these names is identified."""

HEADER = ("log", "model", "true lag [s]", "estimate [s]", "95 % interval [s]", "z", "verdict")


def rows(campaign: Campaign) -> Iterator[list[str]]:
    """Yield the row of a campaign."""
    model = next((one for key in MODELS for one in campaign.models if one.key == key), None)
    if model is None or not (
        model.commands or campaign.vehicle.commands or campaign.train.wrench is not None
    ):
        return
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    name, truth = campaign.name.removeprefix("measured/"), true_lag(campaign)
    start = [name, f"`{model.key}`", "unknown" if truth is None else f"{truth:g}"]
    if campaign.train.wrench is not None:
        held = bool(interpolation_remarks(problem, model))
        yield [*start[:2], "", "", "", "", "wrench held" if held else "wrench: no difference"]
        return
    response = estimate_command_response(problem, model)
    low, high = response.intervals["lag"]
    verdict = "lag" if response.is_significant else "no lag"
    yield [
        *start,
        f"{response.estimates['lag']:.3f}",
        f"{low:.3f} to {high:.3f}",
        f"{response.significance:.1f}",
        verdict,
    ]


def true_lag(campaign: Campaign) -> float | None:
    """Return the lag of the simulated actuators [s]; None if the log is measured."""
    make = campaign.make
    if isinstance(make, Sail):
        return make.sea().plan.truth.fin_lag
    craft = getattr(make, "craft", None)
    return None if craft is None else float(craft().lag)


def main(
    page: Annotated[Path | None, typer.Option(help="Page to insert the table into.")] = None,
) -> None:
    """Estimate all lags and print the table."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    found = list(campaigns())
    if folder := os.environ.get("HYDRODAMP_DATA"):
        found = [one for one in found if isinstance(one.make, Sail) or hasattr(one.make, "craft")]
        repeated = "measured/bluerov2-"  # runs of the split measured/bluerov2
        found += [each for each in measured(Path(folder)) if not each.name.startswith(repeated)]
    body = [row for one in track(found, "estimate") for row in rows(one)]
    text = table(HEADER, body)
    if page is not None:
        replace_table(page, MARKS, text)
    typer.echo(text)


if __name__ == "__main__":
    typer.run(main)
