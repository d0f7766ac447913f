"""A cache of folds on disk, by everything that a fold is made of: a new day costs a day."""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass, fields, is_dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import hydrodamp
from hydrodamp.basis.basis import Basis
from hydrodamp.batch.discovery import digest_of_recording
from hydrodamp.batch.recordings import ResolvedMapping
from hydrodamp.batch.sufficient_statistics import LogStatistics, summarise_address
from hydrodamp.files import save_bytes
from hydrodamp.identification.qr_factor import Triangle
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle

#: What folds are made by: a change of any of their sources makes new ones.
_SOURCES = (
    *("arrays.py", "batch", "basis", "conditioning", "data", "identification", "ingest"),
    *("kernels", "models", "simulation", "vehicle"),
)

_DIGEST_SIZE = hashlib.sha256().digest_size  # bytes


@dataclass(frozen=True)
class StatisticsCache:
    """The folds of one vehicle, mapping and method; a fold with more terms serves too."""

    folder: Path | None
    vehicle: Vehicle
    models: tuple[DampingModel, ...]
    method: Any
    mapping: ResolvedMapping | None

    def summarise(self, address: str) -> tuple[LogStatistics, str, bool]:
        """Return the fold of a log, the digest of its files, and whether it was in the cache."""
        basis = Basis.union(*(one.restricted_to(self.vehicle.axes).basis for one in self.models))
        digest = digest_of_recording(address, self.mapping)
        path = None if self.folder is None else self.folder / f"{self._key(digest)}.fold"
        cached = None if path is None else _load(path)
        if cached is not None and set(basis) <= set(cached.blocks[0].basis):
            return cached.select_terms(basis), digest, True
        folded = summarise_address(address, self.vehicle, self.models, self.method, self.mapping)
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            _save(folded, path)
        return folded, digest, False

    def _key(self, digest: str) -> str:
        mapping = None if self.mapping is None else self.mapping.text
        parts = (digest, _content(self.vehicle), _content(self.method), mapping, _code_digest())
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:32]


def _content(value: Any) -> Any:
    """Return all that a value holds, as something whose ``repr`` is complete."""
    if is_dataclass(value) and not isinstance(value, type):
        name = f"{type(value).__module__}.{type(value).__qualname__}"
        return name, [(one.name, _content(getattr(value, one.name))) for one in fields(value)]
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, hashlib.sha256(value.tobytes()).hexdigest()
    if isinstance(value, dict):
        return [(key, _content(each)) for key, each in value.items()]
    if isinstance(value, tuple | list):
        return [_content(each) for each in value]
    return repr(value)


@lru_cache
def _code_digest() -> str:
    """Return the digest of the sources that folds depend on."""
    digest, root = hashlib.sha256(hydrodamp.__version__.encode()), Path(hydrodamp.__file__).parent
    paths = [path for name in _SOURCES for path in (root / name, *(root / name).rglob("*"))]
    for path in sorted(path for path in paths if path.suffix in (".py", ".c", ".h", ".yaml")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def _load(path: Path) -> LogStatistics | None:
    """Return a fold; None where there is none, or its content does not fit its digest."""
    try:
        content = path.read_bytes()
        digest, body = content[:_DIGEST_SIZE], content[_DIGEST_SIZE:]
        if hashlib.sha256(body).digest() != digest:
            return None
        with np.load(io.BytesIO(body), allow_pickle=False) as stored:
            basis = Basis.of(*str(stored["terms"]).split())
            rows = zip(stored["r"], stored["rows"].tolist(), strict=True)
            pairs = zip(stored["training_range"].tolist(), stored["ranges"].tolist(), strict=True)
            start, duration, n = stored["log"].tolist()
            blocks = tuple(Triangle(basis, r, n_rows) for r, n_rows in rows)
            ranges = {name: (low, high) for name, (low, high) in pairs}
    except OSError:
        return None
    return LogStatistics(blocks, start, duration, int(n), 1, ranges)


def _save(folded: LogStatistics, path: Path) -> None:
    body = io.BytesIO()
    np.savez(
        body,
        terms=" ".join(map(str, folded.blocks[0].basis)),
        r=np.array([one.r for one in folded.blocks]),
        rows=[one.n_samples for one in folded.blocks],
        log=[folded.start, folded.duration, folded.n_samples],
        training_range=list(folded.training_range),
        ranges=list(folded.training_range.values()),
    )
    content = body.getvalue()
    save_bytes(hashlib.sha256(content).digest() + content, path)
