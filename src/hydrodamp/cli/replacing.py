"""Results in the way of new ones: said before they go; and new ones that find no room, saved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import TYPE_CHECKING

from hydrodamp.cli.output import note
from hydrodamp.cli.resume import differences
from hydrodamp.errors import FileError

if TYPE_CHECKING:
    from hydrodamp.identification.fit import Fit
    from hydrodamp.report.unfinished import Earlier
    from hydrodamp.validation.comparison import Comparison


def earlier_results(out: str) -> Earlier | None:
    """Return what is in a folder of results."""
    from hydrodamp.report.unfinished import read_earlier

    if not (Path(out) / "comparison.json").is_file():
        return None
    try:
        return read_earlier(out)
    except FileError:
        return None


def note_replaced(out: str, said: Mapping[str, str]) -> None:
    """Say before the work that results of another run will be replaced."""
    earlier = earlier_results(out)
    if earlier is not None and differences(earlier, said):
        note(
            f"{out} holds a comparison of another run ({earlier.n_rows} rows); it is replaced when "
            "this one is done. To keep it, stop and name another folder."
        )


def write_or_rescue(comparison: Comparison, out: str, waiting: Sequence[Fit] = ()) -> None:
    """Write results; where their folder cannot be written, to one that can."""
    from hydrodamp.report.files import write_comparison

    try:
        write_comparison(comparison, out, waiting)
    except FileError as error:
        raise FileError(f"{error}\n{_rescued(comparison, waiting)}") from error


def _rescued(comparison: Comparison, waiting: Sequence[Fit]) -> str:
    """Write results to a new folder for temporary files, and say where, or that it failed too."""
    from hydrodamp.report.files import write_comparison

    try:
        refuge = mkdtemp(prefix="hydrodamp-")
    except OSError:
        return "There is no other folder that can be written: what was finished is lost."
    try:
        write_comparison(comparison, refuge, waiting)
    except FileError as error:
        rmtree(refuge, ignore_errors=True)
        return f"Nor can another: {error} What was finished is lost."
    return f"What was finished is in {refuge}; `hydrodamp report` makes its report."
