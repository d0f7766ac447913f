"""Reading text, YAML and JSON; what is unreadable is refused with file and line."""

from __future__ import annotations

import difflib
import json
import os
import re
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hydrodamp.errors import FileError

if TYPE_CHECKING:
    import yaml

_ALIKE = 0.75
_STEMS_ALIKE = 0.5
_FLOAT = "tag:yaml.org,2002:float"
_TIMESTAMP = "tag:yaml.org,2002:timestamp"
_POWER_OF_TEN = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)[eE][-+]?[0-9]+$")


def load_text(path: str | os.PathLike[str]) -> str:
    """Return the text of a file."""
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise FileError(absent(path)) from error
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise FileError(
            f"{path}: must be UTF-8 text; near byte {error.start} it is not."
        ) from error


def absent(path: str | os.PathLike[str]) -> str:
    """Return what to say of a file that is not there, with its nearest neighbour."""
    near = neighbour(path)
    meant = "" if near is None else f" Did you mean '{near}'?"
    return f"{path}: cannot be read: No such file or directory.{meant}"


def neighbour(path: str | os.PathLike[str], suffixes: tuple[str, ...] = ()) -> Path | None:
    """Return the file that a path may have meant: one called nearly so in the same folder."""
    place = Path(path)
    if place.parent == place:  # a drive that is not there
        return None
    folder = place.parent if place.parent.is_dir() else neighbour(place.parent)
    if folder is None or not folder.is_dir():
        return None
    if folder != place.parent and (folder / place.name).exists():
        return folder / place.name
    try:
        there = {
            entry.name.casefold(): entry.name
            for entry in folder.iterdir()
            if not suffixes or entry.suffix.lower() in suffixes
        }
    except OSError:
        return None
    wanted = place.name.casefold()
    completed = [name for name in there if not place.suffix and Path(name).stem == wanted]
    alike = difflib.get_close_matches(wanted, there, n=5, cutoff=_ALIKE)
    near = [*completed, *(name for name in alike if _share(wanted, name) >= _STEMS_ALIKE)]
    return folder / there[near[0]] if near else None


def _share(one: str, other: str) -> float:
    """Return how much two names have in common without their suffixes, which say little."""
    return difflib.SequenceMatcher(None, Path(one).stem, Path(other).stem).ratio()


def load_json(path: str | os.PathLike[str]) -> object:
    """Return the content of a JSON file."""
    try:
        content: object = json.loads(load_text(path))
    except json.JSONDecodeError as error:
        raise FileError(
            f"{path}, line {error.lineno}: cannot be read as JSON: {error.msg} "
            f"at column {error.colno}."
        ) from error
    except (ValueError, RecursionError) as error:
        raise FileError(f"{path}: cannot be read as JSON: {error}.") from error
    return content


def load_yaml(path: str | os.PathLike[str]) -> object:
    """Return the content of a YAML file."""
    return parse_yaml(load_text(path), str(path))


def parse_yaml(text: str, source: str) -> object:
    """Return what a YAML text holds."""
    import yaml

    try:
        content: object = yaml.load(text, _loader())
    except yaml.YAMLError as error:
        problem = getattr(error, "problem", None) or getattr(error, "reason", error)
        line = _line(error, text)
        raise FileError(f"{source}, line {line}: cannot be read as YAML: {problem}.") from error
    except RecursionError as error:
        raise FileError(f"{source}: cannot be read as YAML: nested too deeply.") from error
    return content


def _line(error: yaml.YAMLError, text: str) -> int:
    """Return the line of an error; one in a single character tells its place in the text."""
    mark = getattr(error, "problem_mark", None)
    if mark is not None:
        return int(mark.line) + 1
    return text.count("\n", 0, getattr(error, "position", 0)) + 1


@lru_cache
def _loader() -> type[yaml.SafeLoader]:
    """Return the safe loader that also refuses what it would pass over or stumble on."""
    from yaml import MappingNode, Node, SafeLoader, ScalarNode
    from yaml.constructor import ConstructorError

    class Loader(SafeLoader):
        def compose_mapping_node(self, anchor: dict[Any, Node]) -> MappingNode:
            node = super().compose_mapping_node(anchor)
            first: dict[tuple[str, str], ScalarNode] = {}
            for key in (key for key, _ in node.value if isinstance(key, ScalarNode)):
                other = first.setdefault((key.tag, key.value), key)
                if other is not key:
                    line = other.start_mark.line + 1
                    problem = f"the key `{key.value}` stands in line {line} already"
                    raise ConstructorError(None, None, problem, key.start_mark)
            return node

        def construct_object(self, node: Node, deep: bool = False) -> Any:
            try:
                return super().construct_object(node, deep)
            except (ValueError, LookupError, AttributeError) as error:
                problem = f"the value is no {node.tag.rpartition(':')[2]}"
                raise ConstructorError(None, None, problem, node.start_mark) from error

    Loader.yaml_implicit_resolvers = {
        first: [(tag, spelling) for tag, spelling in kinds if tag != _TIMESTAMP]
        for first, kinds in SafeLoader.yaml_implicit_resolvers.items()
    }
    Loader.add_implicit_resolver(_FLOAT, _POWER_OF_TEN, list("-+.0123456789"))
    return Loader
