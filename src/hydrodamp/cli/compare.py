"""``hydrodamp compare``: every model by every method, on data they have not seen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from hydrodamp.cli import options
from hydrodamp.cli.guard import WORK_FAILED
from hydrodamp.cli.output import emit, fail, note, results

if TYPE_CHECKING:
    from hydrodamp.validation.comparison import Comparison


def compare(
    vehicle: options.VehicleName,
    logs: options.Logs = None,
    train: options.Train = None,
    test: options.Test = None,
    models: options.Models = None,
    methods: options.Methods = options.DEFAULT_METHOD,
    mapping: options.MappingFile = None,
    attitude: options.Attitude = options.AttitudeSource.measured,
    rate_unit: options.Rates = options.RateUnit.deg,
    out: options.OutFolder = None,
    json: options.Json = False,
) -> None:
    """Identify models on one part of the data, replay them on another, rank them."""
    from hydrodamp.cli.choose import choose_methods, choose_models, selects, with_sparse
    from hydrodamp.cli.experiment import check_attitude, check_before, check_samples, fit_all
    from hydrodamp.cli.progress import progress
    from hydrodamp.cli.record import record
    from hydrodamp.cli.select import train_and_test
    from hydrodamp.cli.targets import check_out_folder
    from hydrodamp.validation.compare import compare as compare_fits
    from hydrodamp.vehicle.fleet import find_vehicle

    listed = (*(logs or ()), *(train or ()), *(test or ()), *(models or "").split(","))
    inputs = (*(name.strip() for name in listed), vehicle, mapping)
    if out is not None:
        check_out_folder(out, inputs)
    craft, chosen, ways = find_vehicle(vehicle), choose_models(models), choose_methods(methods)
    learn, held_out, shared = train_and_test(logs or (), train or (), test or (), mapping)
    if selects(models):
        chosen = with_sparse(craft, learn, chosen)
    for log in (learn, held_out):
        check_before(craft, log, chosen)
    check_attitude(attitude.value, held_out)
    check_samples(craft, learn, chosen)
    with progress("identifying", len(ways) * len(chosen)) as done:
        fits = fit_all(craft, learn, chosen, ways, done)
    with progress("replaying", len(fits)) as done:
        comparison = compare_fits(
            fits,
            craft,
            held_out,
            attitude=attitude.value,
            rate_unit=rate_unit.value,
            done=done,
        )
    said = {**comparison.provenance, **({"overlap": shared} if shared else {}), **record(inputs)}
    deliver(replace(comparison, provenance=said), out, json)


def deliver(comparison: Comparison, out: str | None, json: bool) -> None:
    """Write and print a comparison; end with status 1 if it has no score at all.

    Parameters
    ----------
    comparison : Comparison
        What came out.
    out : str or None
        Folder to write to.
    json : bool
        Whether to print the document instead of tables.
    """
    from hydrodamp.cli.experiment import nothing_scored
    from hydrodamp.cli.report import offer
    from hydrodamp.report.comparison_grids import comparison_grids
    from hydrodamp.report.document import comparison_document
    from hydrodamp.report.files import write_comparison
    from hydrodamp.report.screen import show

    if out is not None:
        write_comparison(comparison, out)
    if json:
        emit(comparison_document(comparison))
    else:
        show(results(), *comparison_grids(comparison))
    if out is not None:
        also = ", report.html" if offer(comparison, Path(out) / "report.html") else ""
        note(f"written to {out}: comparison.json, table.txt .md .tex .csv, fits, replays.npz{also}")
    if sentence := nothing_scored(comparison):
        fail(sentence, WORK_FAILED)
