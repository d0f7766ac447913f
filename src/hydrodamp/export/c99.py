"""C99: hydrodamp's own files, unchanged, and one header of a vehicle and its model."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from cffi import FFI

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.export.compiling import HEADERS, ON_BOARD, SOURCES, own_files, shared, size_of
from hydrodamp.export.craft import Craft
from hydrodamp.export.printer import C99, SPEED, actuation, command, matrix, name_of, said_of
from hydrodamp.export.target import Engine, Files, Target, by_rate, rendered

_CALL = "void acceleration(const {0} *, const {0} *, const {0} *, const {0} *, {0} *);"


@dataclass(frozen=True)
class C(Target):
    """A C99 library: no allocation, no input or output, no state between calls.

    Parameters
    ----------
    precision : str
        ``double`` or ``float``: what is run, and what CMake builds unless told otherwise.
    """

    key: ClassVar[str] = "c"
    meant: ClassVar[str] = "C99"
    precision: str = "double"

    def __post_init__(self) -> None:
        """Refuse what is no type of numbers."""
        if self.precision not in ("double", "float"):
            raise MethodError(f"`precision` must be double or float; got '{self.precision}'.")

    @property
    def flags(self) -> tuple[str, ...]:
        """What the compiler is told of it."""
        return ("-DHD_FLOAT",) if self.precision == "float" else ()

    def write(self, craft: Craft) -> Files:
        """Return the header, an example and hydrodamp's own files."""
        said = said_of(craft, ",\n    ")
        name, header = name_of(craft), header_of(craft)
        own = own_files((*HEADERS, *SOURCES, *ON_BOARD))
        called = rendered("called.c.j2", name=name).encode()
        measured = {**own_files((*HEADERS, *SOURCES)), f"{name}.h": header.encode()}
        size = size_of({**measured, "called.c": called}, self.flags)
        said |= {"precision": self.precision, "sources": (*SOURCES, *ON_BOARD), "size": size}
        return {
            f"{name}.h": header,
            "main.c": rendered("main.c.j2", **said),
            "CMakeLists.txt": rendered("CMakeLists.txt.j2", **said),
            "README.md": rendered("readme_c.md.j2", **said),
            **own,
        }

    def read(self, folder: Path, craft: Craft) -> Engine:
        """Compile the files, and return the accelerations of the library."""
        name = name_of(craft)
        ffi: Any = FFI()
        with tempfile.TemporaryDirectory() as place:
            library, called = Path(place, "vehicle.so"), Path(place, "called.c")
            called.write_text(rendered("called.c.j2", name=name), encoding="utf-8")
            sources = (*SOURCES, *ON_BOARD, str(called))
            by = shared(folder, sources, (*self.flags, f"-I{folder}"), library)
            ffi.cdef(_CALL.format(self.precision))
            loaded = ffi.dlopen(str(library))
        real = np.float64 if self.precision == "double" else np.float32
        out, pointed = np.empty(6, real), ffi.typeof(f"{self.precision}[]")

        def rate(*given: FloatArray) -> FloatArray:
            arrays = (*(np.array(each, real) for each in given), out)
            loaded.acceleration(*(ffi.from_buffer(pointed, each) for each in arrays))
            return out.astype(np.float64)

        return by_rate(f"{by}, {self.precision}", rate)


def header_of(craft: Craft) -> str:
    """Return the header of constants and functions of a vehicle."""
    table, lines = craft.columns, [*actuation(craft, C99)]
    terms = (*craft.known, *craft.damping.model.basis)
    said = said_of(craft, ",\n    ", "{}")
    name, text = said["name"], "\n".join(f"    {line}" for line in lines)
    for function in ("larger", "smaller", "along"):
        text = text.replace(f"{function}(", f"{name}_{function}(")
    channels = [command(channel) for channel in table.channels]
    return rendered(
        "vehicle.h.j2",
        **said,
        n_known=table.n_known,
        factors=table.plant.factors.tolist(),
        terms=[str(term) for term in terms],
        matrix=matrix(craft.matrix.tolist(), ",\n    ", "{}"),
        free=[int(free) for free in craft.vehicle.free],
        channels=channels,
        lines=text,
        speed=SPEED if craft.needs_speed or f" {SPEED} =" in text else "0",
    )
