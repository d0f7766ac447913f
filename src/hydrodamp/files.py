"""Text, YAML and JSON files: errors with line numbers, and atomic writes."""

from __future__ import annotations

import difflib
import json
import os
import re
from collections import Counter, UserDict
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import lru_cache
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeVar

from hydrodamp.errors import FileError

if TYPE_CHECKING:
    import yaml

Value = TypeVar("Value")

_inputs: ContextVar[tuple[Path, ...]] = ContextVar("inputs", default=())

_POWER_OF_TEN = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)[eE][-+]?[0-9]+$")

MAX_DEPTH = 32  # levels of tables and lists; the deepest file of hydrodamp has 8
MAX_NODES = 200_000  # values of a YAML file, aliases written out; a fleet vehicle has 300
_TOO_DEEP = f"tables and lists are nested more than {MAX_DEPTH} deep"

#: Kinds of hydrodamp files: name, how to pass one, and keys that occur in no other kind.
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
    if fault := irregular_file(path):
        raise FileError(f"{path}: {fault}")
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


def irregular_file(path: str | os.PathLike[str]) -> str:
    """Return the fault of a path that is no file, such as a pipe, without opening it."""
    target = Path(path)
    if target.is_symlink() and not target.exists():
        return "it is a link to a file that does not exist. Correct or delete the link"
    if target.exists() and not target.is_file() and not target.is_dir():
        return "it is a pipe, a socket or a device. Give a file that holds its content"
    return ""


def missing_file_message(path: str | os.PathLike[str]) -> str:
    """Return the message for a file that does not exist, with the most similar name."""
    return f"{path}: cannot be read: No such file or directory.{nearest_file(path)}"


def nearest_file(path: str | os.PathLike[str]) -> str:
    """Return a question naming the file in the same folder with the most similar stem."""
    target = Path(path)
    entries = sorted(target.parent.iterdir()) if target.parent.is_dir() else ()
    stems = {entry.stem.casefold(): entry for entry in entries}
    matches = difflib.get_close_matches(target.stem.casefold(), stems, n=1)
    return f" Did you mean '{stems[matches[0]]}'?" if matches else ""


def load_json(path: str | os.PathLike[str]) -> object:
    """Return the content of a JSON file; refuse duplicate keys."""
    try:
        content: object = json.loads(load_text(path), object_pairs_hook=_unique_keys)
    except json.JSONDecodeError as error:
        raise FileError(
            f"{path}, line {error.lineno}: cannot be read as JSON: {error.msg} "
            f"at column {error.colno}."
        ) from error
    except RecursionError as error:
        raise FileError(f"{path}: cannot be read as JSON: {_TOO_DEEP}.") from error
    except ValueError as error:  # a duplicate key, or an integer of thousands of digits
        raise FileError(f"{path}: cannot be read as JSON: {error}.") from error
    if _is_too_deep(content):
        raise FileError(f"{path}: cannot be read as JSON: {_TOO_DEEP}.")
    return content


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        counts = Counter(key for key, _ in pairs)
        key, count = counts.most_common(1)[0]
        raise ValueError(f"the key `{key}` is given {count} times in one table; keep one")
    return table


def _is_too_deep(content: object) -> bool:
    """Return whether tables and lists are nested beyond :data:`MAX_DEPTH`, without recursion."""
    level = [content]
    for _ in range(MAX_DEPTH + 1):
        containers = [value for value in level if isinstance(value, (dict, list))]
        level = [x for v in containers for x in (v.values() if isinstance(v, dict) else v)]
    return any(isinstance(value, (dict, list)) for value in level)


def load_yaml(path: str | os.PathLike[str]) -> object:
    """Return the content of a YAML file."""
    return parse_yaml(load_text(path), str(path))


def parse_yaml(text: str, source: str) -> object:
    """Return the content of a YAML text; refuse duplicate keys."""
    import yaml

    try:
        content: object = yaml.load(text, _loader())
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        # An error in a single character has a position in the text instead of a mark.
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
    """Return a safe loader that refuses duplicate keys, reads 1e3 as float and dates as text."""
    from yaml import MappingNode, Node, SafeLoader, ScalarNode
    from yaml.constructor import ConstructorError

    class Loader(SafeLoader):
        def get_single_node(self) -> Node | None:
            """Return the document; refuse excessive nesting and alias expansion."""
            root: Node | None = super().get_single_node()
            if root is not None:
                _count_nodes(root, {})
            return root

        def compose_mapping_node(self, anchor: dict[Any, Node]) -> MappingNode:
            node = super().compose_mapping_node(anchor)
            first: dict[tuple[str, str], ScalarNode] = {}
            for key in (key for key, _ in node.value if isinstance(key, ScalarNode)):
                earlier = first.setdefault((key.tag, key.value), key)
                if earlier is not key:
                    line = earlier.start_mark.line + 1
                    problem = f"the key `{key.value}` is in line {line} already"
                    raise ConstructorError(None, None, problem, key.start_mark)
            return node

    Loader.yaml_implicit_resolvers = {
        first: [(tag, spelling) for tag, spelling in kinds if not tag.endswith(":timestamp")]
        for first, kinds in SafeLoader.yaml_implicit_resolvers.items()
    }
    Loader.add_implicit_resolver("tag:yaml.org,2002:float", _POWER_OF_TEN, list("-+.0123456789"))
    return Loader


def _count_nodes(node: yaml.Node, counts: dict[int, int], depth: int = 0) -> int:
    """Return the number of nodes below a node after expansion of its aliases."""
    from yaml.constructor import ConstructorError

    if depth > MAX_DEPTH:
        raise ConstructorError(None, None, _TOO_DEEP, node.start_mark)
    if id(node) not in counts:
        counts[id(node)] = MAX_NODES  # until it is counted: a node may contain itself
        entries = node.value if isinstance(node.value, list) else ()
        children = (
            x for entry in entries for x in (entry if isinstance(entry, tuple) else [entry])
        )
        counts[id(node)] = 1 + sum(_count_nodes(child, counts, depth + 1) for child in children)
    if counts[id(node)] > MAX_NODES:
        problem = f"with aliases expanded it has more than {MAX_NODES} values"
        raise ConstructorError(None, None, problem, node.start_mark)
    return counts[id(node)]


class PackageData(UserDict[str, Value]):
    """Mapping of values parsed lazily from YAML files of the package."""

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


def wrong_kind_message(content: object, source: str, required: str) -> str:
    """Return the message for a hydrodamp file of another kind than required; empty if none."""
    if not isinstance(content, Mapping) or isinstance(content.get("time"), list):
        return ""
    kinds = {key: kind for kind, (_, _, keys) in KINDS.items() for key in keys.split()}
    matches = {kinds[key]: key for key in content if key in kinds}
    if not matches or required in matches:
        return ""
    kind, key = matches.popitem()
    name, use, _ = KINDS[kind]
    return f"{source} is {name} (it has {key}), not {KINDS[required][0]}: {use}."


def temporary_prefix(target: Path) -> str:
    """Return the prefix of temporary files of a target; 16 hexadecimal digits follow."""
    return f".hydrodamp-{target.name[:100]}-"


@contextmanager
def open_atomic(path: str | os.PathLike[str], *, binary: bool = False) -> Iterator[IO[Any]]:
    """Open a temporary file that replaces ``path`` once all of it is on the disk."""
    target = Path(path)
    refuse_input(target)
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
        raise write_error(target, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_error(target: Path, error: OSError) -> FileError:
    """Return the error of a file or folder that cannot be written, with the remedy."""
    return FileError(
        f"{target}: cannot be written: {error.strerror or error}. Free disk space, close it in "
        "other programs, or give a file in a writable folder."
    )


def save_text(text: str, path: str | os.PathLike[str]) -> None:
    """Write a text file atomically."""
    with open_atomic(path) as stream:
        stream.write(text)


def save_json(document: object, path: str | os.PathLike[str]) -> None:
    """Write a document as strict JSON atomically."""
    save_text(as_json(document), path)


def as_json(document: object) -> str:
    """Return a document as strict JSON."""
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def save_bytes(content: bytes, path: str | os.PathLike[str]) -> None:
    """Write a file of bytes atomically."""
    with open_atomic(path, binary=True) as stream:
        stream.write(content)


def save_all(contents: Mapping[Path, bytes]) -> None:
    """Write files in their order, each atomically, and create their folders."""
    for path, content in contents.items():
        create_folder(path.parent)
        save_bytes(content, path)


def write_new_file(path: Path, content: bytes, target: Path) -> None:
    """Write a file and its folder to the disk; an error names the file that it is to replace."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("xb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
    except OSError as error:
        raise write_error(target, error) from error


def create_folder(folder: Path) -> None:
    """Create a folder where there is none."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{folder}: the folder cannot be created: {error.strerror}.") from error


@contextmanager
def protected_inputs(paths: Iterable[Path]) -> Iterator[None]:
    """Refuse to replace files as long as a command runs that reads them."""
    token = _inputs.set(tuple(paths))
    try:
        yield
    finally:
        _inputs.reset(token)


def refuse_input(path: Path) -> None:
    """Refuse to replace an input of the running command, which a link may name too."""
    for each in _inputs.get() if path.is_file() else ():
        if each.is_file() and each.samefile(path):
            raise FileError(f"{path}: is one of the inputs ({each}): give another file or folder.")


def check_folder(path: str | os.PathLike[str]) -> None:
    """Refuse a folder that cannot be created or written, before work starts."""
    folder = Path(path).absolute()
    existing = next(parent for parent in (folder, *folder.parents) if parent.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        reason = "is not writable" if existing.is_dir() else "is a file"
        raise FileError(f"{path}: cannot be written: {existing} {reason}. Give another one.")


def check_file(path: str | os.PathLike[str]) -> None:
    """Refuse a file that cannot be written, before work starts."""
    target = Path(path)
    if target.is_dir():
        raise FileError(f"{target}: is a folder; name a file in it.")
    if not target.parent.is_dir():
        raise FileError(f"{target}: cannot be written: there is no folder {target.parent}.")
    check_folder(target.parent)
    refuse_input(target)
