"""``hydrodamp demo``: re-enact the experiment of the paper in simulation."""

from __future__ import annotations

from typing import Annotated

import hydrodamp as hd
from hydrodamp.cli import options
from hydrodamp.cli.output import print_results
from hydrodamp.cli.resolve import list_methods, list_models


def demo(
    out: options.OutFolder = None,
    seed: Annotated[int, options.option("demo-seed")] = 0,
    truth: Annotated[str, options.option("demo-truth")] = "sname",
    resume: options.Resume = False,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Simulate the experiment of the paper, identify all models and print Table I."""
    from hydrodamp.cli.comparison_run import Task, run_comparison
    from hydrodamp.cli.provenance import check_out_folder, run_provenance

    check_out_folder(out, (), resume, force)
    campaign = hd.reenact(seed=seed, truth=truth)
    if not json:
        train, test = (
            ", ".join(segment.name for segment in log.segments)
            for log in (campaign.train, campaign.test)
        )
        print_results(
            f"The paper's campaign, re-enacted on a simulated {campaign.vehicle.name} (seed "
            f"{seed}).\nTruth '{campaign.truth}': {campaign.note}\n"
            f"Identified on {train}; replayed on {test}.\n"
        )
    models, methods = list_models(None).models, list_methods(options.DEMO_METHODS)
    task = Task(campaign.vehicle, campaign.train, campaign.test, models, methods, out)
    words = {
        "truth": campaign.truth,
        "note": campaign.note,
        "seed": str(seed),
        **run_provenance(()),
    }
    run_comparison(task, words, resume, json)
