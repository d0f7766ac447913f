"""FMI 2.0: a functional mock-up unit, C sources and a binary, over hydrodamp's own C files."""

from __future__ import annotations

import hashlib
import io
import platform
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.export.c99 import header_of
from hydrodamp.export.compiling import HEADERS, SOURCES, own_files, shared
from hydrodamp.export.craft import Craft, States
from hydrodamp.export.drive import LONGEST_STEP, Drive, Rate
from hydrodamp.export.frames import upright
from hydrodamp.export.printer import name_of, said_of
from hydrodamp.export.target import (
    RUNGE_KUTTA,
    Engine,
    Files,
    NotRun,
    Target,
    by_rate,
    rendered,
    require,
)
from hydrodamp.files import save_all

#: Place and suffix of a binary in FMI 2.0; a system without gets the sources alone.
_PLACES = {
    ("Linux", "x86_64"): ("linux64", "so"),
    ("Darwin", "x86_64"): ("darwin64", "dylib"),
    ("Darwin", "arm64"): ("darwin64", "dylib"),
}

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
        guid = hashlib.sha256(header.encode()).hexdigest()[:32]
        said = {
            **said_of(craft, ""),
            "guid": guid,
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
        with suppress(NotRun):
            parts |= _binary(name, sources)
        return {f"{name}.fmu": _zipped(parts)}

    def read(self, folder: Path, craft: Craft) -> Engine:
        """Load the unit by fmpy, and return its rates of model exchange."""
        require("fmpy")
        name, by = name_of(craft), f"fmpy {version('fmpy')}"
        path = folder / f"{name}.fmu"
        _check_binary(path, name)

        def rates(at: States) -> FloatArray:
            with loaded(path) as unit:
                return by_rate(by, _rate_of(unit)).rates(at)

        def replay(drive: Drive) -> FloatArray:
            with loaded(path) as unit:
                return by_rate(by, _rate_of(unit)).replay(drive)

        return Engine(by, RUNGE_KUTTA, rates, replay)


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


def _rate_of(unit: Any) -> Rate:
    def rate(
        velocity: FloatArray, down: FloatArray, inputs: FloatArray, wrench: FloatArray
    ) -> FloatArray:
        state = *velocity, 0.0, 0.0, 0.0, *upright(down[None])[0]
        values = *wrench, *inputs
        unit.setReal(range(STATES, STATES + len(state)), state)
        unit.setReal(range(INPUTS, INPUTS + len(values)), values)
        return np.array(unit.getReal(range(RATES, RATES + 6)))

    return rate


def _check_binary(path: Path, name: str) -> None:
    """Say why a unit has no binary, by trying again to make it."""
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        if any(each.startswith("binaries/") for each in names):
            return
        parts = {each: archive.read(each) for each in names if each.startswith("sources/")}
    _binary(name, {Path(each).name: content for each, content in parts.items()})
    raise NotRun(f"no binary is made for {platform.system()} on {platform.machine()}")


def _binary(name: str, sources: dict[str, bytes]) -> dict[str, bytes]:
    """Return the unit's binary for this system by its place."""
    system = platform.system(), platform.machine()
    if system not in _PLACES:
        return {}
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
