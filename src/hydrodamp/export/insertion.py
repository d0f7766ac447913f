"""Blocks of an export in a user's SDF or URDF; every other byte of the file remains.

Each block is between two comments, directly before the end tag of its element, so that its removal
gives the bytes of the original file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from hydrodamp.errors import FileError, MethodError, no_such
from hydrodamp.export.gazebo import BLOCKS
from hydrodamp.files import open_atomic

BEGIN, END = b"<!-- hydrodamp begin -->", b"<!-- hydrodamp end -->"
_BLOCK = re.compile(re.escape(BEGIN) + b".*?" + re.escape(END), re.DOTALL)
_PRESENT = re.compile(rb"<fluid_added_mass|gz-sim-hydrodynamics-system|libSimpleHydrodynamics")


@dataclass
class _Element:
    """An XML element: bytes of its start and of its end tag."""

    tag: str
    name: str
    start: int
    parent: _Element | None
    end: int = -1
    children: list[_Element] = field(default_factory=list)

    @property
    def scoped_name(self) -> str:
        """Name of a link behind those of its models."""
        parent = self.parent
        if parent is None or parent.tag != "model":
            return self.name
        return f"{parent.scoped_name}::{self.name}"

    def descendants(self) -> Iterator[_Element]:
        """Yield the element and all below it."""
        yield self
        for child in self.children:
            yield from child.descendants()


def remove_blocks(path: Path) -> None:
    """Remove the blocks of an earlier insertion from a file."""
    _save(path, _read_original(path))


def find_link(path: Path, name: str) -> str:
    """Return the name of a link of a file, by default of its only one."""
    return _find_link(_read_original(path), path, name).scoped_name


def insert_blocks(path: Path, name: str, folder: Path) -> None:
    """Write the blocks in the folder of an export into a file, in place of earlier ones."""
    content = _read_original(path)
    link = _find_link(content, path, name)
    added, systems, urdf = ((folder / block).read_bytes().strip() for block in BLOCKS)
    model, ends = link.parent, [each.end for each in link.children if each.tag == "inertial"]
    if model is None or content[model.end : model.end + 2] != b"</":
        raise FileError(f"{path}: must be SDF or URDF in UTF-8.")
    if present := _PRESENT.search(content, model.start, model.end):
        raise FileError(
            f"{path}: has hydrodynamics already, `{present[0].decode()}`. Remove it, so that it "
            "does not act twice."
        )
    if model.tag == "robot":
        if added:
            raise MethodError(
                f"{path}: a URDF has no <fluid_added_mass>: convert it by `gz sdf -p`, or use the "
                "added mass of the system by `--set legacy=true`."
            )
        systems = urdf
    elif added and (not ends or content[ends[0] : ends[0] + 2] != b"</"):
        raise FileError(f"{path}: link '{name}' has no <inertial> for the added mass: add it.")
    newline = b"\r\n" if b"\r\n" in content else b"\n"
    blocks = [(model.end, systems), *((end, added) for end in ends[:1] if added)]
    for end, block in blocks:  # from the last one on
        marked = newline.join((BEGIN, *block.splitlines(), END))
        content = content[:end] + marked + content[end:]
    _save(path, content)


def _read_original(path: Path) -> bytes:
    """Return the bytes of a file without blocks."""
    try:
        return _BLOCK.sub(b"", path.read_bytes())
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}.") from error


def _save(path: Path, content: bytes) -> None:
    target = path.resolve()
    mode = target.stat().st_mode
    with open_atomic(target, binary=True) as stream:
        stream.write(content)
    target.chmod(mode)


def _find_link(content: bytes, path: Path, name: str) -> _Element:
    links = [each for each in _parse(content, path).descendants() if each.tag == "link"]
    links = [link for link in links if link.parent and link.parent.tag in ("model", "robot")]
    names = [link.scoped_name for link in links]
    chosen = [link for link in links if name in ("", link.name, link.scoped_name)]
    if len(chosen) == 1:
        return chosen[0]
    if chosen:
        raise MethodError(f"{path}: has several links; give `--link`: {', '.join(names)}.")
    raise MethodError(f"{path}: {no_such('link', name, names)}.")


def _parse(content: bytes, path: Path) -> _Element:
    """Return the root above the elements of an XML file."""
    root = element = _Element("", "", 0, None)
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal element
        child = _Element(tag, attributes.get("name", ""), parser.CurrentByteIndex, element)
        element.children.append(child)
        element = child

    def end(tag: str) -> None:
        nonlocal element
        element.end = parser.CurrentByteIndex
        element = element.parent or root

    parser.StartElementHandler, parser.EndElementHandler = start, end
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise FileError(f"{path}: is no XML: {error}.") from error
    return root
