"""Everything that can be said of an unknown recording, in a row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.recording import Recording
from hydrodamp.files import parse_yaml
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.probing.clocks import Ticking
from hydrodamp.ingest.probing.draft import Draft, draft
from hydrodamp.ingest.probing.names import NOISE
from hydrodamp.ingest.probing.roles import Roles, guess_roles
from hydrodamp.ingest.probing.series import series_of
from hydrodamp.ingest.probing.shipped import Fitting, fitting
from hydrodamp.ingest.probing.topics import TopicFacts, topics_of
from hydrodamp.ingest.probing.words import words

SUFFICES = 60
"""Confidence [%] from which a draft is worth making a log of."""


@dataclass(frozen=True, eq=False)
class Probe:
    """What a recording holds, and what it may mean.

    Attributes
    ----------
    source, format : str
        Of the recording.
    notes : tuple of str
        What the reader met.
    topics : tuple of TopicFacts
        Rates, gaps and spans.
    roles : Roles
        What its columns may be.
    without_role : tuple of str
        Columns of numbers of which nothing could be said.
    presets : tuple of Fitting
        Mappings of the package that fit, the best first.
    draft : Draft
        A mapping file to start from.
    """

    source: str
    format: str
    notes: tuple[str, ...]
    topics: tuple[TopicFacts, ...]
    roles: Roles
    without_role: tuple[str, ...]
    presets: tuple[Fitting, ...]
    draft: Draft

    def mapping(self) -> LogMapping:
        """Return the draft as a mapping.

        Returns
        -------
        mapping : LogMapping
            As :func:`~hydrodamp.ingest.mapping.read_mapping` would read it from its file.

        Raises
        ------
        LogError
            If too little was found to make a mapping of.
        """
        return LogMapping.from_dict(parse_yaml(self.draft.text, "the draft"), "the draft")


def probe(recording: Recording) -> Probe:
    """Look through a recording of which nothing is known.

    Parameters
    ----------
    recording : Recording
        As read.

    Returns
    -------
    probe : Probe
        Facts, guesses with their evidence, and a draft.

    Examples
    --------
    >>> import numpy as np
    >>> from hydrodamp.data.recording import Topic
    >>> time = np.arange(0.0, 60.0, 0.1)
    >>> table = Topic(
    ...     "", None, {"t": time, "yaw_deg": 30 * np.sin(time), "yaw_rate": 30 * np.cos(time)}
    ... )
    >>> found = probe(Recording((table,), "turns.csv", "text in columns"))
    >>> found.roles.rates.unit
    'deg/s'
    """
    roles = guess_roles(recording)
    return Probe(
        source=recording.source,
        format=recording.format,
        notes=recording.notes,
        topics=topics_of(recording),
        roles=roles,
        without_role=_silent(recording, roles),
        presets=fitting(recording, roles),
        draft=draft(recording, roles),
    )


def is_canonical(recording: Recording) -> bool:
    """Tell a table whose columns have the canonical names."""
    if len(recording.topics) != 1 or recording.topics[0].name:
        return False
    table = recording.topics[0]
    names = {*table.fields, *table.texts, *table.faults}
    return "time" in names and bool(names & set(VELOCITIES))


def _silent(recording: Recording, roles: Roles) -> tuple[str, ...]:
    told = {one.column for one in roles.guesses if one.role}
    unknown = Ticking(None, np.empty(0), "", 0, "")
    columns = [
        one.column
        for topic in recording.topics
        for one in series_of(topic, dict(roles.clocks).get(topic.name, unknown))
    ]
    return tuple(one for one in columns if one not in told and not NOISE & set(words(one)))
