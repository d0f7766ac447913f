"""The table of targets, and draws from the covariance of a fit for any of them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError, ModelError, demand, no_such
from hydrodamp.export.c99 import FMU, C
from hydrodamp.export.coefficients import URDF, UUV, MarineGym
from hydrodamp.export.gazebo import VRX, GzSim
from hydrodamp.export.mujoco import MuJoCo
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.export.scripts import CasADi, Octave, Python
from hydrodamp.export.stonefish import Stonefish
from hydrodamp.export.target import Files, Target
from hydrodamp.export.verification import Engine
from hydrodamp.files import load_text
from hydrodamp.identification.dissipativity import max_damping_power
from hydrodamp.models.damping import Damping

_FORMS = (Python, C, Octave, CasADi, FMU, GzSim, VRX, MuJoCo, UUV, URDF, MarineGym, Stonefish)
FORMS: dict[str, Target] = {form.key: form() for form in _FORMS}
"""The targets that write one craft, by their keys, with their usual settings."""

_TABLE = "draws.csv"
_TRIES = 20  # of each draw that is to dissipate


@dataclass(frozen=True)
class Randomisation(Target):
    """Draws of the coefficients, as a table and as files of another target.

    Parameters
    ----------
    draws : int
        How many.
    form : str
        Key of the target that each draw is also written for; empty for the table alone.
    dissipative : bool
        Whether draws that feed the motion within the operating box are drawn again.
    seed : int
        Of the random numbers.
    """

    key: ClassVar[str] = "randomisation"
    description: ClassVar[str] = "domain randomisation"
    draws: int = 100
    form: str = ""
    dissipative: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what draws nothing."""
        demand(self.draws > 0, "draws", "at least 1", f"{self.draws}.")
        known = not self.form or self.form in FORMS
        demand(known, "form", f"one of {', '.join(FORMS)}", f"'{self.form}'.")

    def write(self, craft: ExportedPlant) -> Files:
        """Return the table, the estimate first, and the files of each draw."""
        form = FORMS.get(self.form)
        if form is not None and (lost := form.unrepresented_effects(craft)):
            raise MethodError(
                f"'{self.form}' cannot hold {', '.join(lost)}, and draws are not projected: take "
                "a form that has every term, or identify a model that it can hold."
            )
        rows, found = self._drawn(craft), craft.damping.coefficients
        table = [("draw", *craft.damping.model.labels), ("estimate", *found.tolist())]
        table += [(str(number), *row.tolist()) for number, row in enumerate(rows, start=1)]
        text = "".join(f"{','.join(map(str, row))}\n" for row in table)
        files: dict[str, str | bytes] = {_TABLE: text}
        for number, row in enumerate(rows, start=1):
            drawn = {} if form is None else form.write(_with(craft, row))
            files |= {f"{number:04d}/{path}": part for path, part in drawn.items()}
        return files

    @contextmanager
    def read(self, folder: Path, craft: ExportedPlant) -> Iterator[Engine]:
        """Read the table back, and hold what the estimate in it gives."""
        labels, estimate = (line.split(",") for line in load_text(folder / _TABLE).split("\n")[:2])
        values = dict(zip(labels[1:], map(float, estimate[1:]), strict=True))
        read = replace(craft, damping=Damping.from_dict(craft.damping.model, values))
        yield Engine("hydrodamp, the estimate of the table", read.acceleration)

    def _drawn(self, craft: ExportedPlant) -> list[FloatArray]:
        """Return the coefficients of each draw."""
        found, covariance = craft.damping.coefficients, craft.damping.covariance
        if covariance is None or not np.isfinite(covariance).all():
            raise ModelError(
                f"'{craft.damping.model.key}' has no covariance to draw from: give a damping file "
                "that `hydrodamp identify` wrote by a method that tells one."
            )
        tries = self.draws * (_TRIES if self.dissipative else 1)
        random = np.random.default_rng(self.seed)
        drawn = random.multivariate_normal(found, covariance, tries, method="eigh")
        fit = (row for row in drawn if not self.dissipative or _dissipates(_with(craft, row)))
        rows = [*islice(fit, self.draws)]
        if len(rows) < self.draws:
            raise MethodError(
                f"only {len(rows)} of {tries} draws dissipate everywhere looked at in "
                f"{craft.box}; {self.draws} were asked for. Identify by `dissipative`, or ask for "
                "fewer."
            )
        return rows


def _with(craft: ExportedPlant, coefficients: FloatArray) -> ExportedPlant:
    return replace(craft, damping=replace(craft.damping, coefficients=coefficients))


def _dissipates(craft: ExportedPlant) -> bool:
    return max_damping_power(craft.damping, craft.box).power <= 0.0


TARGETS: dict[str, Target] = {**FORMS, Randomisation.key: Randomisation()}
"""The targets by their keys, with their usual settings."""


def find_target(key: str) -> Target:
    """Return the target of a key.

    Parameters
    ----------
    key : str
        Such as ``"python"``.

    Returns
    -------
    target : Target
        With its usual settings.

    Raises
    ------
    MethodError
        If there is none, with the nearest that there is.

    Examples
    --------
    >>> find_target("python").key
    'python'
    """
    if key not in TARGETS:
        raise MethodError(no_such("target", key, TARGETS))
    return TARGETS[key]
