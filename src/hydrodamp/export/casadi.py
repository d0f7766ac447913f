"""CasADi: functions with derivatives, for optimal control and estimation."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.export.craft import Craft, States
from hydrodamp.export.printer import CASADI, name_of, number, printed, said_of
from hydrodamp.export.target import (
    Engine,
    Files,
    Target,
    by_rate,
    executed,
    parts,
    rendered,
    require,
)


@dataclass(frozen=True)
class CasADi(Target):
    """A Python module of CasADi functions of wrench, acceleration, state derivative and step.

    Parameters
    ----------
    smooth : float
        Where |x|, sign(x) and speeds are rounded off, so that they have derivatives at rest
        [m/s, rad/s or the unit of a command]; 0 leaves them as they are.
    """

    key: ClassVar[str] = "casadi"
    meant: ClassVar[str] = "CasADi 3.6 or newer"
    smooth: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what rounds nothing off."""
        if not 0.0 <= self.smooth < np.inf:
            raise MethodError(f"`smooth` must be zero or positive; got {self.smooth:g}.")

    @property
    def ignores(self) -> str:
        """The corners that are rounded off."""
        return f"corners of |x|, rounded off over {self.smooth:g}" if self.smooth else ""

    def write(self, craft: Craft) -> Files:
        """Return the module, and an example of predictive control."""
        said, name = said_of(craft, ",\n    "), name_of(craft)
        said |= {"smooth": number(self.smooth), "lines": printed(craft, CASADI)}
        return {
            f"{name}.py": rendered("casadi.py.j2", **said),
            "mpc.py": rendered("mpc.py.j2", name=name, free=craft.vehicle.free.astype(int)),
        }

    def read(self, folder: Path, craft: Craft) -> Engine:
        """Run the module, and return its accelerations."""
        require("casadi")
        function: Any = executed(folder / f"{name_of(craft)}.py").acceleration

        def rate(*given: FloatArray) -> FloatArray:
            return np.array(function(*given)).ravel()

        def rates(at: States) -> FloatArray:
            return np.array(function.map(len(at.velocity))(*(part.T for part in parts(at)))).T

        return by_rate(f"CasADi {version('casadi')}", rate, rates)
