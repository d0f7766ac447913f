"""``hydrodamp export``: damping into files that a simulator or a controller reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated

import typer

import hydrodamp as hd
from hydrodamp.cli import options
from hydrodamp.cli.data_split import read
from hydrodamp.cli.output import emit, fail, note, show
from hydrodamp.cli.resolve import choose_vehicle
from hydrodamp.errors import MethodError

_FILES = 6  # that are named
_TARGET = f"What to write for: {options.TARGETS}."
_SET = "A setting of the target, such as precision=float. Repeatable."


def export(
    target: Annotated[str, typer.Argument(metavar="TARGET", help=_TARGET)],
    damping: Annotated[str, typer.Argument(metavar="JSON", help="A damping file.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")],
    vehicle: options.VehicleName = "",
    log: Annotated[
        list[str] | None,
        typer.Option(metavar="LOG", help="Run what was written with this log. Repeatable."),
    ] = None,
    mapping: options.MappingFile = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help=_SET)
    ] = None,
    force: Annotated[
        bool,
        typer.Option(
            "--force",
            help="Replace an earlier export; keep one that is worse than none or diverges.",
        ),
    ] = False,
    json: options.Json = False,
) -> None:
    """Write damping for a simulator or a controller, run it, and say how faithful it is."""
    from hydrodamp.data.record import first_few
    from hydrodamp.export.export import check_export
    from hydrodamp.report.fidelity_page import read_card, write_fidelity_page
    from hydrodamp.report.table import Table

    form = with_settings(hd.find_target(target), dict(map(_pair, settings or ())))
    check_export(out, force)
    craft, numbers = choose_vehicle(vehicle), hd.read_damping(damping)
    driven = read(log, mapping) if log else None
    card = hd.export(numbers, craft, form, out, log=driven, box=_sailed(Path(damping)), force=force)
    page, document = write_fidelity_page(out), read_card(out)
    note(f"written to {out}: {', '.join(first_few(sorted(document['files']), _FILES, 'files'))}")
    if json:
        emit(document)
    else:
        show(Table("", (), (), tuple(str(card).splitlines())))
    if card.run_error:
        fail(f"what was written does not run here: {card.run_error}")
    replayed = "" if log else "; with `--log LOG --force` a log is replayed with it, too"
    note(f"next: {page} is the card in full{replayed}")


def with_settings(form: hd.Target, given: Mapping[str, str]) -> hd.Target:
    """Return a target with some settings as a user spells them."""
    from pydantic import TypeAdapter

    kinds = {each.name: type(getattr(form, each.name)) for each in fields(form)}
    values = {}
    for name, text in given.items():
        if name not in kinds:
            has = ", ".join(kinds) or "none"
            raise MethodError(f"'{form.key}' has no setting '{name}'; it has: {has}.")
        try:
            values[name] = TypeAdapter(kinds[name]).validate_strings(text)
        except ValueError as error:
            raise MethodError(
                f"setting '{name}' of '{form.key}' must be like "
                f"{getattr(form, name)!r}; got '{text}'."
            ) from error
    return replace(form, **values)


def _pair(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise MethodError(f"`--set` must be NAME=VALUE, such as precision=float; got '{text}'.")
    return name.strip(), value.strip()


def _sailed(damping: Path) -> hd.OperatingBox | None:
    """Return the velocities that the coefficients were identified at, where a file says them."""
    import numpy as np

    from hydrodamp.report.documents import trained_on

    ranges = trained_on(damping)
    if not any(name in ranges for name in hd.VELOCITIES):
        return None
    low, high = np.array([ranges.get(name, (0.0, 0.0)) for name in hd.VELOCITIES]).T
    return hd.OperatingBox(low, high)
