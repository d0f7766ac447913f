"""``hydrodamp convert``: convert a log of any format to the canonical form."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import hydrodamp as hd
from hydrodamp.cli import options
from hydrodamp.cli.data_split import read_logs, warn_quality_issues
from hydrodamp.cli.output import note, print_results


def convert(
    logs: options.SomeLogs,
    out: Annotated[Path, options.option("convert-out")],
    mapping: options.MappingFile = None,
    force: options.Force = False,
) -> None:
    """Convert a log to the canonical form: one clock, SI units, steps of the mapping applied."""
    from hydrodamp.cli.provenance import check_out_log

    check_out_log(out, (*logs, mapping), force)
    log = read_logs(logs, mapping)
    warn_quality_issues(log)
    hd.write_log(log, out)
    note(f"written to {out}")
    print_results(str(log))
