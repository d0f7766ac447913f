"""FMI 2.0: a functional mock-up unit, C sources and a binary, over hydrodamp's own C files."""

from __future__ import annotations

import hashlib
import io
import platform
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.export.c99 import HEADERS, SOURCES, header_of, own_files, shared
from hydrodamp.export.craft import Craft, States
from hydrodamp.export.drive import LONGEST_STEP, Engine, upright
from hydrodamp.export.printer import name_of, said_of
from hydrodamp.export.target import Files, NotRun, Target, rendered, require
from hydrodamp.files import save_all

#: Place and suffix of a binary in FMI 2.0; a system without gets the sources alone.
_PLACES = {
    ("Linux", "x86_64"): ("linux64", "so"),
    ("Darwin", "x86_64"): ("darwin64", "dylib"),
    ("Darwin", "arm64"): ("darwin64", "dylib"),
}

#: Where a unit without a binary says why.
_WHY = "resources/no_binary.txt"

#: References of states, of their rates and of inputs.
STATES, RATES, INPUTS = 0, 13, 26


@dataclass(frozen=True)
class FMU(Target):
    """A functional mock-up unit of FMI 2.0, for model exchange and co-simulation."""

    key: ClassVar[str] = "fmu"
    meant: ClassVar[str] = "FMI 2.0"

    def write(self, craft: Craft) -> Files:
        """Return the unit: model description, sources, and a binary where one can be made."""
        import hydrodamp

        name, header = name_of(craft), header_of(craft)
        said = {
            **said_of(craft),
            "guid": hashlib.sha256(header.encode()).hexdigest()[:32],
            "version": hydrodamp.__version__,
            "longest": LONGEST_STEP,
            "sources": (*SOURCES, "fmi2.c"),
        }
        sources = {
            **own_files((*HEADERS, *SOURCES)),
            f"{name}.h": header.encode(),
            "fmi2.c": rendered("fmi2.c.j2", **said).encode(),
        }
        parts = {f"sources/{path}": content for path, content in sources.items()}
        parts["modelDescription.xml"] = rendered("modelDescription.xml.j2", **said).encode()
        try:
            parts |= _binary(name, sources)
        except NotRun as why:
            parts[_WHY] = str(why).encode()
        return {f"{name}.fmu": _zipped(parts)}

    @contextmanager
    def read(self, folder: Path, craft: Craft) -> Iterator[Engine]:
        """Load the unit by fmpy, and hold its rates of model exchange."""
        require("fmpy")
        path = folder / f"{name_of(craft)}.fmu"
        with zipfile.ZipFile(path) as archive:
            if _WHY in archive.namelist():
                raise NotRun(archive.read(_WHY).decode())
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
        unit = instantiate_fmu(place, read_model_description(path), "CoSimulation")
        try:
            unit.setupExperiment()
            unit.enterInitializationMode()
            yield unit
        finally:
            unit.freeInstance()


def _binary(name: str, sources: dict[str, bytes]) -> dict[str, bytes]:
    """Return the unit's binary for this system by its place."""
    system = platform.system(), platform.machine()
    if system not in _PLACES:
        raise NotRun(f"no binary is made for {' on '.join(system)}")
    place, suffix = _PLACES[system]
    with tempfile.TemporaryDirectory() as here:
        save_all({Path(here, path): content for path, content in sources.items()})
        library = Path(here, f"{name}.{suffix}")
        shared(Path(here), (*SOURCES, "fmi2.c"), ("-fvisibility=hidden", "-s"), library)
        return {f"binaries/{place}/{library.name}": library.read_bytes()}


def _zipped(parts: dict[str, bytes]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, content in parts.items():
            archive.writestr(zipfile.ZipInfo(path), content, zipfile.ZIP_DEFLATED)
    return packed.getvalue()
