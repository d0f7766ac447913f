"""The log that recordings make, by a mapping that is given or guessed, and the verdict on it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording
from hydrodamp.errors import HydrodampError, HydrodampWarning
from hydrodamp.ingest.mapping import LogMapping, read_mapping
from hydrodamp.ingest.probing.probe import SUFFICES, Probe, is_canonical
from hydrodamp.ingest.probing.verdict import Needs, Verdict, verdict
from hydrodamp.ingest.read import logs_of

AskNeeds = Callable[[Log], Needs]
"""Returns what a vehicle needs of a log."""


@dataclass(frozen=True)
class Judged:
    """How a log was made of recordings and what the verdict is, or why there is no log."""

    made: str
    verdict: Verdict | None
    notes: tuple[str, ...] = ()
    guessed: bool = False
    reason: str = ""

    @property
    def missing(self) -> tuple[str, ...]:
        """What the log lacks; without a log, the log itself."""
        if self.verdict is not None:
            return self.verdict.missing
        return (f"a log: {self.reason}. Correct the draft and ask again with --mapping.",)


def judge(
    found: Probe,
    recordings: Sequence[Recording],
    mapping: str | None = None,
    needs: AskNeeds | None = None,
) -> Judged:
    """Make a log of recordings that were probed, and judge it."""
    if mapping is not None:
        return _judged(logs_of(recordings, mapping), f"by the mapping {mapping}", needs)
    if all(map(is_canonical, recordings)):
        return _judged(logs_of(recordings), "", needs)
    reason = "the roles of its columns are too unsure to make a log of"
    for mapping_of, made in _guesses(found):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", HydrodampWarning)
                log = logs_of(recordings, mapping_of())
            return replace(_judged(log, made, needs), guessed=True)
        except HydrodampError as error:
            reason = f"{made}: {error}"
    return Judged("", None, guessed=True, reason=reason)


def _judged(log: Log, made: str, needs: AskNeeds | None) -> Judged:
    return Judged(made, verdict(log, None if needs is None else needs(log)), log.notes)


def _guesses(found: Probe) -> Iterator[tuple[Callable[[], LogMapping], str]]:
    """Yield the draft if it is sure enough, then the presets that fit a table."""
    if found.draft.confidence >= SUFFICES:
        yield found.mapping, "by the draft"
    for preset in found.presets:
        if not preset.topics:
            yield partial(read_mapping, preset.name), f"by the preset {preset.name}"
