"""``hydrodamp export``: write a damping model as code or files for a simulator or controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated

import hydrodamp as hd
from hydrodamp.cli import options
from hydrodamp.cli.data_split import read_logs
from hydrodamp.cli.output import emit, fail, note, print_results
from hydrodamp.cli.resolve import find_vehicle
from hydrodamp.errors import MethodError

MAX_FILES = 6  # names in the message


def export(
    target: Annotated[str, options.argument("export-target")],
    damping: Annotated[str, options.argument("export-damping")],
    out: Annotated[Path, options.option("export-out")],
    vehicle: options.VehicleName = "",
    log: Annotated[list[str] | None, options.option("export-log")] = None,
    mapping: options.MappingFile = None,
    settings: Annotated[list[str] | None, options.option("export-settings")] = None,
    force: Annotated[bool, options.option("export-force")] = False,
    json: options.Json = False,
) -> None:
    """Export a damping model to a simulator or controller and verify the exported files."""
    from hydrodamp.export.export import check_export
    from hydrodamp.report.page import read_card, write_fidelity_page
    from hydrodamp.report.table import Table
    from hydrodamp.text import first_few

    form = with_settings(hd.find_target(target), dict(map(_pair, settings or ())))
    check_export(out, force)
    craft, numbers = find_vehicle(vehicle), hd.read_damping(damping)
    driven = read_logs(log, mapping) if log else None
    card = hd.export(
        numbers, craft, form, out, log=driven, box=operating_box_of(Path(damping)), force=force
    )
    page, document = write_fidelity_page(out), read_card(out)
    note(f"written to {out}: {', '.join(first_few(sorted(document['files']), MAX_FILES, 'files'))}")
    if json:
        emit(document)
    else:
        print_results(Table("", (), (), tuple(str(card).splitlines())))
    if card.run_error:
        fail(f"the exported files do not run here: {card.run_error}")
    replayed = "" if log else "; use `--log LOG --force` to verify it with a log"
    note(f"see {page} for the fidelity card{replayed}")


def with_settings(target: hd.Target, texts: Mapping[str, str]) -> hd.Target:
    """Return a target with settings given as text."""
    from pydantic import TypeAdapter

    types = {setting.name: type(getattr(target, setting.name)) for setting in fields(target)}
    values = {}
    for name, text in texts.items():
        if name not in types:
            has = ", ".join(types) or "none"
            raise MethodError(f"'{target.key}' has no setting '{name}'; its settings are: {has}.")
        try:
            values[name] = TypeAdapter(types[name]).validate_strings(text)
        except ValueError as error:
            raise MethodError(
                f"setting '{name}' of '{target.key}' must be like "
                f"{getattr(target, name)!r}; got '{text}'."
            ) from error
    return replace(target, **values)


def _pair(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise MethodError(f"`--set` must be NAME=VALUE, such as precision=float; got '{text}'.")
    return name.strip(), value.strip()


def operating_box_of(damping: Path) -> hd.OperatingBox | None:
    """Return the range of training velocities that a damping file holds, if any."""
    import numpy as np

    from hydrodamp.report.documents import read_training_range

    ranges = read_training_range(damping)
    if not any(name in ranges for name in hd.VELOCITIES):
        return None
    low, high = np.array([ranges.get(name, (0.0, 0.0)) for name in hd.VELOCITIES]).T
    return hd.OperatingBox(low, high)
