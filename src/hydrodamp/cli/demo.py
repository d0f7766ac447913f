"""Command ``demo``: compare models on the paper's simulated campaign, or on a measured log."""

from __future__ import annotations

from pathlib import Path

import hydrodamp as hd
from hydrodamp.cli import inputs
from hydrodamp.cli.compare import compare, run_comparison
from hydrodamp.cli.output import WRONG_INPUT, check_out_folder, fail, print_results, run_provenance

#: The two methods of the paper, the second also with a memory, and the default method.
DEMO_METHODS = "ls,ai,ai-composite,recommended"

#: Log, vehicle and mapping of `demo --measured`, and what is identified from it.
MEASURED = Path(hd.__file__).parent / "beluga"
TRAIN, TEST = "0:200", "200:300"
MEASURED_MODELS, MEASURED_METHODS = "linear,prestero,fossen,general", "ls,recommended"


def demo(
    out: Path | None = None,
    seed: int = 0,
    truth: str = "sname",
    measured: bool = False,
    resume: bool = False,
    force: bool = False,
    verbose: bool = False,
    json: bool = False,
) -> None:
    """Simulate the experiment of the paper, identify all models and print Table I.

    With `--measured`, identify models from a log of the Beluga AUV, which the package contains.
    """
    from hydrodamp.validation.workflow import Study

    if measured:
        if (seed, truth) != (0, "sname"):
            fail("`--measured` excludes `--seed` and `--truth`: leave them out.", WRONG_INPUT)
        compare_measured(out, json, verbose=verbose, resume=resume, force=force)
        return
    check_out_folder(out, resume, force)
    campaign = hd.reenact(seed=seed, truth=truth)
    train, test = campaign.train, campaign.test
    if not json:
        names = (", ".join(segment.name for segment in log.segments) for log in (train, test))
        print_results(
            f"The paper's campaign, re-enacted on a simulated {campaign.vehicle.name} (seed "
            f"{seed}).\nTruth '{campaign.truth}': {campaign.note}\n"
            "Identified on {}; replayed on {}.\n".format(*names)
        )
    models, methods = inputs.list_models(None).models, inputs.list_methods(DEMO_METHODS)
    words = {"truth": campaign.truth, "note": campaign.note, "seed": str(seed)}
    problem = hd.prepare(campaign.vehicle, train, models)
    provenance = words | run_provenance(())
    study = Study(problem, train, test, models, methods, provenance=provenance)
    run_comparison(study, out, json, verbose=verbose, resume=resume, force=force)


def compare_measured(
    out: Path | None, json: bool, *, verbose: bool, resume: bool, force: bool
) -> None:
    """Compare models on the log of the package, two thirds to train and one to test."""
    if not json:
        print_results(
            "Beluga, an AUV of Vortex NTNU, with random pilot inputs in a towing tank "
            "(github.com/michoy/system_identification, MIT licence).\n"
            f"Log, mapping, vehicle and licence: {MEASURED}\n"
            f"Identified on {TRAIN} s; replayed on {TEST} s.\n"
        )
    compare(
        vehicle=str(MEASURED / "vehicle.yaml"),
        logs=[str(MEASURED / "random-1.csv")],
        train=[TRAIN],
        test=[TEST],
        models=MEASURED_MODELS,
        methods=MEASURED_METHODS,
        mapping=str(MEASURED / "mapping.yaml"),
        out=out,
        resume=resume,
        force=force,
        verbose=verbose,
        json=json,
    )
