"""What a mapping asks for and a recording lacks, and the nearest it has."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import did_you_mean
from hydrodamp.ingest.mapping.entries import Entry

_LISTED = 12


def absences(
    entries: Sequence[Entry], recording: Recording, called: str, names: Sequence[str] = ()
) -> Iterator[str]:
    """Name what is absent, topic by topic."""
    tables = [topic for topic in recording.topics if not topic.name]
    topics: dict[str, list[str]] = {}
    for entry in entries:
        inside = _inside(entry.column, recording)
        if tables:
            known = [name for table in tables for name in (*table.fields, *table.texts)]
            near = did_you_mean(entry.column, known)
            takes = f"which {called} takes for `{entry.name}`"
            yield f"there is no column `{entry.column}`, {takes}.{near}"
        elif inside is not None:
            yield _no_field(entry, inside, called)
        else:
            name = _topic_of(entry.column, [topic.name for topic in recording.topics], names)
            topics.setdefault(name, []).append(entry.name)
    for name, channels in topics.items():
        yield _no_topic(name, channels, recording, called)


def _inside(column: str, recording: Recording) -> Topic | None:
    """Return the topic that a column names, if it is there."""
    there = [topic for topic in recording.topics if column.startswith(f"{topic.name}.")]
    return max(there, key=lambda topic: len(topic.name), default=None)


def _no_field(entry: Entry, topic: Topic, called: str) -> str:
    field = entry.column.removeprefix(f"{topic.name}.")
    takes = f"which {called} takes for `{entry.name}`"
    if field in topic.fields:
        needed = [name for source in entry.choices for name, _ in (*source.where, *source.plus)]
        return f"topic `{topic.name}` lacks one of `{' '.join(needed)}` beside `{field}`, {takes}"
    near = did_you_mean(field, (*topic.fields, *topic.texts))
    return f"topic `{topic.name}` has no field `{field}`, {takes}.{near}"


def _no_topic(name: str, channels: Sequence[str], recording: Recording, called: str) -> str:
    known = [topic.name for topic in recording.topics]
    more = len(known) - _LISTED
    listed = ", ".join(known[:_LISTED]) + (f" and {more} more" if more > 0 else "")
    return (
        f"there is no topic `{name}`, which {called} takes for `{' '.join(channels)}`."
        f"{did_you_mean(name, known)} There are: {listed or 'none'}. If it is called otherwise,"
        f" say so: `topics: {{{name}: ITS NAME}}`"
    )


def _topic_of(column: str, known: Sequence[str], names: Sequence[str]) -> str:
    """Guess which part of a column names the topic: a given name, or one like a topic there is."""
    given = [name for name in names if column.startswith(f"{name}.")]
    if given:
        return max(given, key=len)
    parts = column.split(".")
    heads = [".".join(parts[:count]) for count in range(len(parts) - 1, 0, -1)]
    near = [head for head in heads if did_you_mean(head, known)]
    return (near or heads[-1:] or [column])[0]
