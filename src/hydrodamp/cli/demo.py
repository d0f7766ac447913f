"""``hydrodamp demo``: the paper's experiment, re-enacted."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.compare import deliver
from hydrodamp.cli.output import results

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
    resume: options.Resume = False,
    json: options.Json = False,
) -> None:
    """Re-enact the paper's experiment on a simulated vehicle and print its Table I."""
    from hydrodamp.cli.choose import choose_methods, choose_models
    from hydrodamp.cli.handing import hand_over
    from hydrodamp.cli.progress import progress
    from hydrodamp.cli.record import record
    from hydrodamp.cli.replacing import note_replaced
    from hydrodamp.cli.resume import OPTIONS, check_resume, go_on, options_in_words
    from hydrodamp.cli.run import Task, carry_out
    from hydrodamp.cli.targets import check_out_folder
    from hydrodamp.simulation.campaign.reenact import n_samples, reenact

    if out is not None:
        check_out_folder(out, ())
    said = {**record(()), OPTIONS: options_in_words({"--seed": str(seed), "--truth": truth})}
    earlier = check_resume(out, said) if resume else None
    if out is not None:
        note_replaced(out, said)
    with progress("sailing the campaign", n_samples()) as step:
        campaign = reenact(seed=seed, truth=truth, done=step)
    models, methods = choose_models(None), choose_methods(options.DEMO_METHODS)
    task = Task(campaign.vehicle, campaign.train, campaign.test, models, methods)
    if earlier is not None:
        task, said = go_on(earlier, task, said)
    words = {"truth": campaign.truth, "note": campaign.note, "seed": str(seed)}
    if not json:
        _introduce(campaign, seed)
    made = partial(deliver, campaign.vehicle, campaign.train)
    hand_over(carry_out(task), {**words, **said}, out, json, made)


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
