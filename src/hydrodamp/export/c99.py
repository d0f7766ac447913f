"""C99: hydrodamp's own files, unchanged, one header of a vehicle and its model, the compilers."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from cffi import FFI

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import demand
from hydrodamp.export.craft import Craft, States, parts
from hydrodamp.export.drive import Engine
from hydrodamp.export.printer import C99, command, name_of, said_of
from hydrodamp.export.target import Files, NotRun, Target, rendered, version_of
from hydrodamp.files import save_all

#: What a vehicle's header stands on, and what is there for the estimators on board.
SOURCES = ("atoms.c", "attitude.c", "cholesky.c", "motion.c")
HEADERS = ("batch.h", "onboard.h")
ON_BOARD = ("adaptive.c", "blocks.c", "recursive.c", "steps.c")

#: The same bits everywhere: no contraction to fused multiply-add, no reordered sums.
STRICT = ("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror")

_CORTEX_M7 = ("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard")


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
        known = self.precision in ("double", "float")
        demand(known, "precision", "double or float", f"'{self.precision}'.")

    @property
    def flags(self) -> tuple[str, ...]:
        """What the compiler is told of it."""
        return ("-DHD_FLOAT",) if self.precision == "float" else ()

    def write(self, craft: Craft) -> Files:
        """Return the header, an example and hydrodamp's own files."""
        name, header = name_of(craft), header_of(craft)
        own = own_files((*HEADERS, *SOURCES, *ON_BOARD))
        called = rendered("called.c.j2", name=name).encode()
        measured = {**own_files((*HEADERS, *SOURCES)), f"{name}.h": header.encode()}
        size = size_of({**measured, "called.c": called}, self.flags)
        built = {"precision": self.precision, "sources": (*SOURCES, *ON_BOARD), "size": size}
        said = said_of(craft) | built
        return {
            f"{name}.h": header,
            "main.c": rendered("main.c.j2", **said),
            "CMakeLists.txt": rendered("CMakeLists.txt.j2", **said),
            "README.md": rendered("readme_c.md.j2", **said),
            **own,
        }

    @contextmanager
    def read(self, folder: Path, craft: Craft) -> Iterator[Engine]:
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
        pointed = ffi.typeof(f"{self.precision}[]")

        def rates(at: States) -> FloatArray:
            found = np.empty((len(at.velocity), 6), real)
            for row in zip(*(each.astype(real) for each in parts(at)), found, strict=True):
                loaded.acceleration(*(ffi.from_buffer(pointed, each) for each in row))
            return found.astype(np.float64)

        yield Engine(f"{by}, {self.precision}", rates)


def header_of(craft: Craft) -> str:
    """Return the header of constants and functions of a vehicle."""
    table = craft.columns
    return rendered(
        "vehicle.h.j2",
        **said_of(craft, C99),
        factors=table.plant.factors.tolist(),
        free=craft.vehicle.free.astype(int).tolist(),
        of_terms=[command(channel) for channel in table.channels],
    )


def own_files(names: Sequence[str]) -> dict[str, bytes]:
    """Return some of hydrodamp's own C files, unchanged."""
    folder = files("hydrodamp.kernels").joinpath("csrc")
    return {name: folder.joinpath(name).read_bytes() for name in names}


def compiler() -> str:
    """Return the C compiler that is here, or say that there is none."""
    found = next((name for name in ("cc", "gcc", "clang") if shutil.which(name)), None)
    if found is None:
        raise NotRun("no C compiler (cc, gcc or clang) is installed")
    return found


def shared(folder: Path, sources: Sequence[str], flags: Sequence[str], library: Path) -> str:
    """Compile a shared library, every warning an error; return what compiled it."""
    call = [compiler(), *STRICT, "-fPIC", "-shared", *flags, *sources, "-lm", "-o", str(library)]
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise NotRun(f"{call[0]} refused it: {done.stderr.strip().rstrip('.')}")
    return version_of(call[0])


def size_of(contents: Mapping[str, bytes], flags: Sequence[str]) -> str:
    """Tell what sources take on a Cortex-M7, else on this machine; nothing where no gcc can."""
    kits = {"arm-none-eabi-": _CORTEX_M7, "": ()}
    found = (_size_by(prefix, kit, contents, flags) for prefix, kit in kits.items())
    return next(filter(None, found), "")


def _size_by(
    prefix: str, kit: Sequence[str], contents: Mapping[str, bytes], flags: Sequence[str]
) -> str:
    if not shutil.which(f"{prefix}gcc"):
        return ""
    with tempfile.TemporaryDirectory() as place:
        save_all({Path(place, name): content for name, content in contents.items()})
        sources = [name for name in contents if name.endswith(".c")]
        call = [f"{prefix}gcc", *STRICT, "-Os", "-fstack-usage", *kit, *flags, "-c"]
        if subprocess.run([*call, *sources], cwd=place, capture_output=True).returncode:
            return ""  # a cross compiler without its C library
        sizes = [f"{prefix}size", *(f"{Path(name).stem}.o" for name in sources)]
        told = subprocess.run(sizes, cwd=place, capture_output=True, text=True, check=True).stdout
        rows = np.array([line.split()[:3] for line in told.splitlines()[1:]], dtype=int)
        frames = " ".join(each.read_text() for each in Path(place).glob("*.su"))
    code, data, unset = rows.sum(axis=0).tolist()
    # No function calls itself, so that all frames together are more than there ever are.
    stack = sum(map(int, re.findall(r"\t(\d+)\t", frames)))
    processor = "a Cortex-M7" if prefix else "this machine"
    return (
        f"By {prefix}gcc -Os for {processor}: {code} bytes of code and constants, {data + unset} "
        f"bytes of variables, at most {stack} bytes of stack for a step."
    )
