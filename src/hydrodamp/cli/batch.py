"""``hydrodamp batch``: identify models from groups of logs and detect changes between them."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

import hydrodamp as hd
from hydrodamp.cli import options, resolve
from hydrodamp.cli.output import WORK_FAILED, emit, note, print_results


def batch(
    logs: Annotated[list[str], options.argument("batch-logs")],
    out: Annotated[Path, options.option("batch-out")],
    vehicle: Annotated[str, options.option("batch-vehicle")] = "",
    model: Annotated[str, options.option("batch-model")] = "",
    method: Annotated[str, options.option("batch-method")] = "weak",
    group_by: Annotated[str, options.option("batch-group-by")] = "day",
    mapping: Annotated[list[str] | None, options.option("batch-mapping")] = None,
    workers: Annotated[int | None, options.option("batch-workers")] = None,
    scheduler: Annotated[str | None, options.option("batch-scheduler")] = None,
    timeout: Annotated[float, options.option("batch-timeout")] = 3600.0,
    force: options.Force = False,
    json: options.Json = False,
) -> None:
    """Identify models from many logs, one fit per group, and detect changes between groups."""
    from hydrodamp.report.batch_report import (
        RESULT_FILES,
        coefficient_table,
        summary_tables,
        write_batch,
    )
    from hydrodamp.results import check_results

    check_results(out, RESULT_FILES, force)
    vehicles = [resolve.find_vehicle(name) for name in vehicle.split(",")]
    models = _models(model)
    if mapping and len(mapping) > 1:
        raise hd.MethodError(
            f"`--mapping` must be given once, got {len(mapping)}: run `batch` separately "
            "for the logs of each mapping."
        )
    with nullcontext() if scheduler is None else _cluster(scheduler) as client:
        result = hd.batch(
            logs,
            vehicles,
            models,
            method,
            by=[key.strip() for key in group_by.split(",") if key.strip()],
            mapping=mapping[0] if mapping else None,
            client=client,
            workers=workers,
            cache=out / "statistics",
            timeout=timeout,
            exclude=out,
        )
    write_batch(result, out)
    if json:
        table = coefficient_table(result)
        names = [column.name for column in table.columns]
        rows = [dict(zip(names, row, strict=True)) for row in table.rows]
        emit({"coefficients": rows, "failed": result.failed})
    else:
        print_results(*summary_tables(result))
    for log, duplicate_of in result.duplicates.items():
        note(f"{log} is a duplicate of {duplicate_of} and is used once.")
    if result.n_cached:
        note(f"{result.n_cached} logs were read from the cache.")
    note(f"written to {out}")
    if result.failed:
        n = len(result.failed)
        note(f"{n} log{'s' * (n > 1)} could not be used and are not part of the fits.")
        raise typer.Exit(WORK_FAILED)


def _models(listed: str) -> tuple[hd.DampingModel, ...]:
    if not listed:
        raise hd.ModelError("`--model` is missing: give model names or YAML files of models.")
    requested = resolve.list_models(listed)
    if requested.selects_terms:
        raise hd.ModelError("`--model sparse` needs a single log: give models with terms.")
    return requested.models


def _cluster(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError as error:
        raise hd.MethodError('`--scheduler` needs Dask: pip install "hydrodamp[batch]"') from error
    try:
        return Client(address, timeout="10s")  # type: ignore[no-untyped-call]
    except OSError as error:
        raise hd.MethodError(f"`--scheduler {address}` does not respond: {error}") from error
    except Exception as error:  # an address that distributed cannot parse, or a foreign server
        raise hd.MethodError(
            f"`--scheduler` must be the address of a Dask scheduler, such as tcp://10.0.0.1:8786; "
            f"got {address}: {error}"
        ) from error
