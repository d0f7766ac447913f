"""``hydrodamp convert``: any log to the canonical form."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import note, results


def convert(
    logs: options.SomeLogs,
    out: Annotated[str, typer.Option("--out", metavar="FILE", help="A .csv or .parquet file.")],
    mapping: options.MappingFile = None,
) -> None:
    """Bring a log of any format onto one clock, do the mapping's steps, and write it."""
    from hydrodamp.cli.parts import read
    from hydrodamp.cli.targets import check_out_file
    from hydrodamp.data.canonical import check_log_file, write_log

    check_out_file(out, (*logs, mapping))
    check_log_file(out)
    log = read(logs, mapping)
    results().print(str(log), markup=False, highlight=False)
    instead = ", in place of an earlier one" if Path(out).exists() else ""
    write_log(log, out)
    note(f"written to {out}{instead}")
