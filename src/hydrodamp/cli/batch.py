"""``hydrodamp batch``: many logs, a fit for each group, and what changed between them."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.output import WORK_FAILED, emit, note, show

_LOGS = "Logs: files, folders with all logs beneath them, patterns, and URLs such as s3://…"
_MODELS = "Models by name, YAML files of models, or FILE:NAME, with commas. [required]"
_BY = "Group by vehicle, day, month, folder or patterns of the path, with commas."
_VEHICLES = "As for identify; several, with commas: each log's path names one. [required]"
_MAPPING = "As for identify; one for all logs."
_OUT = (
    "Write the table, a damping file for each group, pictures, a page, and the statistics of logs."
)
_SCHEDULER = "Work on the cluster of a Dask scheduler, such as tcp://10.0.0.1:8786."


def batch(
    logs: Annotated[list[str], typer.Argument(metavar="LOG", help=_LOGS)],
    out: Annotated[Path, typer.Option(metavar="DIR", help=_OUT)],
    vehicle: Annotated[str, typer.Option(metavar="V", help=_VEHICLES, show_default=False)] = "",
    model: Annotated[str, typer.Option(metavar="LIST", help=_MODELS, show_default=False)] = "",
    method: Annotated[
        str,
        typer.Option(
            metavar="KEY",
            help=f"How: {options.KEYS}. weak and ls use sufficient statistics of each log.",
        ),
    ] = "weak",
    by: Annotated[str, typer.Option(metavar="LIST", help=_BY)] = "day",
    mapping: Annotated[list[str] | None, typer.Option(metavar="M", help=_MAPPING)] = None,
    workers: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Processes of this machine.")
    ] = None,
    scheduler: Annotated[str | None, typer.Option(metavar="URL", help=_SCHEDULER)] = None,
    timeout: Annotated[
        float, typer.Option(metavar="S", help="Longest work on one log [s], from its start.")
    ] = 3600.0,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Identify models from many logs, group by group, and say what changed between them."""
    from hydrodamp.report.batch_report import (
        RESULT_FILES,
        coefficient_table,
        summary_tables,
        write_batch,
    )
    from hydrodamp.results import check_results

    check_results(out, RESULT_FILES, force)
    crafts = [resolve.choose_vehicle(one) for one in vehicle.split(",")]
    models = _models(model)
    if mapping and len(mapping) > 1:
        raise hd.MethodError(
            f"one mapping serves all logs, got {len(mapping)}: run `batch` for the logs of each, "
            "with an `--out` of its own."
        )
    with nullcontext() if scheduler is None else _cluster(scheduler) as client:
        season = hd.batch(
            logs,
            crafts,
            models,
            method,
            by=[one.strip() for one in by.split(",") if one.strip()],
            mapping=mapping[0] if mapping else None,
            client=client,
            workers=workers,
            cache=out / "statistics",
            timeout=timeout,
            exclude=out,
        )
    write_batch(season, out)
    if json:
        table = coefficient_table(season)
        names = [column.name for column in table.columns]
        rows = [dict(zip(names, row, strict=True)) for row in table.rows]
        emit({"coefficients": rows, "failed": season.failed})
    else:
        show(*summary_tables(season))
    for log, other in season.duplicates.items():
        note(f"{log} has the content of {other} and counts once.")
    if season.n_cached:
        note(f"{season.n_cached} logs were in the cache.")
    note(f"written to {out}")
    if season.failed:
        n = len(season.failed)
        note(f"{n} log{'s' * (n > 1)} could not be used; the fits are of the others.")
        raise typer.Exit(WORK_FAILED)


def _models(listed: str) -> tuple[hd.DampingModel, ...]:
    if not listed:
        raise hd.ModelError("`--model` is missing: name models, or YAML files of models.")
    if resolve.selects(listed):
        raise hd.ModelError("`sparse` is selected from one log: name models with terms.")
    return resolve.choose_models(listed)


def _cluster(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError as error:
        raise hd.MethodError('`--scheduler` needs Dask: pip install "hydrodamp[batch]"') from error
    try:
        return Client(address, timeout="10s")  # type: ignore[no-untyped-call]
    except OSError as error:
        raise hd.MethodError(f"`--scheduler {address}` does not answer: {error}") from error
    except Exception as error:  # an address that distributed cannot parse, or a foreign server
        raise hd.MethodError(
            f"`--scheduler` must be the address of a Dask scheduler, such as tcp://10.0.0.1:8786; "
            f"got {address}: {error}"
        ) from error
