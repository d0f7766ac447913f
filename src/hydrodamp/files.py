"""Text, YAML and JSON, read with line numbers and written whole or not at all."""

from __future__ import annotations

import difflib
import json
import os
import re
from collections import Counter, UserDict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeVar

from hydrodamp.errors import FileError

if TYPE_CHECKING:
    import yaml

Value = TypeVar("Value")

_POWER_OF_TEN = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)[eE][-+]?[0-9]+$")

MAX_DEPTH = 32  # levels of tables and lists; the deepest file of hydrodamp's has 8
MAX_NODES = 200_000  # values of a YAML file, aliases written out; a fleet vehicle has 300
_TOO_DEEP = f"tables and lists are nested more than {MAX_DEPTH} deep"

#: hydrodamp's own files: what one is, how it is given, and keys of which only it has any.
KINDS = {
    "log": ("a log", "give it as LOG", ""),
    "vehicle": ("a vehicle", "give it as `--vehicle`", "mass_matrix rigid_body added_mass"),
    "mapping": ("a mapping of a log", "give it as `--mapping`", "velocity topics"),
    "models": ("a file of models", "give it as `--models` or `--model`", "terms models"),
    "damping": ("a damping file", "give it as `--damping` to `hydrodamp simulate`", "coefficients"),
    "comparison": (
        "the result of a comparison",
        "look at it with `hydrodamp report` and its folder",
        "rows",
    ),
}


def load_text(path: str | os.PathLike[str]) -> str:
    """Return the text of a file."""
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise FileError(missing_file_message(path)) from error
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise FileError(
            f"{path}: must be UTF-8 text; near byte {error.start} it is not."
        ) from error


def missing_file_message(path: str | os.PathLike[str]) -> str:
    """Return the message for a file that does not exist, with its nearest neighbour."""
    return f"{path}: cannot be read: No such file or directory.{nearest_file(path)}"


def nearest_file(path: str | os.PathLike[str]) -> str:
    """Return a clause naming the file beside a path whose stem is nearest, in either case."""
    place = Path(path)
    beside = sorted(place.parent.iterdir()) if place.parent.is_dir() else ()
    there = {entry.stem.casefold(): entry for entry in beside}
    near = difflib.get_close_matches(place.stem.casefold(), there, n=1)
    return f" Did you mean '{there[near[0]]}'?" if near else ""


def load_json(path: str | os.PathLike[str]) -> object:
    """Return the content of a JSON file; a key given twice is refused."""
    try:
        content: object = json.loads(load_text(path), object_pairs_hook=_unique_keys)
    except json.JSONDecodeError as error:
        raise FileError(
            f"{path}, line {error.lineno}: cannot be read as JSON: {error.msg} "
            f"at column {error.colno}."
        ) from error
    except RecursionError as error:
        raise FileError(f"{path}: cannot be read as JSON: {_TOO_DEEP}.") from error
    except ValueError as error:  # a key given twice, or an integer of thousands of digits
        raise FileError(f"{path}: cannot be read as JSON: {error}.") from error
    if _is_too_deep(content):
        raise FileError(f"{path}: cannot be read as JSON: {_TOO_DEEP}.")
    return content


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        counts = Counter(key for key, _ in pairs)
        twice = next(key for key, count in counts.items() if count > 1)
        raise ValueError(f"the key `{twice}` is given {counts[twice]} times in one table; keep one")
    return table


def _is_too_deep(content: object) -> bool:
    """Return whether tables and lists are nested beyond :data:`MAX_DEPTH`, without recursion."""
    level = [content]
    for _ in range(MAX_DEPTH + 1):
        level = [
            part
            for each in level
            if isinstance(each, (dict, list))
            for part in (each.values() if isinstance(each, dict) else each)
        ]
    return any(isinstance(each, (dict, list)) for each in level)


def load_yaml(path: str | os.PathLike[str]) -> object:
    """Return the content of a YAML file."""
    return parse_yaml(load_text(path), str(path))


def parse_yaml(text: str, source: str) -> object:
    """Return what a YAML text holds; a key given twice is refused."""
    import yaml

    try:
        content: object = yaml.load(text, _loader())
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        # An error in a single character tells its place in the text instead of a mark.
        line = mark.line if mark else text.count("\n", 0, getattr(error, "position", 0))
        problem = getattr(error, "problem", None) or getattr(error, "reason", error)
        raise FileError(f"{source}, line {line + 1}: cannot be read as YAML: {problem}.") from error
    except RecursionError as error:
        raise FileError(f"{source}: cannot be read as YAML: {_TOO_DEEP}.") from error
    except (ValueError, OverflowError) as error:  # such as an integer of thousands of digits
        raise FileError(f"{source}: cannot be read as YAML: {error}.") from error
    return content


@lru_cache
def _loader() -> type[yaml.SafeLoader]:
    """Return the safe loader that refuses keys given twice, reads 1e3 and leaves dates as text."""
    from yaml import MappingNode, Node, SafeLoader, ScalarNode
    from yaml.constructor import ConstructorError

    class Loader(SafeLoader):
        def get_single_node(self) -> Node | None:
            """Return the document; one nested too deeply or that aliases blow up is refused."""
            root: Node | None = super().get_single_node()
            if root is not None:
                _count_nodes(root, {})
            return root

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

    Loader.yaml_implicit_resolvers = {
        first: [(tag, spelling) for tag, spelling in kinds if not tag.endswith(":timestamp")]
        for first, kinds in SafeLoader.yaml_implicit_resolvers.items()
    }
    Loader.add_implicit_resolver("tag:yaml.org,2002:float", _POWER_OF_TEN, list("-+.0123456789"))
    return Loader


def _count_nodes(node: yaml.Node, counts: dict[int, int], depth: int = 0) -> int:
    """Return how many nodes a node stands for once its aliases are replaced by what they name."""
    from yaml.constructor import ConstructorError

    if depth > MAX_DEPTH:
        raise ConstructorError(None, None, _TOO_DEEP, node.start_mark)
    if id(node) not in counts:
        counts[id(node)] = MAX_NODES  # until it is counted: a node inside itself has no end
        parts = node.value if isinstance(node.value, list) else ()
        inner = (part for each in parts for part in (each if isinstance(each, tuple) else (each,)))
        counts[id(node)] = 1 + sum(_count_nodes(part, counts, depth + 1) for part in inner)
    if counts[id(node)] > MAX_NODES:
        problem = f"with its aliases written out it holds more than {MAX_NODES} values"
        raise ConstructorError(None, None, problem, node.start_mark)
    return counts[id(node)]


class PackageData(UserDict[str, Value]):
    """Values made from YAML files that come with the package, each when it is first asked for."""

    def __init__(self, folder: Path, make: Callable[[str], Value]) -> None:
        self.data: dict[str, Any] = {
            f.stem: f for f in sorted(folder.glob("*.yaml"), key=lambda f: f.stem)
        }
        self._make = lru_cache(None)(make)

    def text(self, name: str) -> str:
        """Return the text of one file."""
        return str(self.data[name].read_text("utf-8"))

    def __getitem__(self, name: str) -> Value:
        """Return one value."""
        return self._make(name)


def wrong_kind_message(content: object, source: str, wanted: str) -> str:
    """Return the message for a file that is another of hydrodamp's own than was asked for."""
    if not isinstance(content, Mapping) or isinstance(content.get("time"), list):
        return ""
    kinds = {key: kind for kind, (_, _, keys) in KINDS.items() for key in keys.split()}
    found = {kinds[key]: key for key in content if key in kinds}
    if not found or wanted in found:
        return ""
    kind, key = found.popitem()
    name, use, _ = KINDS[kind]
    return f"{source} is {name} (it has {key}), not {KINDS[wanted][0]}: {use}."


def temporary_prefix(target: Path) -> str:
    """Return how the names of temporary files of a target begin; 16 hexadecimal digits follow."""
    return f".hydrodamp-{target.name[:100]}-"


@contextmanager
def open_atomic(path: str | os.PathLike[str], *, binary: bool = False) -> Iterator[IO[Any]]:
    """Open a temporary file beside ``path`` that takes its place once all of it is on the disk."""
    target = Path(path)
    temporary = target.parent / f"{temporary_prefix(target)}{os.urandom(8).hex()}"
    try:
        with (
            temporary.open("xb") if binary else temporary.open("x", encoding="utf-8", newline="")
        ) as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(target)
    except OSError as error:
        raise FileError(
            f"{target}: cannot be written: {error.strerror or error}. Make room, close it in other "
            "programs, or give a file in a folder that exists and may be written."
        ) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def save_text(text: str, path: str | os.PathLike[str]) -> None:
    """Write a text file whole or not at all."""
    with open_atomic(path) as stream:
        stream.write(text)


def save_json(document: object, path: str | os.PathLike[str]) -> None:
    """Write a document of strict JSON whole or not at all."""
    save_text(as_json(document), path)


def as_json(document: object) -> str:
    """Return a document as strict JSON."""
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def save_bytes(content: bytes, path: str | os.PathLike[str]) -> None:
    """Write a file of bytes whole or not at all."""
    with open_atomic(path, binary=True) as stream:
        stream.write(content)


def save_all(contents: Mapping[Path, bytes]) -> None:
    """Write files in their order, each whole or not at all, and make their folders."""
    for path, content in contents.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(
                f"{path.parent}: the folder cannot be made: {error.strerror}."
            ) from error
        save_bytes(content, path)


def check_folder(path: str | os.PathLike[str]) -> None:
    """Refuse a folder that cannot be made or written, before work starts."""
    folder = Path(path).absolute()
    there = next(each for each in (folder, *folder.parents) if each.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        reason = "may not be written" if there.is_dir() else "is a file"
        raise FileError(f"{path}: cannot be written: {there} {reason}. Give another one.")


def check_file(path: str | os.PathLike[str]) -> None:
    """Refuse a file that cannot be written, before work starts."""
    target = Path(path)
    if target.is_dir():
        raise FileError(f"{target}: is a folder; name a file in it.")
    if not target.parent.is_dir():
        raise FileError(f"{target}: cannot be written: there is no folder {target.parent}.")
    check_folder(target.parent)
