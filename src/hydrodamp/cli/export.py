"""``hydrodamp export``: write a damping model as code or files for a simulator or controller."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import hydrodamp as hd
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.cli.inputs import read_damping_and_vehicle, read_logs_as_fitted
from hydrodamp.cli.output import fail, note, print_output
from hydrodamp.errors import MethodError, demand, first_few

if TYPE_CHECKING:
    from hydrodamp.export.target import Target
    from hydrodamp.identification.dissipativity import OperatingBox

MAX_FILES = 6  # names in the message


def export(
    target: str,
    damping: str,
    out: Path | None = None,
    into: Path | None = None,
    link: str = "",
    remove: bool = False,
    vehicle: str = "",
    log: list[str] | None = None,
    mapping: str | None = None,
    settings: list[str] | None = None,
    force: bool = False,
    json: bool = False,
) -> None:
    """Export a damping model to a simulator or controller and verify the exported files."""
    from hydrodamp.export.export import check_export
    from hydrodamp.export.insertion import insert_blocks
    from hydrodamp.report.fidelity_report import read_card, write_fidelity_page
    from hydrodamp.report.table import Table

    form = with_settings(hd.find_target(target), settings or ())
    demand((out is None) != (into is None), "--out", "given, or --into, not both", f"{out}, {into}")
    demand(into is not None or not (link or remove), "--into", "given with --link, --remove", into)
    if into is not None:
        form, link = _prepare_insertion(form, into, link, remove)
    if remove:
        return
    with TemporaryDirectory() as temporary:
        folder = out or Path(temporary, "export")
        check_export(folder, force)
        numbers, fit, craft = read_damping_and_vehicle(damping, vehicle)
        driven = read_logs_as_fitted(log, mapping, fit) if log else None
        box = operating_box_of(fit)
        card = hd.export(numbers, craft, form, folder, log=driven, box=box, fit=fit, force=force)
        document = read_card(folder)
        if into is not None:
            insert_blocks(into, link, folder)
    if out is not None:
        page, names = write_fidelity_page(out), sorted(document["files"])
        note(f"written to {out}: {', '.join(first_few(names, MAX_FILES, 'files'))}")
    print_output(json, document, Table("", (), (), tuple(str(card).splitlines())))
    if card.run_error:
        fail(f"the exported files do not run here: {card.run_error}")
    if into is not None:
        note(f"written into link '{link}' of {into}; `--remove` restores the file")
    else:
        replayed = "" if log else "; use `--log LOG --force` to verify it with a log"
        note(f"see {page} for the fidelity card{replayed}")


def _prepare_insertion(form: Target, path: Path, link: str, remove: bool) -> tuple[Target, str]:
    """Return the target for a link of a file, and its name; or remove earlier blocks."""
    from hydrodamp.export.gazebo import VRX, GzSim
    from hydrodamp.export.insertion import find_link, remove_blocks

    demand(type(form) in (GzSim, VRX), "--into", "used with gz-sim or vrx", form.key)
    if remove:
        remove_blocks(path)
        note(f"removed from {path}")
        return form, link
    link = find_link(path, link)
    return with_settings(form, (f"link={link.split('::')[-1]}",)), link


def with_settings(target: Target, texts: Iterable[str]) -> Target:
    """Return a target with settings given as ``NAME=VALUE``."""
    from pydantic import TypeAdapter

    types = {setting.name: type(getattr(target, setting.name)) for setting in fields(target)}
    values = {}
    for text in texts:
        name, equals, value = (word.strip() for word in text.partition("="))
        demand(bool(equals), "--set", "NAME=VALUE, such as precision=float", f"'{text}'")
        if name not in types:
            has = ", ".join(types) or "none"
            raise MethodError(f"'{target.key}' has no setting '{name}'; its settings are: {has}.")
        try:
            values[name] = TypeAdapter(types[name]).validate_strings(value)
        except ValueError as error:
            example = getattr(target, name)
            subject = f"setting '{name}' of '{target.key}'"
            raise MethodError(f"{subject} must be like {example!r}; got '{value}'.") from error
    return replace(target, **values)


def operating_box_of(fit: hd.Fit | None) -> OperatingBox | None:
    """Return the operating box of the training data of a fit, if known."""
    import numpy as np

    from hydrodamp.identification.dissipativity import OperatingBox

    ranges = {} if fit is None else fit.training_range
    if not any(name in ranges for name in VELOCITIES):
        return None
    low, high = np.array([ranges.get(name, (0.0, 0.0)) for name in VELOCITIES]).T
    return OperatingBox(low, high).widen()
