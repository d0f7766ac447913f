"""C99 export: hydrodamp's C core, unchanged, and one header with the constants of a plant.

``c`` is a library of equation 1 and of the embedded estimators (recursive least squares, the
adaptive identifier and the composite one); ``fmu`` packs the functions of equation 1 into a
functional mock-up unit.
"""

from __future__ import annotations

import hashlib
import io
import platform
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from cffi import FFI

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import demand
from hydrodamp.export.codegen import (
    C99,
    command,
    identifier_values,
    render_template,
    template_values,
    vehicle_identifier,
)
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.target import (
    Files,
    NotRun,
    RunError,
    Target,
    program_version,
    require_package,
)
from hydrodamp.export.verification import MAX_STEP, Engine, attitude_quaternions
from hydrodamp.files import save_all

#: C files of equation 1, their headers, and C files of the embedded estimators.
SOURCES = ("atoms.c", "attitude.c", "cholesky.c", "motion.c")
HEADERS = ("batch.h", "onboard.h")
_IDENTIFIERS = "adaptive blocks composite identifiers instrumental_variables recursive steps"
IDENTIFIER_SOURCES = tuple(f"{name}.c" for name in _IDENTIFIERS.split())

#: Bit-identical results on every machine: no fused multiply-add, no reordered sums.
STRICT = ("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror")

CALL_SIGNATURE = "void acceleration(const {0} *, const {0} *, const {0} *, const {0} *, {0} *);"


@dataclass(frozen=True)
class C(Target):
    """A C99 library without allocation, input, output or state between calls.

    Parameters
    ----------
    precision : str
        ``double`` or ``float``: the type that the fidelity card is measured with and that CMake
        builds by default.
    """

    key: ClassVar[str] = "c"
    description: ClassVar[str] = "C99"
    precision: str = "double"

    def __post_init__(self) -> None:
        """Check the precision."""
        known = self.precision in ("double", "float")
        demand(known, "precision", "double or float", f"'{self.precision}'.")

    @property
    def flags(self) -> tuple[str, ...]:
        """Compiler flags of the precision."""
        return ("-DHD_FLOAT",) if self.precision == "float" else ()

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the two headers, the C core, and two examples in a folder of their own."""
        name = vehicle_identifier(plant)
        values = template_values(plant) | identifier_values(plant)
        build = {
            "precision": self.precision,
            "sources": (*SOURCES, *IDENTIFIER_SOURCES),
            "bytes": 4 if self.precision == "float" else 8,
        }
        return {
            f"{name}.h": render_header(plant),
            f"{name}_identifier.h": render_template("identifier.h.j2", **values),
            **core_sources((*HEADERS, *SOURCES, *IDENTIFIER_SOURCES)),
            "examples/simulate.c": render_template("simulate.c.j2", **values),
            "examples/estimate.c": render_template("estimate.c.j2", **values),
            "CMakeLists.txt": render_template("CMakeLists.txt.j2", **values, **build),
            "README.md": render_template("readme_c.md.j2", **values, **build),
        }

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Compile the files and yield the accelerations of the library."""
        ffi: Any = FFI()
        with tempfile.TemporaryDirectory() as build:
            library, caller = Path(build, "vehicle.so"), Path(build, "caller.c")
            name = vehicle_identifier(plant)
            caller.write_text(render_template("caller.c.j2", name=name), encoding="utf-8")
            sources = (*SOURCES, *IDENTIFIER_SOURCES, str(caller))
            compiler = compile_library(folder, sources, (*self.flags, "-I."), library)
            ffi.cdef(CALL_SIGNATURE.format(self.precision))
            module = ffi.dlopen(str(library))
        real = np.float64 if self.precision == "double" else np.float32
        pointer = ffi.typeof(f"{self.precision}[]")

        def accelerations(at: States) -> FloatArray:
            result = np.empty((len(at.velocity), 6), real)
            for row in zip(*(values.astype(real) for values in at), result, strict=True):
                module.acceleration(*(ffi.from_buffer(pointer, values) for values in row))
            return result.astype(np.float64)

        yield Engine(f"{compiler}, {self.precision}", accelerations)


def render_header(plant: ExportedPlant) -> str:
    """Return the header with the constants and functions of a plant."""
    table = plant.columns
    return render_template(
        "vehicle.h.j2",
        **template_values(plant, C99),
        factors=table.plant.factors.tolist(),
        free=plant.vehicle.free.astype(int).tolist(),
        of_terms=[command(channel) for channel in table.channels],
    )


def core_sources(names: Sequence[str]) -> dict[str, bytes]:
    """Return files of hydrodamp's C core."""
    folder = files("hydrodamp.kernels").joinpath("csrc")
    return {name: folder.joinpath(name).read_bytes() for name in names}


def find_compiler() -> str:
    """Return the name of the installed C compiler; raise NotRun without one."""
    name = next((name for name in ("cc", "gcc", "clang") if shutil.which(name)), None)
    if name is None:
        raise NotRun("no C compiler (cc, gcc or clang) is installed")
    return name


def compile_library(
    folder: Path, sources: Sequence[str], flags: Sequence[str], library: Path, *link_flags: str
) -> str:
    """Compile a shared library, every warning an error; return the version of the compiler."""
    call = (find_compiler(), *STRICT, "-fPIC", *flags)
    cached = [name for name in sources if name in (*SOURCES, *IDENTIFIER_SOURCES)]
    contents = tuple((name, (folder / name).read_bytes()) for name in (*HEADERS, *cached))
    with tempfile.TemporaryDirectory() as build:
        objects = {Path(build, name): data for name, data in _compile_core(call, contents).items()}
        save_all(objects)
        linked = [*(name for name in sources if name not in cached), *map(str, objects)]
        _run_compiler([*call, "-shared", *link_flags, *linked, "-lm", "-o", str(library)], folder)
    return program_version(call[0])


@cache
def _compile_core(
    call: tuple[str, ...], contents: tuple[tuple[str, bytes], ...]
) -> Mapping[str, bytes]:
    """Return object files of C files that no vehicle's header enters, compiled once a content."""
    with tempfile.TemporaryDirectory() as build:
        save_all({Path(build, name): content for name, content in contents})
        sources = [name for name, _ in contents if name.endswith(".c")]
        _run_compiler([*call, "-c", *sources], build)
        return {path.name: path.read_bytes() for path in sorted(Path(build).glob("*.o"))}


def _run_compiler(call: Sequence[str], folder: str | Path) -> None:
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RunError(f"{call[0]} reports: {done.stderr.strip().rstrip('.')}")


#: Folders of a binary in FMI 2.0 and 3.0, and its suffix; other systems get the sources alone.
BINARY_FOLDERS = {
    ("Linux", "x86_64"): ("linux64", "x86_64-linux", "so"),
    ("Linux", "aarch64"): ("", "aarch64-linux", "so"),
    ("Darwin", "x86_64"): ("darwin64", "x86_64-darwin", "dylib"),
    ("Darwin", "arm64"): ("darwin64", "aarch64-darwin", "dylib"),
}

#: Files of a unit without a binary that state why: no compiler, or the compiler failed.
FAILURE_FILES = {NotRun: "resources/no_binary.txt", RunError: "resources/compile_error.txt"}

#: Value references of the first state, state derivative and input.
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
        """Check the version."""
        demand(self.fmi in ("2.0", "3.0"), "fmi", "2.0 or 3.0", f"'{self.fmi}'.")

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the unit: model description, sources, and a binary where one can be compiled."""
        import hydrodamp

        name, header = vehicle_identifier(plant), render_header(plant)
        code = f"fmi{self.fmi[0]}.c"
        values = {
            **template_values(plant),
            "guid": hashlib.sha256(header.encode()).hexdigest()[:32],
            "version": hydrodamp.__version__,
            "longest": MAX_STEP,
            "sources": (*SOURCES, code),
        }
        sources = {
            **core_sources((*HEADERS, *SOURCES)),
            f"{name}.h": header.encode(),
            code: render_template(f"{code}.j2", **values).encode(),
        }
        if self.fmi == "3.0":
            description = render_template("buildDescription.xml.j2", **values)
            sources["buildDescription.xml"] = description.encode()
        members = {f"sources/{path}": content for path, content in sources.items()}
        description = render_template(f"fmi{self.fmi[0]}.xml.j2", **values)
        members["modelDescription.xml"] = description.encode()
        try:
            members |= _compile_binary(name, sources, self.fmi)
        except NotRun as reason:
            members[FAILURE_FILES[type(reason)]] = str(reason).encode()
        return {f"{name}.fmu": _zip_archive(members)}

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Load the unit by fmpy and yield its derivatives for model exchange."""
        require_package("fmpy")
        path = folder / f"{vehicle_identifier(plant)}.fmu"
        with zipfile.ZipFile(path) as archive:
            for outcome, member in FAILURE_FILES.items():
                if member in archive.namelist():
                    raise outcome(archive.read(member).decode())
        with open_fmu(path) as unit:

            def accelerations(at: States) -> FloatArray:
                result, origin = [], np.zeros((len(at.velocity), 3))
                states = np.column_stack([at.velocity, origin, attitude_quaternions(at.down)])
                for state, *inputs in zip(states, at.wrench, at.inputs, strict=True):
                    unit.setReal(range(STATES, RATES), state)
                    values = np.concatenate(inputs)
                    unit.setReal(range(INPUTS, INPUTS + len(values)), values)
                    result.append(unit.getReal(range(RATES, RATES + 6)))
                return np.array(result)

            yield Engine(f"fmpy {version('fmpy')}", accelerations)


@contextmanager
def open_fmu(path: Path) -> Iterator[Any]:
    """Yield a unit for co-simulation in initialization mode, where its state may be set."""
    from fmpy import extract, instantiate_fmu, read_model_description

    with tempfile.TemporaryDirectory() as folder:
        extract(path, folder)
        description = read_model_description(path)
        unit = instantiate_fmu(folder, description, "CoSimulation")
        try:
            if description.fmiVersion == "2.0":
                unit.setupExperiment()
            else:
                unit.setReal, unit.getReal = unit.setFloat64, unit.getFloat64
            unit.enterInitializationMode()
            yield unit
        finally:
            unit.freeInstance()


def _compile_binary(name: str, sources: Mapping[str, bytes], fmi: str) -> dict[str, bytes]:
    """Return the binary of this system by its path in the unit."""
    system = platform.system(), platform.machine()
    *folders, suffix = BINARY_FOLDERS.get(system, ("", "", ""))
    if not (folder := folders[fmi == "3.0"]):
        raise NotRun(f"no binary of FMI {fmi} is made for {' on '.join(system)}")
    with tempfile.TemporaryDirectory() as build:
        save_all({Path(build, path): content for path, content in sources.items()})
        library = Path(build, f"{name}.{suffix}")
        code = [path for path in sources if path.endswith(".c")]
        compile_library(Path(build), code, ("-fvisibility=hidden",), library, "-s")
        return {f"binaries/{folder}/{library.name}": library.read_bytes()}


def _zip_archive(members: Mapping[str, bytes]) -> bytes:
    archive_bytes = io.BytesIO()
    with zipfile.ZipFile(archive_bytes, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, content in members.items():
            archive.writestr(zipfile.ZipInfo(path), content, zipfile.ZIP_DEFLATED)
    return archive_bytes.getvalue()
