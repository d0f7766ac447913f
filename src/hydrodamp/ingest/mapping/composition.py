"""Presets, and mapping files that change others."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from hydrodamp.errors import LogError, did_you_mean
from hydrodamp.files import load_yaml, mistaken, neighbour, parse_yaml

_SUFFIX = ".yaml"


def presets() -> tuple[str, ...]:
    """Return the names of the mappings that come with the package.

    Returns
    -------
    names : tuple of str
        Sorted; each may be given wherever a mapping file may.

    Examples
    --------
    >>> "mavros" in presets()
    True
    """
    folder = resources.files(__package__) / "presets"
    files = (item.name for item in folder.iterdir())
    return tuple(sorted(name.removesuffix(_SUFFIX) for name in files if name.endswith(_SUFFIX)))


@lru_cache
def _preset(name: str) -> object:
    text = (resources.files(__package__) / "presets" / f"{name}{_SUFFIX}").read_text("utf-8")
    return parse_yaml(text, name)


def load(place: str | Path, beside: Path | None = None) -> tuple[object, Path | None]:
    """Return the content of a preset or of a mapping file."""
    text = str(place)
    if isinstance(place, str) and text in presets():
        return _preset(text), None
    path = Path(text) if beside is None else beside / text
    if isinstance(place, str) and "/" not in text and not Path(text).suffix and not path.exists():
        known = presets()
        meant = did_you_mean(text, known)
        if not meant and (near := neighbour(path, (".yaml", ".yml"))):
            meant = f" Did you mean '{near}'?"
        raise LogError(
            f"there is no preset '{text}'.{meant} The presets are: {', '.join(known)}. A mapping "
            "file is named with its suffix"
        )
    content = load_yaml(path)
    if other := mistaken(content, str(path), "mapping"):
        raise LogError(other)
    return content, path


def composed(content: dict[Any, Any], path: Path | None = None) -> dict[Any, Any]:
    """Return a mapping with everything it extends filled in."""
    return _without_nothing(_merged(content, path, (str(path),) if path else ()))


def _merged(content: dict[Any, Any], path: Path | None, seen: tuple[str, ...]) -> dict[Any, Any]:
    whole: dict[Any, Any] = {}
    for place in _extended(content):
        if place in seen:
            raise LogError(f"mappings extend one another in a ring: {' -> '.join((*seen, place))}")
        other, found = load(place, path.parent if path else None)
        if not isinstance(other, dict):
            raise LogError(f"`extends: {place}` holds no mapping; it must be a table")
        whole = _over(whole, _merged(other, found, (*seen, place)))
    return _over(whole, {key: given for key, given in content.items() if key != "extends"})


def _extended(content: dict[Any, Any]) -> Iterator[str]:
    given = content.get("extends", [])
    for place in [given] if isinstance(given, str) else given or []:
        if not isinstance(place, str):
            raise LogError(f"`extends` must be the name of a preset or a path; got {place!r}")
        yield place


def _over(below: dict[Any, Any], above: dict[Any, Any]) -> dict[Any, Any]:
    """Lay one table over another: groups channel by channel, all else whole."""
    whole = dict(below)
    for key, given in above.items():
        under = _named(key, whole.get(key))
        given = _named(key, given)
        nested = (
            isinstance(under, dict) and isinstance(given, dict) and key not in ("time", "clock")
        )
        whole[key] = (
            {**under, **given}
            if nested and isinstance(under, dict) and isinstance(given, dict)
            else given
        )
    return whole


def _named(key: object, given: object) -> object:
    """Write a list of commands as a table."""
    if key == "commands" and isinstance(given, list):
        return {str(name): name for name in given}
    return given


def _without_nothing(content: dict[Any, Any]) -> dict[Any, Any]:
    """Leave out channels given as null."""
    return {
        key: {name: one for name, one in given.items() if one is not None}
        if isinstance(given, dict) and key not in ("time", "clock")
        else given
        for key, given in content.items()
    }
