"""Cache of the sufficient statistics of logs on disk, keyed by the digest of all their inputs."""

from __future__ import annotations

import hashlib
import sys
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import hydrodamp
from hydrodamp.basis.basis import Basis
from hydrodamp.batch.discovery import ResolvedMapping, digest_of_recording
from hydrodamp.batch.sufficient_statistics import LogStatistics, summarise_address
from hydrodamp.files import open_atomic
from hydrodamp.identification.regression import Triangle
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle

#: Sources that determine the statistics: a change of any of them invalidates the cache.
SOURCES = (
    *("arrays.py", "batch", "basis", "conditioning", "data", "identification", "ingest"),
    *("kernels", "models", "simulation", "vehicle"),
)


@dataclass(frozen=True)
class StatisticsCache:
    """Statistics for one vehicle, mapping and method; an entry with more terms is reused."""

    folder: Path | None
    vehicle: Vehicle
    models: tuple[DampingModel, ...]
    method: Any
    mapping: ResolvedMapping | None

    def summarise(self, address: str) -> tuple[LogStatistics, str, bool]:
        """Return the statistics of a log, the digest of its files, and whether they were cached."""
        free = (model.restricted_to(self.vehicle.axes) for model in self.models)
        basis = Basis.union(*(model.basis for model in free))
        digest = digest_of_recording(address, self.mapping)
        path = None if self.folder is None else self.folder / f"{self._key(digest)}.npz"
        cached = None if path is None else _load(path)
        if cached is not None and set(basis) <= set(cached.blocks[0].basis):
            return cached.select_terms(basis), digest, True
        settings = self.vehicle, self.models, self.method, self.mapping
        statistics = summarise_address(address, *settings)
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            _save(statistics, path)
        return statistics, digest, False

    def _key(self, digest: str) -> str:
        mapping = None if self.mapping is None else self.mapping.text
        with np.printoptions(threshold=sys.maxsize, floatmode="unique"):  # all elements and digits
            key = repr((digest, self.vehicle, self.method, mapping, _code_digest()))
        return hashlib.sha256(key.encode()).hexdigest()[:32]


SUFFIXES = (".py", ".c", ".h", ".toml", ".yaml")
"""Suffixes of the files that the code digest covers."""


@lru_cache
def _code_digest() -> str:
    """Return the digest of the version and of ``SOURCES``."""
    digest, root = hashlib.sha256(hydrodamp.__version__.encode()), Path(hydrodamp.__file__).parent
    paths = [path for name in SOURCES for path in (root / name, *(root / name).rglob("*"))]
    for path in sorted(path for path in paths if path.suffix in SUFFIXES):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def _load(path: Path) -> LogStatistics | None:
    """Return an entry; None where it is absent or damaged."""
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
            basis = Basis.of(*str(stored["terms"]).split())
            rows = zip(stored["r"], stored["rows"].tolist(), strict=True)
            ranges = zip(stored["training_range"].tolist(), stored["ranges"].tolist(), strict=True)
            blocks = tuple(Triangle(basis, r, n_rows) for r, n_rows in rows)
            start, duration, n = stored["log"].tolist()
            pairs = {name: (low, high) for name, (low, high) in ranges}
            statistics = LogStatistics(blocks, start, duration, int(n), 1, pairs)
            return replace(statistics, outliers=tuple(stored["outliers"].tolist()))
    except Exception:  # of a damaged archive, which is computed again
        return None


def _save(statistics: LogStatistics, path: Path) -> None:
    with open_atomic(path, binary=True) as stream:
        np.savez(
            stream,
            terms=" ".join(map(str, statistics.blocks[0].basis)),
            r=np.array([block.r for block in statistics.blocks]),
            rows=[block.n_samples for block in statistics.blocks],
            log=[statistics.start, statistics.duration, statistics.n_samples],
            training_range=list(statistics.training_range),
            ranges=list(statistics.training_range.values()),
            outliers=np.array(statistics.outliers, dtype=np.str_),
        )
