"""``hydrodamp batch``: identify models from groups of logs and detect changes between them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import typer

import hydrodamp as hd
from hydrodamp.cli.inputs import list_models, split_names
from hydrodamp.cli.output import WORK_FAILED, note, print_output
from hydrodamp.errors import HydrodampError, MethodError, demand
from hydrodamp.results import check_results, remove_empty_folders


def batch(
    logs: list[str],
    out: Path,
    vehicle: str = "",
    model: str = "",
    method: str = "weak",
    group_by: str = "day",
    mapping: list[str] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    timeout: float = 3600.0,
    force: bool = False,
    json: bool = False,
) -> None:
    """Identify models from many logs, one fit per group, and detect changes between groups."""
    from hydrodamp.report import batch_report

    check_results(out, batch_report.RESULT_FILES, force)
    vehicles = [hd.find_vehicle(name) for name in split_names(vehicle)]
    models, mappings = list_models(model).with_terms(), mapping or []
    wanted = "given once: run `batch` separately for the logs of each mapping"
    demand(len(mappings) < 2, "--mapping", wanted, len(mappings))
    cluster = nullcontext() if scheduler is None else _cluster(scheduler)
    with _remove_statistics_on_error(cache := out / "statistics"), cluster as client:
        result = hd.batch(
            logs,
            vehicles,
            models,
            method,
            by=[key.strip() for key in group_by.split(",") if key.strip()],
            mapping=mappings[0] if mappings else None,
            client=client,
            workers=workers,
            cache=cache,
            timeout=timeout,
            exclude=out,
        )
    batch_report.write_batch(result, out)
    table, verdict = batch_report.coefficient_table(result), [*batch_report.batch_verdict(result)]
    rows = [dict(zip(table.header, row, strict=True)) for row in table.rows]
    document = {
        "format": "hydrodamp-batch",
        "version": 1,
        "verdict": verdict,
        "coefficients": rows,
        "failed": result.failed,
        "outliers": result.outliers,
        "paths": {"folder": str(out), "report": str(out / "batch.html")},
    }
    print_output(
        json, document, " ".join(("Verdict:", *verdict)), *batch_report.summary_tables(result)
    )
    for log, duplicate_of in result.duplicates.items():
        note(f"{log} is a duplicate of {duplicate_of} and is used once.")
    if result.n_cached:
        note(f"read from the cache: {result.n_cached} of the logs.")
    note(f"written to {out}")
    if result.failed:
        n = len(result.failed)
        note(f"{n} log{'s' * (n > 1)} could not be used and are not part of the fits.")
        raise typer.Exit(WORK_FAILED)


@contextmanager
def _remove_statistics_on_error(cache: Path) -> Iterator[None]:
    """Remove the statistics that a refused call wrote, and folders that are empty then."""
    earlier, folder = {*cache.glob("*")}, next(p for p in (cache, *cache.parents) if p.exists())
    try:
        yield
    except HydrodampError:
        new_files = {*cache.glob("*")} - earlier
        for path in new_files:
            path.unlink()
        remove_empty_folders(new_files, folder)
        raise


def _cluster(address: str) -> Any:
    try:
        from distributed import Client

        return Client(address, timeout="10s")  # type: ignore[no-untyped-call]
    except ImportError as error:
        raise MethodError('`--scheduler` needs Dask: pip install "hydrodamp[batch]"') from error
    except Exception as error:  # no response, an address that cannot be parsed, another server
        wanted = "the address of a Dask scheduler that responds, such as tcp://10.0.0.1:8786"
        raise MethodError(f"`--scheduler` must be {wanted}; got {address}: {error}") from error
