"""The targets that write one craft."""

from __future__ import annotations

from hydrodamp.export.c99 import C
from hydrodamp.export.casadi import CasADi
from hydrodamp.export.coefficients import URDF, UUV, MarineGym
from hydrodamp.export.fmu import FMU
from hydrodamp.export.gazebo import VRX, GzSim
from hydrodamp.export.mujoco import MuJoCo
from hydrodamp.export.octave import Octave
from hydrodamp.export.python import Python
from hydrodamp.export.stonefish import Stonefish
from hydrodamp.export.target import Target

_ALL: tuple[Target, ...] = (
    Python(),
    C(),
    Octave(),
    CasADi(),
    FMU(),
    GzSim(),
    VRX(),
    MuJoCo(),
    UUV(),
    URDF(),
    MarineGym(),
    Stonefish(),
)
FORMS = {form.key: form for form in _ALL}
"""By their keys, with their usual settings."""
