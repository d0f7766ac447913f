"""Python: one file without dependencies but NumPy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.export.craft import Craft, States
from hydrodamp.export.printer import PYTHON, name_of, printed, said_of
from hydrodamp.export.target import Engine, Files, Target, by_rate, executed, parts, rendered


@dataclass(frozen=True)
class Python(Target):
    """One Python file that needs NumPy alone, with the forms of two simulators.

    Functions of the wrench and the acceleration, a vehicle class of the Python Vehicle Simulator,
    and HoloOcean's six accelerations.
    """

    key: ClassVar[str] = "python"
    meant: ClassVar[str] = "Python with NumPy, PythonVehicleSimulator and HoloOcean 2"

    def write(self, craft: Craft) -> Files:
        """Return the file."""
        text = rendered(
            "python.py.j2",
            **said_of(craft, ",\n    "),
            lines=printed(craft, PYTHON),
        )
        return {f"{name_of(craft)}.py": text}

    def read(self, folder: Path, craft: Craft) -> Engine:
        """Run the file, and return its accelerations."""
        module = executed(folder / f"{name_of(craft)}.py")

        def rates(at: States) -> FloatArray:
            return np.asarray(module.acceleration(*(part.T for part in parts(at))).T)

        return by_rate(f"NumPy {np.__version__}", module.acceleration, rates)
