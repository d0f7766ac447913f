"""Domain randomisation from evidence: draws of coefficients from the covariance of a fit."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError, ModelError
from hydrodamp.export.craft import Craft
from hydrodamp.export.drive import scattered
from hydrodamp.export.forms import FORMS
from hydrodamp.export.projection import held_by, left_out
from hydrodamp.export.target import Engine, Files, Target, by_core
from hydrodamp.files import load_text
from hydrodamp.identification.power import worst_power
from hydrodamp.models.damping import Damping

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
    meant: ClassVar[str] = "domain randomisation"
    draws: int = 100
    form: str = ""
    dissipative: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what draws nothing."""
        if self.draws < 1:
            raise MethodError(f"`draws` must be at least 1; got {self.draws}.")
        if self.form and self.form not in FORMS:
            raise MethodError(f"`form` must be one of {', '.join(FORMS)}; got '{self.form}'.")

    def write(self, craft: Craft) -> Files:
        """Return the table, the estimate first, and the files of each draw."""
        held = FORMS[self.form].holds(craft) if self.form else None
        if held is not None and (lost := left_out(craft, held)):
            raise MethodError(
                f"'{self.form}' cannot hold {', '.join(lost)}, and draws are not projected: take "
                "a form that has every term, or identify a model that it can hold."
            )
        rows = [*self._drawn(craft)]
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(("draw", *craft.damping.model.labels))
        table.writerow(("estimate", *craft.damping.coefficients.tolist()))
        table.writerows((number, *row.tolist()) for number, row in enumerate(rows, start=1))
        files: dict[str, str | bytes] = {_TABLE: text.getvalue()}
        at = scattered(craft)
        for number, row in enumerate(rows if self.form else (), start=1):
            written = FORMS[self.form].write(held_by(FORMS[self.form], _with(craft, row), at))
            files |= {f"{number:04d}/{path}": part for path, part in written.items()}
        return files

    def read(self, folder: Path, craft: Craft) -> Engine:
        """Read the table back, and return what the estimate in it gives."""
        labels, estimate, *_ = csv.reader(load_text(folder / _TABLE).splitlines())
        values = dict(zip(labels[1:], map(float, estimate[1:]), strict=True))
        read = Damping.from_dict(craft.damping.model, values)
        return by_core("hydrodamp, the estimate of the table", replace(craft, damping=read))

    def _drawn(self, craft: Craft) -> Iterator[FloatArray]:
        """Yield the coefficients of each draw."""
        covariance = craft.damping.covariance
        if covariance is None or not np.isfinite(covariance).all():
            raise ModelError(
                f"'{craft.damping.model.key}' has no covariance to draw from: give a damping file "
                "that `hydrodamp identify` wrote by a method that tells one."
            )
        random = np.random.default_rng(self.seed)
        tries = self.draws * (_TRIES if self.dissipative else 1)
        wanted = self.draws
        for row in random.multivariate_normal(
            craft.damping.coefficients, covariance, tries, method="eigh"
        ):
            if wanted and (not self.dissipative or _dissipates(_with(craft, row))):
                wanted -= 1
                yield row
        if wanted:
            raise MethodError(
                f"only {self.draws - wanted} of {tries} draws dissipate everywhere looked at in "
                f"{craft.box}; {self.draws} were asked for. Identify by `dissipative`, or ask for "
                "fewer."
            )


def _with(craft: Craft, coefficients: FloatArray) -> Craft:
    return replace(craft, damping=replace(craft.damping, coefficients=coefficients))


def _dissipates(craft: Craft) -> bool:
    return worst_power(craft.damping, craft.box).power <= 0.0
