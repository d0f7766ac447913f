"""The end of compare and demo: results written and shown, or what there is of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NoReturn

import typer

from hydrodamp.cli.guard import INTERRUPTED, warned
from hydrodamp.cli.output import emit, note, results
from hydrodamp.cli.resume import command_to_resume

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from hydrodamp.cli.run import Outcome
    from hydrodamp.validation.comparison import Comparison


def hand_over(
    outcome: Outcome,
    said: Mapping[str, str],
    out: str | None,
    json: bool,
    deliver: Callable[[Comparison, str | None, bool], None],
) -> None:
    """Write and show what came out; end with status 130 if it is unfinished.

    Parameters
    ----------
    outcome : Outcome
        Of the work.
    said : mapping of str to str
        What the run was, for its provenance.
    out : str or None
        Folder to write to.
    json : bool
        Whether to print the document instead of tables.
    deliver : callable
        How finished results are written and shown.
    """
    comparison = replace(
        outcome.comparison, provenance={**outcome.comparison.provenance, **said, **_warnings(said)}
    )
    if not outcome.finished:
        _hand_over_part(replace(outcome, comparison=comparison), out, json)
    try:
        deliver(comparison, out, json)
    except KeyboardInterrupt:
        if out is not None:
            _write_after_all(comparison, out)
        raise


def _warnings(said: Mapping[str, str]) -> dict[str, str]:
    """Return the warnings of an earlier run and of this one, each once."""
    lines = dict.fromkeys((*said.get("warnings", "").splitlines(), *warned()))
    return {"warnings": "\n".join(lines)} if lines else {}


def _write_after_all(comparison: Comparison, out: str) -> None:
    """Write finished results whose writing or report was interrupted."""
    from hydrodamp.report.files import write_comparison

    write_comparison(comparison, out)
    note(f"interrupted: all rows are written to {out}; `hydrodamp report {out}` makes report.html.")


def _hand_over_part(outcome: Outcome, out: str | None, json: bool) -> NoReturn:
    from hydrodamp.report.comparison_grids import comparison_grids
    from hydrodamp.report.document import comparison_document
    from hydrodamp.report.files import write_comparison
    from hydrodamp.report.screen import show

    comparison, waiting = outcome.comparison, outcome.waiting
    if out is not None and (comparison.rows or waiting):
        try:
            write_comparison(comparison, out, waiting)
        except KeyboardInterrupt:
            note(f"interrupted while writing: {out} is as it was before.")
            raise
    if json:
        emit(comparison_document(comparison))
    elif comparison.rows:
        show(results(), *comparison_grids(comparison))
    note(how_to_go_on(outcome, out))
    raise typer.Exit(INTERRUPTED)


def how_to_go_on(outcome: Outcome, out: str | None) -> str:
    """Return what is there of an interrupted run, and how the rest is made.

    Parameters
    ----------
    outcome : Outcome
        Unfinished.
    out : str or None
        Folder that was written to.

    Returns
    -------
    words : str
        One or two lines.
    """
    rows, waiting = len(outcome.comparison.rows), len(outcome.waiting)
    there = f"{rows} of {outcome.wanted} rows"
    if out is None:
        return (
            f"interrupted: {there}, and nothing is written. With `--out DIR` what is finished "
            "is kept, and `--resume` goes on from there."
        )
    if not rows and not waiting:
        return "interrupted before any fit was finished: nothing is written."
    more = f" and {waiting} fits without a replay" if waiting else ""
    return (
        f"interrupted: {there}{more} are written to {out}: comparison.json, table.txt .md .tex "
        f".csv, fits, replays.npz.\nTo go on from there: {command_to_resume()}"
    )
