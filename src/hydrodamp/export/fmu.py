"""FMI 2.0: a functional mock-up unit, C sources and a binary, over hydrodamp's own C files."""

from __future__ import annotations

import hashlib
import io
import platform
import tempfile
import zipfile
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.export.c99 import header_of
from hydrodamp.export.compiling import HEADERS, SOURCES, own_files, shared
from hydrodamp.export.craft import Craft
from hydrodamp.export.drive import LONGEST_STEP
from hydrodamp.export.frames import upright
from hydrodamp.export.target import Engine, Files, NotRun, by_rate, one_by_one, rendered
from hydrodamp.export.words import name_of, said_of
from hydrodamp.files import save_all

#: Where FMI 2.0 has a binary of this system; a system without a place gets the sources alone.
_PLACES = {("Linux", "x86_64"): "linux64", ("Darwin", "arm64"): "darwin64"}

_STATES = (
    *((f"velocity.{name}", "m/s" if name in "uvw" else "rad/s", 0) for name in VELOCITIES),
    *((f"position.{name}", "m", 0) for name in ("north", "east", "down")),
    *((f"quaternion.{name}", "", int(name == "w")) for name in "wxyz"),
)


@dataclass(frozen=True)
class FMU:
    """A functional mock-up unit of FMI 2.0, for model exchange and co-simulation."""

    key: ClassVar[str] = "fmu"
    meant: ClassVar[str] = "FMI 2.0"
    ignores: ClassVar[str] = ""

    def holds(self, craft: Craft) -> None:
        """Return None: it can hold all terms."""

    def write(self, craft: Craft) -> Files:
        """Return the unit: model description, sources, and a binary where one can be made."""
        import hydrodamp

        name, header = name_of(craft), header_of(craft)
        guid = hashlib.sha256(header.encode()).hexdigest()[:32]
        inputs = [(f"wrench.{axis}", "N" if axis in "XYZ" else "N.m") for axis in AXES]
        inputs += [(f"input.{one}", "") for one in craft.inputs]
        said = {
            **said_of(craft, ""),
            "guid": guid,
            "version": hydrodamp.__version__,
            "longest": LONGEST_STEP,
            "states": _STATES,
            "n_states": len(_STATES),
            "inputs": inputs,
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
        if find_spec("fmpy") is None:
            raise NotRun('fmpy is not installed (pip install "hydrodamp[export]")')
        unit = loaded(folder / f"{name_of(craft)}.fmu")
        places = [*range(2 * len(_STATES), 2 * len(_STATES) + 6 + len(craft.inputs))]

        def rate(
            nu: FloatArray, down: FloatArray, other: FloatArray, given: FloatArray
        ) -> FloatArray:
            state = np.concatenate([nu, np.zeros(3), upright(down[None])[0]])
            found = np.empty(len(state))
            unit.setReal(places, [*other, *given])
            unit.setContinuousStates(_pointer(state), len(state))
            unit.getDerivatives(_pointer(found), len(found))
            return found[:6]

        return by_rate(f"fmpy {version('fmpy')}", one_by_one(rate), rate)


def loaded(path: Path, *, exchange: bool = True) -> Any:
    """Return a unit, ready for model exchange or for co-simulation from its start."""
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Model, FMU2Slave

    described = read_model_description(path)
    kind, form = (
        (FMU2Model, described.modelExchange) if exchange else (FMU2Slave, described.coSimulation)
    )
    with tempfile.TemporaryDirectory() as place:
        extract(path, place)
        if not any(Path(place).glob("binaries/*/*")):
            raise NotRun("no C compiler was there to make its binary")
        unit = kind(
            guid=described.guid,
            unzipDirectory=place,
            modelIdentifier=form.modelIdentifier,
            instanceName="hydrodamp",
        )
    unit.instantiate()
    unit.setupExperiment()
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    if exchange:
        unit.enterContinuousTimeMode()
    return unit


def _pointer(values: FloatArray) -> Any:
    from ctypes import POINTER, c_double

    return values.ctypes.data_as(POINTER(c_double))


def _binary(name: str, sources: dict[str, bytes]) -> dict[str, bytes]:
    """Return the unit's binary for this system by its place."""
    place = _PLACES.get((platform.system(), platform.machine()))
    if place is None:
        return {}
    suffix = "dylib" if platform.system() == "Darwin" else "so"
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
