"""Folds kept between runs, each for a log, a vehicle, a method: adding a day costs a day."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.basis.basis import Basis
from hydrodamp.batch.addresses import token
from hydrodamp.batch.folding import Folded, fold
from hydrodamp.files import replacing
from hydrodamp.identification.triangle import Triangle
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import digest_of
from hydrodamp.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Kept:
    """What logs are folded for, and the folder of folds; one of more terms serves too."""

    folder: Path | None
    vehicle: Vehicle
    models: tuple[DampingModel, ...]
    method: Any
    mapping: str | None

    def fold(self, address: str) -> tuple[Folded, bool]:
        """Return the fold of a log, and whether it was there."""
        basis = Basis.union(*(one.restricted_to(self.vehicle.axes).basis for one in self.models))
        place = None if self.folder is None else self.folder / f"{self._name(address)}.npz"
        if place is not None and place.is_file():
            there = _loaded(place)
            if set(basis) <= set(there.blocks[0].basis):
                return there.only(basis), True
        folded = fold(address, self.vehicle, self.models, self.method, self.mapping)
        if place is not None:
            place.parent.mkdir(parents=True, exist_ok=True)
            _save(folded, place)
        return folded, False

    def _name(self, address: str) -> str:
        import hydrodamp

        mapping = Path(self.mapping or "")
        said = mapping.read_text("utf-8") if mapping.is_file() else self.mapping
        made_of = (token(address), digest_of(self.vehicle), repr(self.method), said)
        return hashlib.sha256(repr((*made_of, hydrodamp.__version__)).encode()).hexdigest()[:32]


def _loaded(place: Path) -> Folded:
    with np.load(place, allow_pickle=False) as kept:
        basis = Basis.of(*str(kept["terms"]).split())
        rows = zip(kept["r"], kept["rows"].tolist(), strict=True)
        pairs = zip(kept["sailed"].tolist(), kept["ranges"].tolist(), strict=True)
        start, duration, n = kept["log"].tolist()
        blocks = tuple(Triangle(basis, r, n_rows) for r, n_rows in rows)
        ranges = {name: (low, high) for name, (low, high) in pairs}
    return Folded(blocks, start, duration, int(n), 1, ranges)


def _save(folded: Folded, place: Path) -> None:
    with replacing(place, binary=True) as file:
        np.savez(
            file,
            terms=" ".join(map(str, folded.blocks[0].basis)),
            r=np.array([one.r for one in folded.blocks]),
            rows=[one.n_samples for one in folded.blocks],
            log=[folded.start, folded.duration, folded.n_samples],
            sailed=list(folded.sailed),
            ranges=list(folded.sailed.values()),
        )
