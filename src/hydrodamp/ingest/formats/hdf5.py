"""Arrays of HDF5 files, which MATLAB 7.3 and netCDF-4 files are too, with their attributes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from hydrodamp.errors import LogError, first_few
from hydrodamp.files import MAX_DEPTH
from hydrodamp.ingest.formats.content import check_cells, check_unpacked, open_seekable
from hydrodamp.ingest.formats.netcdf import ATTRIBUTES, Attributes

_DIMENSION = "This is a netCDF dimension but not a netCDF variable"


def read_hdf5(
    path: str | Path, notes: list[str], attributes: Attributes
) -> Iterator[tuple[str, Any]]:
    """Yield the arrays of HDF5; MATLAB 7.3 files are HDF5 with transposed arrays."""
    import h5py

    nodes: dict[str, Any] = {}
    with open_seekable(path) as content, h5py.File(content, "r") as file:

        def collect(name: str, node: Any) -> bool | None:
            nodes[name] = node
            return name.count("/") >= MAX_DEPTH or None  # a value ends the visit

        if file.visititems(collect):
            raise LogError(
                f"groups are nested more than {MAX_DEPTH} deep, which is implausible for a log."
                " Move the arrays to groups nearer to the root",
                source=str(path),
            )
        _check_storage(file, nodes, path)
        attributes[""] = dict.fromkeys(file.attrs)
        for key, node in nodes.items():
            name, kind = key.replace("/", "."), node.attrs.get("MATLAB_class", b"")
            skipped = name.startswith("#") or not isinstance(node, h5py.Dataset)
            skipped |= _DIMENSION in str(node.attrs.get("NAME", ""))
            if skipped or kind in (b"char", b"cell") or "MATLAB_empty" in node.attrs:
                continue
            attributes[name] = {key: node.attrs[key] for key in ATTRIBUTES if key in node.attrs}
            if node.dtype.kind in "buif":
                yield name, node[()].T if kind else node[()]
            else:
                notes.append(f"`{name}` of type {node.dtype} holds no numbers; it was skipped")


def _check_storage(file: Any, nodes: Mapping[str, Any], path: str | Path) -> None:
    """Refuse links to other files and implausible compression ratios."""
    import h5py

    arrays = {name: node for name, node in nodes.items() if isinstance(node, h5py.Dataset)}
    groups = [file, *(node for node in nodes.values() if isinstance(node, h5py.Group))]
    external = [
        f"`{f'{group.name}/{key}'.strip('/')}`"
        for group in groups
        for key in group
        if isinstance(group.get(key, getlink=True), h5py.ExternalLink)
    ]
    external += [f"`{name}`" for name, node in arrays.items() if _is_external(node)]
    if external:
        raise LogError(
            f"the values of {', '.join(first_few(external, 3, 'names'))} are stored in other"
            " files, which are never opened: a link can name any file of this computer. Store them"
            " in this file (`h5repack`, or copy the arrays)",
            source=str(path),
        )
    check_unpacked(sum(node.nbytes for node in arrays.values()), path)
    check_cells(sum(node.size for node in arrays.values() if node.ndim in (1, 2)), path)


def _is_external(node: Any) -> bool:
    """Return whether a dataset is stored in another file."""
    virtual = node.virtual_sources() if node.is_virtual else ()
    return bool(node.external) or any(source.file_name != "." for source in virtual)
