"""A look through a log as tables and as a document."""

from __future__ import annotations

from dataclasses import asdict

from hydrodamp.report.document import Document, moment
from hydrodamp.report.grid import Grid
from hydrodamp.report.numbers import coefficient
from hydrodamp.report.survey import Channel, Survey
from hydrodamp.report.verdict import Verdict

LISTED = 30
"""Segments that are spelt out."""


def survey_grids(found: Survey, judged: Verdict) -> tuple[Grid, ...]:
    """Return the tables of a probed log."""
    return (_segments(found), _columns(found, judged))


def survey_document(found: Survey, judged: Verdict) -> Document:
    """Return what ``probe --json`` prints."""
    facts = asdict(found)
    segments = [
        {key: moment(value) if isinstance(value, float) else value for key, value in part.items()}
        for part in facts.pop("stretches")
    ]
    facts["duration"] = moment(facts["duration"])
    return {
        **facts,
        "segments": segments,
        "missing": list(judged.missing),
        "doubts": list(judged.doubts),
        "reservations": list(judged.reservations),
        "promises": list(judged.promises),
        "fit": not (judged.missing or judged.doubts),
        "verdict": judged.sentence,
    }


def _segments(found: Survey) -> Grid:
    rows = tuple(
        (
            part.name,
            str(part.n_samples),
            f"{part.start:.2f}",
            f"{part.end:.2f}",
            f"{1 / part.step:.3g}" if part.step > 0.0 else "-",
            f"{part.longest_step:.3g}",
        )
        for part in found.stretches
    )
    more = len(rows) - LISTED
    return Grid(
        title=f"{found.source}: {found.n_samples} samples, {found.duration:.1f} s "
        f"in {len(rows)} segment{'s' if len(rows) != 1 else ''}",
        header=("segment", "samples", "from [s]", "to [s]", "rate [Hz]", "longest step [s]"),
        rows=rows[:LISTED],
        align="lrrrrr",
        notes=(f"and {more} more segments",) if more > 0 else (),
    )


def _columns(found: Survey, judged: Verdict) -> Grid:
    notes = [f"Also recorded: {', '.join(found.has) or 'nothing else'}."]
    notes += [f"missing: {each}" for each in judged.missing]
    notes += judged.doubts
    notes += [f"mind: {each}" for each in judged.reservations]
    notes += [f"good: {each}" for each in judged.promises]
    return Grid(
        title="Columns",
        header=("column", "unit", "mean", "std", "lowest", "highest", "changes"),
        rows=tuple(_row(each) for each in (*found.velocities, *found.commands)),
        align="llrrrrr",
        notes=(*notes, f"Verdict: {judged.sentence}"),
    )


def _row(channel: Channel) -> tuple[str, ...]:
    numbers = (channel.mean, channel.std, channel.low, channel.high)
    unit = channel.unit or "command"
    return (channel.name, unit, *map(coefficient, numbers), str(channel.n_changes))
