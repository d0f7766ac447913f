"""C99: hydrodamp's own files, unchanged, and one header of a vehicle and its model.

As a library, and as a functional mock-up unit.
"""

from __future__ import annotations

import hashlib
import io
import platform
import re
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from cffi import FFI

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import demand
from hydrodamp.export.codegen import C99, command, name_of, said_of
from hydrodamp.export.embedded import identified_of
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.target import (
    Files,
    NotRun,
    RunError,
    Target,
    rendered,
    require,
    version_of,
)
from hydrodamp.export.verification import LONGEST_STEP, Engine, upright
from hydrodamp.files import save_all

#: What a vehicle's header stands on, and what is there for the estimators on board.
SOURCES = ("atoms.c", "attitude.c", "cholesky.c", "motion.c")
HEADERS = ("batch.h", "onboard.h")
ON_BOARD = (
    "adaptive.c",
    "blocks.c",
    "identifiers.c",
    "instrumental_variables.c",
    "recursive.c",
    "steps.c",
)

#: The same bits everywhere: no contraction to fused multiply-add, no reordered sums.
STRICT = ("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror")

#: What calls the functions of the headers, to measure them.
_CALLERS = ("called.c", "identified.c")

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
    description: ClassVar[str] = "C99"
    precision: str = "double"

    def __post_init__(self) -> None:
        """Refuse what is no type of numbers."""
        known = self.precision in ("double", "float")
        demand(known, "precision", "double or float", f"'{self.precision}'.")

    @property
    def flags(self) -> tuple[str, ...]:
        """What the compiler is told of it."""
        return ("-DHD_FLOAT",) if self.precision == "float" else ()

    def write(self, craft: ExportedPlant) -> Files:
        """Return the header, hydrodamp's own files, and two examples in a folder of theirs."""
        name, own = name_of(craft), own_files((*HEADERS, *SOURCES, *ON_BOARD))
        said = said_of(craft) | identified_of(craft)
        code = {
            f"{name}.h": header_of(craft).encode(),
            f"{name}_identifier.h": rendered("identifier.h.j2", **said).encode(),
            **own,
        }
        built = {
            "precision": self.precision,
            "sources": (*SOURCES, *ON_BOARD),
            "size": size_of(code, said, self.flags),
            "bytes": 4 if self.precision == "float" else 8,
        }
        return {
            **code,
            "examples/simulate.c": rendered("simulate.c.j2", **said),
            "examples/estimate.c": rendered("estimate.c.j2", **said),
            "CMakeLists.txt": rendered("CMakeLists.txt.j2", **said, **built),
            "README.md": rendered("readme_c.md.j2", **said, **built),
        }

    @contextmanager
    def read(self, folder: Path, craft: ExportedPlant) -> Iterator[Engine]:
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
            for row in zip(*(each.astype(real) for each in at), found, strict=True):
                loaded.acceleration(*(ffi.from_buffer(pointed, each) for each in row))
            return found.astype(np.float64)

        yield Engine(f"{by}, {self.precision}", rates)


def header_of(craft: ExportedPlant) -> str:
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
    done = _run(call, folder)
    if done.returncode:
        raise RunError(f"{call[0]} refused it: {done.stderr.strip().rstrip('.')}")
    return version_of(call[0])


def size_of(code: Mapping[str, bytes], said: Mapping[str, object], flags: Sequence[str]) -> str:
    """Tell what code takes on a Cortex-M7, else on this machine; nothing where no gcc can."""
    callers = {each: rendered(f"{each}.j2", **said).encode() for each in _CALLERS}
    whole = {**code, **callers}
    sources = [each for each in whole if each.endswith(".c")]
    for prefix, kit, processor in (
        ("arm-none-eabi-", _CORTEX_M7, "a Cortex-M7"),
        ("", (), "this machine"),
    ):
        with tempfile.TemporaryDirectory() as place:
            save_all({Path(place, each): content for each, content in whole.items()})
            call = [f"{prefix}gcc", *STRICT, "-Os", "-fstack-usage", *kit, *flags, "-c", *sources]
            if not shutil.which(call[0]) or _run(call, place).returncode:
                continue  # not there, or a cross compiler without its C library
            vehicle, identifiers = (
                _taken(Path(place), prefix, [Path(each).stem for each in group])
                for group in ((*SOURCES, _CALLERS[0]), (*ON_BOARD, _CALLERS[1]))
            )
        return (
            f"By {prefix}gcc -Os for {processor}, the vehicle takes {vehicle}; the identifiers "
            f"take {identifiers} besides."
        )
    return ""


def _taken(place: Path, prefix: str, units: Sequence[str]) -> str:
    """Tell the size of some compiled units, and how much of the stack they take."""
    told = _run([f"{prefix}size", *(f"{unit}.o" for unit in units)], place).stdout
    rows = np.array([line.split()[:3] for line in told.splitlines()[1:]], dtype=int)
    frames = " ".join((place / f"{unit}.su").read_text() for unit in units)
    code, data, unset = rows.sum(axis=0).tolist()
    # No function calls itself, so that all frames together are more than there ever are.
    stack = sum(map(int, re.findall(r"\t(\d+)\t", frames)))
    return (
        f"{code} bytes of code and constants, {data + unset} bytes of variables and at most "
        f"{stack} bytes of stack"
    )


def _run(call: Sequence[str], place: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(call, cwd=place, capture_output=True, text=True, check=False)


#: Places of a binary in FMI 2.0 and 3.0, and its suffix; other systems get the sources alone.
_PLACES = {
    ("Linux", "x86_64"): ("linux64", "x86_64-linux", "so"),
    ("Linux", "aarch64"): ("", "aarch64-linux", "so"),
    ("Darwin", "x86_64"): ("darwin64", "x86_64-darwin", "dylib"),
    ("Darwin", "arm64"): ("darwin64", "aarch64-darwin", "dylib"),
}

#: Where a unit without a binary says why: none is made here, or the compiler failed.
_WHY = {NotRun: "resources/no_binary.txt", RunError: "resources/compile_error.txt"}

#: References of states, of their rates and of inputs.
STATES, RATES, INPUTS = 0, 13, 26


@dataclass(frozen=True)
class FMU(Target):
    """A functional mock-up unit for model exchange and co-simulation.

    Parameters
    ----------
    fmi : str
        ``2.0`` or ``3.0``: the version of the interface.
    """

    key: ClassVar[str] = "fmu"
    description: ClassVar[str] = "FMI 2.0 or 3.0"
    fmi: str = "2.0"

    def __post_init__(self) -> None:
        """Refuse versions that are not written."""
        demand(self.fmi in ("2.0", "3.0"), "fmi", "2.0 or 3.0", f"'{self.fmi}'.")

    def write(self, craft: ExportedPlant) -> Files:
        """Return the unit: model description, sources, and a binary where one can be made."""
        import hydrodamp

        name, header, code = name_of(craft), header_of(craft), f"fmi{self.fmi[0]}.c"
        said = {
            **said_of(craft),
            "guid": hashlib.sha256(header.encode()).hexdigest()[:32],
            "version": hydrodamp.__version__,
            "longest": LONGEST_STEP,
            "sources": (*SOURCES, code),
        }
        sources = {
            **own_files((*HEADERS, *SOURCES)),
            f"{name}.h": header.encode(),
            code: rendered(f"{code}.j2", **said).encode(),
        }
        if self.fmi == "3.0":
            sources["buildDescription.xml"] = rendered("buildDescription.xml.j2", **said).encode()
        parts = {f"sources/{path}": content for path, content in sources.items()}
        parts["modelDescription.xml"] = rendered(f"fmi{self.fmi[0]}.xml.j2", **said).encode()
        try:
            parts |= _binary(name, sources, self.fmi)
        except NotRun as why:
            parts[_WHY[type(why)]] = str(why).encode()
        return {f"{name}.fmu": _zipped(parts)}

    @contextmanager
    def read(self, folder: Path, craft: ExportedPlant) -> Iterator[Engine]:
        """Load the unit by fmpy, and hold its rates of model exchange."""
        require("fmpy")
        path = folder / f"{name_of(craft)}.fmu"
        with zipfile.ZipFile(path) as archive:
            for outcome, member in _WHY.items():
                if member in archive.namelist():
                    raise outcome(archive.read(member).decode())
        with loaded(path) as unit:

            def rates(at: States) -> FloatArray:
                found, n = [], len(at.velocity)
                states = np.column_stack([at.velocity, np.zeros((n, 3)), upright(at.down)])
                for state, *given in zip(states, at.wrench, at.inputs, strict=True):
                    unit.setReal(range(STATES, RATES), state)
                    values = np.concatenate(given)
                    unit.setReal(range(INPUTS, INPUTS + len(values)), values)
                    found.append(unit.getReal(range(RATES, RATES + 6)))
                return np.array(found)

            yield Engine(f"fmpy {version('fmpy')}", rates)


@contextmanager
def loaded(path: Path) -> Iterator[Any]:
    """Hold a unit for co-simulation, in its initialization: its state may be set."""
    from fmpy import extract, instantiate_fmu, read_model_description

    with tempfile.TemporaryDirectory() as place:
        extract(path, place)
        description = read_model_description(path)
        unit = instantiate_fmu(place, description, "CoSimulation")
        try:
            if description.fmiVersion == "2.0":
                unit.setupExperiment()
            else:
                unit.setReal, unit.getReal = unit.setFloat64, unit.getFloat64
            unit.enterInitializationMode()
            yield unit
        finally:
            unit.freeInstance()


def _binary(name: str, sources: dict[str, bytes], fmi: str) -> dict[str, bytes]:
    """Return the unit's binary for this system by its place."""
    system = platform.system(), platform.machine()
    *places, suffix = _PLACES.get(system, ("", "", ""))
    if not (place := places[fmi == "3.0"]):
        raise NotRun(f"no binary of FMI {fmi} is made for {' on '.join(system)}")
    with tempfile.TemporaryDirectory() as here:
        save_all({Path(here, path): content for path, content in sources.items()})
        library = Path(here, f"{name}.{suffix}")
        code = [path for path in sources if path.endswith(".c")]
        shared(Path(here), code, ("-fvisibility=hidden", "-s"), library)
        return {f"binaries/{place}/{library.name}": library.read_bytes()}


def _zipped(parts: dict[str, bytes]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, content in parts.items():
            archive.writestr(zipfile.ZipInfo(path), content, zipfile.ZIP_DEFLATED)
    return packed.getvalue()
