"""A probed recording and the log it makes, put together for the screen and for machines."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial

from hydrodamp.advance import within
from hydrodamp.conditioning.rates import rates_from_attitude
from hydrodamp.conditioning.suspicions import Suspicion, suspicions
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording
from hydrodamp.errors import HydrodampError, HydrodampWarning
from hydrodamp.ingest.mapping import LogMapping, read_mapping
from hydrodamp.ingest.probing.delay import Delay, delays
from hydrodamp.ingest.probing.probe import SUFFICES, Probe
from hydrodamp.ingest.read import logs_of
from hydrodamp.report.document import Document
from hydrodamp.report.grid import Grid
from hydrodamp.report.recording_grids import (
    delay_grid,
    draft_grid,
    recording_document,
    topics_grid,
)
from hydrodamp.report.survey import Survey, survey
from hydrodamp.report.survey_grids import survey_document, survey_grids
from hydrodamp.report.verdict import Verdict, verdict
from hydrodamp.vehicle.vehicle import Vehicle

_SURVEYED = 0.3
"""What share of the time it takes to judge a log its survey takes; the rest is its delays."""


@dataclass(frozen=True, eq=False)
class Probed:
    """The log of a recording, and what of it."""

    way: str
    reason: str
    survey: Survey | None
    delays: tuple[Delay, ...]
    suspicions: tuple[Suspicion, ...]
    verdict: Verdict
    notes: tuple[str, ...] = ()
    guessed: bool = False


def judged(log: Log, way: str, vehicle: Vehicle | None = None) -> Probed:
    """Judge a log."""
    found = survey(log)
    whole = log if log.attitude is None else rates_from_attitude(log)
    with within(_SURVEYED, 1.0):
        late = delays(whole)
    said = verdict(found, log, vehicle, late, found if whole is log else survey(whole))
    return Probed(way, "", found, late, suspicions(log), said, log.notes)


def by_guess(
    found: Probe, recordings: Sequence[Recording], vehicle: Vehicle | None = None
) -> Probed:
    """Judge the log that the draft makes, or else a preset that fits."""
    reason = "the roles of its columns are too unsure to make a log of"
    for mapping_of, way in _mappings(found):
        try:
            mapping = mapping_of()
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", HydrodampWarning)
                log = logs_of(recordings, mapping)
            return replace(judged(log, way, vehicle), guessed=True)
        except HydrodampError as error:
            reason = f"{way}: {error}"
    missing = (f"a log: {reason}. Put the draft right and ask again with --mapping.",)
    return Probed("", reason, None, (), (), Verdict(missing, ()), guessed=True)


def _mappings(found: Probe) -> Iterator[tuple[Callable[[], LogMapping], str]]:
    if found.draft.confidence >= SUFFICES:
        yield found.mapping, "by the draft"
    for preset in found.presets:
        if not preset.topics:
            yield partial(read_mapping, preset.name), f"by the preset {preset.name}"


def probed_grids(found: Probe, probed: Probed) -> tuple[Grid, ...]:
    """Return the tables of a probed recording and its log."""
    guesses = (draft_grid(found),) if probed.guessed else ()
    read = (topics_grid(found), *guesses) if probed.way or probed.guessed else ()
    late = (delay_grid(probed.delays),) if probed.delays else ()
    if probed.survey is None:
        notes = (*(f"missing: {each}" for each in probed.verdict.missing),)
        return (*read, Grid("No log", ("",), (), "l", (*notes, _said(probed))))
    segments, columns = survey_grids(probed.survey, probed.verdict)
    made = (f"Made {probed.way}.",) if probed.way else ()
    told = (*segments.notes, *made, *probed.notes)
    return (*read, replace(segments, notes=told), *late, columns)


def _said(probed: Probed) -> str:
    return f"Verdict: {probed.verdict.sentence}"


def probed_document(found: Probe, probed: Probed) -> Document:
    """Return what ``probe --json`` prints."""
    judged = probed.verdict
    facts: Document = (
        survey_document(probed.survey, judged)
        if probed.survey is not None
        else {
            "source": found.source,
            "missing": list(judged.missing),
            "doubts": [],
            "reservations": [],
            "promises": [],
            "fit": False,
            "verdict": judged.sentence,
        }
    )
    return {
        **facts,
        "log": probed.way or ("canonical" if probed.survey is not None else None),
        "delays": [asdict(one) for one in probed.delays],
        "suspicions": [asdict(one) for one in probed.suspicions],
        "log_notes": list(probed.notes),
        **recording_document(found),
    }
