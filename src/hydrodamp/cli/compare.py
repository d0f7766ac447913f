"""``hydrodamp compare``: every model by every method, on data they have not seen."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from hydrodamp.cli import options
from hydrodamp.cli.choose import file_of
from hydrodamp.cli.guard import WORK_FAILED
from hydrodamp.cli.output import emit, fail, note, results
from hydrodamp.errors import FileError

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.validation.comparison import Comparison
    from hydrodamp.vehicle.vehicle import Vehicle


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
    resume: options.Resume = False,
    json: options.Json = False,
) -> None:
    """Identify models on one part of the data, replay them on another, rank them."""
    from hydrodamp.cli.choose import choose_methods, choose_models, selects, with_sparse
    from hydrodamp.cli.experiment import check_attitude, check_before, check_samples
    from hydrodamp.cli.handing import hand_over
    from hydrodamp.cli.record import record
    from hydrodamp.cli.replacing import note_replaced
    from hydrodamp.cli.resume import OPTIONS, check_resume, go_on, options_in_words
    from hydrodamp.cli.run import Task, carry_out
    from hydrodamp.cli.select import train_and_test
    from hydrodamp.cli.targets import check_out_folder
    from hydrodamp.vehicle.fleet import find_vehicle

    parts = {"LOG": logs, "--train": train, "--test": test}
    settings = {"--attitude": attitude.value, "--rate-unit": rate_unit.value}
    kinds = {"--vehicle": vehicle, "--models": models, "--methods": methods, "--mapping": mapping}
    listed = (*(name for names in parts.values() for name in names or ()), *_names(models))
    inputs = (*listed, vehicle, mapping)
    if out is not None:
        check_out_folder(out, inputs)
    craft, chosen, ways = find_vehicle(vehicle), choose_models(models), choose_methods(methods)
    said = {**record(inputs), OPTIONS: options_in_words({**parts, **kinds, **settings})}
    earlier = check_resume(out, said) if resume else None
    if out is not None:
        note_replaced(out, said)
    learn, held_out, shared = train_and_test(logs or (), train or (), test or (), mapping)
    if selects(models):
        chosen = with_sparse(craft, learn, chosen)
    for log in (learn, held_out):
        check_before(craft, log, chosen)
    check_attitude(attitude.value, held_out)
    check_samples(craft, learn, chosen)
    task = Task(craft, learn, held_out, chosen, ways, attitude.value, rate_unit.value)
    if earlier is not None:
        task, said = go_on(earlier, task, said)
    said = {**({"overlap": shared} if shared else {}), **said}
    hand_over(carry_out(task), said, out, json, partial(deliver, craft, learn))


def _names(models: str | None) -> tuple[str, ...]:
    return tuple(file_of(name.strip()) for name in (models or "").split(","))


def deliver(
    vehicle: Vehicle, train: Log, comparison: Comparison, out: str | None, json: bool
) -> None:
    """Write and print a comparison; end with status 1 if it has no score at all."""
    from hydrodamp.cli.experiment import nothing_scored
    from hydrodamp.cli.replacing import write_or_rescue
    from hydrodamp.cli.report import illustrate
    from hydrodamp.report.comparison_grids import comparison_grids
    from hydrodamp.report.document import comparison_document
    from hydrodamp.report.files import WRITTEN
    from hydrodamp.report.screen import show

    fault = None
    if out is not None:
        try:
            write_or_rescue(comparison, out)
        except FileError as error:
            fault = error
    if json:
        emit(comparison_document(comparison))
    else:
        show(results(), *comparison_grids(comparison))
    if fault is not None:
        raise fault
    if out is not None:
        also = illustrate(comparison, vehicle, train, Path(out))
        note(f"written to {out}: {', '.join((WRITTEN, *also))}")
    if sentence := nothing_scored(comparison):
        fail(sentence, WORK_FAILED)
