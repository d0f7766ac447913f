"""The end of compare and demo: results written and shown, or what there is of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NoReturn

import typer

from hydrodamp.cli.guard import INTERRUPTED, warned
from hydrodamp.cli.output import emit, note, results
from hydrodamp.cli.replacing import earlier_results, write_or_rescue
from hydrodamp.cli.resume import command_to_resume, differences
from hydrodamp.errors import FileError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from hydrodamp.cli.run import Outcome
    from hydrodamp.report.unfinished import Earlier
    from hydrodamp.validation.comparison import Comparison


def hand_over(
    outcome: Outcome,
    said: Mapping[str, str],
    out: str | None,
    json: bool,
    deliver: Callable[[Comparison, str | None, bool], None],
) -> None:
    """Write and show what came out; end with status 130 if it is unfinished."""
    comparison = replace(
        outcome.comparison, provenance={**outcome.comparison.provenance, **said, **_warnings(said)}
    )
    told = replace(outcome, comparison=comparison)
    if not outcome.finished:
        _hand_over_part(told, out, json)
    try:
        deliver(comparison, out, json)
    except KeyboardInterrupt:
        if out is None:
            raise
        _write_after_all(comparison, out)
        raise typer.Exit(INTERRUPTED) from None


def _warnings(said: Mapping[str, str]) -> dict[str, str]:
    """Return the warnings of an earlier run and of this one, each once."""
    lines = dict.fromkeys((*said.get("warnings", "").splitlines(), *warned()))
    return {"warnings": "\n".join(lines)} if lines else {}


def _write_after_all(comparison: Comparison, out: str) -> None:
    """Write finished results if their writing was interrupted, and say what is there."""
    from hydrodamp.report.files import is_written

    if not is_written(comparison, out):
        write_or_rescue(comparison, out)
    note(
        f"interrupted: all rows are written to {out}; pictures and report may be missing.\n"
        f"To make those: {command_to_resume()}"
    )


def _hand_over_part(outcome: Outcome, out: str | None, json: bool) -> NoReturn:
    try:
        words = _keep(outcome, out)
    except FileError as error:
        words = f"{_end(outcome)}. {error}"
    try:
        _show(outcome.comparison, json)
    finally:
        note(words)
    if outcome.failure is not None:
        raise outcome.failure
    raise typer.Exit(INTERRUPTED)


def _show(comparison: Comparison, json: bool) -> None:
    from hydrodamp.report.comparison_grids import comparison_grids
    from hydrodamp.report.document import comparison_document
    from hydrodamp.report.screen import show

    if json:
        emit(comparison_document(comparison))
    elif comparison.rows:
        show(results(), *comparison_grids(comparison))


def _keep(outcome: Outcome, out: str | None) -> str:
    """Write what is finished, unless more is there, and say how to go on."""
    fits, rows = len(outcome.comparison.rows) + len(outcome.waiting), len(outcome.comparison.rows)
    if out is None or not fits:
        return how_to_go_on(outcome, out)
    try:
        earlier = earlier_results(out)
        if earlier is not None and earlier.worth > (fits, rows):
            return _left_alone(outcome, out, earlier)
        _write(outcome, out)
    except KeyboardInterrupt:
        note(f"interrupted while writing: {out} is as it was before.")
        raise typer.Exit(INTERRUPTED) from None
    return how_to_go_on(outcome, out)


def _write(outcome: Outcome, out: str) -> None:
    from hydrodamp.report.files import is_written

    try:
        write_or_rescue(outcome.comparison, out, outcome.waiting)
    except KeyboardInterrupt:
        if not is_written(outcome.comparison, out, outcome.waiting):
            raise


def _left_alone(outcome: Outcome, out: str, earlier: Earlier) -> str:
    fits, rows = earlier.worth
    same = not differences(earlier, outcome.comparison.provenance)
    how = (
        f"To go on from there: {command_to_resume()}"
        if same
        else "That is of another run: name another folder with `--out`."
    )
    return (
        f"{_end(outcome)}, and nothing is written: {out} holds more, {fits} fits and {rows} rows, "
        f"and stays as it is.\n{how}"
    )


def how_to_go_on(outcome: Outcome, out: str | None) -> str:
    """Return what is there of a run that was not finished, and how the rest is made."""
    from hydrodamp.report.files import WRITTEN

    if out is None:
        return (
            f"{_end(outcome)}, and nothing is written. With `--out DIR` what is finished "
            "is kept, and `--resume` goes on from there."
        )
    if not outcome.comparison.rows and not outcome.waiting:
        return "interrupted before any fit was finished: nothing is written."
    more = f" and {len(outcome.waiting)} fits without a replay" if outcome.waiting else ""
    return (
        f"{_end(outcome)}{more} are written to {out}: {WRITTEN}.\n"
        f"To go on from there: {command_to_resume()}"
    )


def _end(outcome: Outcome) -> str:
    ended = "interrupted" if outcome.failure is None else "ended by an error"
    return f"{ended}: {len(outcome.comparison.rows)} of {outcome.wanted} rows"
