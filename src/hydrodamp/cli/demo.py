"""``hydrodamp demo``: the paper's experiment, re-enacted."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.compare import deliver
from hydrodamp.cli.output import note, results

if TYPE_CHECKING:
    from hydrodamp.simulation.campaign.reenact import Campaign


def demo(
    out: options.OutFolder = None,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Of the sensor noise.")] = 0,
    truth: Annotated[
        str,
        typer.Option(
            "--truth",
            metavar="[sname|crossflow]",
            help="The simulated vehicle's hydrodynamics: as published, or with strip-theory "
            "crossflow, farther from all eight models.",
        ),
    ] = "sname",
    json: options.Json = False,
) -> None:
    """Re-enact the paper's experiment on a simulated vehicle and print its Table I.

    No log is needed and nothing is downloaded. The eight models are identified
    by least squares, by the adaptive identifier and by the recommended method,
    then replayed on other runs.
    """
    from hydrodamp import kernels
    from hydrodamp.cli.choose import choose_methods, choose_models
    from hydrodamp.cli.experiment import fit_all
    from hydrodamp.cli.progress import progress
    from hydrodamp.cli.record import record
    from hydrodamp.cli.targets import check_out_folder
    from hydrodamp.simulation.campaign.reenact import reenact
    from hydrodamp.validation.compare import compare

    if out is not None:
        check_out_folder(out, ())
    if not kernels.COMPILED:
        note("the compiled core is missing: this may take minutes instead of seconds.")
    with progress("sailing the campaign"):
        campaign = reenact(seed=seed, truth=truth)
    models, methods = choose_models(None), choose_methods(options.DEMO_METHODS)
    with progress("identifying", len(methods) * len(models)) as done:
        fits = fit_all(campaign.vehicle, campaign.train, models, methods, done)
    with progress("replaying", len(fits)) as done:
        comparison = compare(fits, campaign.vehicle, campaign.test, done=done)
    said = {"truth": campaign.truth, "note": campaign.note, "seed": str(seed), **record(())}
    if not json:
        _introduce(campaign, seed)
    deliver(replace(comparison, provenance={**comparison.provenance, **said}), out, json)


def _introduce(campaign: Campaign, seed: int) -> None:
    """Say what is simulated, before the table."""
    console = results()
    train = ", ".join(segment.name for segment in campaign.train.segments)
    test = ", ".join(segment.name for segment in campaign.test.segments)
    console.print(
        f"The paper's campaign, re-enacted on a simulated {campaign.vehicle.name} (seed {seed}).\n"
        f"Truth '{campaign.truth}': {campaign.note}\n"
        f"Identified on {train}; replayed on {test}.\n",
        markup=False,
    )
