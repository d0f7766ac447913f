"""Cache of the sufficient statistics of logs on disk, keyed by the digest of all their inputs."""

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
from hydrodamp.batch.discovery import ResolvedMapping, digest_of_recording
from hydrodamp.batch.sufficient_statistics import LogStatistics, summarise_address
from hydrodamp.files import save_bytes
from hydrodamp.identification.qr_factor import Triangle
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle

#: Sources that determine the statistics: a change of any of them invalidates the cache.
SOURCES = (
    *("arrays.py", "batch", "basis", "conditioning", "data", "identification", "ingest"),
    *("kernels", "models", "simulation", "vehicle"),
)

DIGEST_SIZE = hashlib.sha256().digest_size  # bytes


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
        basis = Basis.union(
            *(model.restricted_to(self.vehicle.axes).basis for model in self.models)
        )
        digest = digest_of_recording(address, self.mapping)
        path = None if self.folder is None else self.folder / f"{self._key(digest)}.stats"
        cached = None if path is None else _load(path)
        if cached is not None and set(basis) <= set(cached.blocks[0].basis):
            return cached.select_terms(basis), digest, True
        statistics = summarise_address(
            address, self.vehicle, self.models, self.method, self.mapping
        )
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            _save(statistics, path)
        return statistics, digest, False

    def _key(self, digest: str) -> str:
        mapping = None if self.mapping is None else self.mapping.text
        key = (digest, _content(self.vehicle), _content(self.method), mapping, _code_digest())
        return hashlib.sha256(repr(key).encode()).hexdigest()[:32]


def _content(value: Any) -> Any:
    """Return the content of a value in a form whose ``repr`` is complete."""
    if is_dataclass(value) and not isinstance(value, type):
        name = f"{type(value).__module__}.{type(value).__qualname__}"
        return name, [(each.name, _content(getattr(value, each.name))) for each in fields(value)]
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, hashlib.sha256(value.tobytes()).hexdigest()
    if isinstance(value, dict):
        return [(key, _content(each)) for key, each in value.items()]
    if isinstance(value, tuple | list):
        return [_content(each) for each in value]
    return repr(value)


@lru_cache
def _code_digest() -> str:
    """Return the digest of the version and of ``SOURCES``."""
    digest, root = hashlib.sha256(hydrodamp.__version__.encode()), Path(hydrodamp.__file__).parent
    paths = [path for name in SOURCES for path in (root / name, *(root / name).rglob("*"))]
    for path in sorted(path for path in paths if path.suffix in (".py", ".c", ".h", ".yaml")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def _load(path: Path) -> LogStatistics | None:
    """Return an entry; None where it is absent or damaged."""
    try:
        content = path.read_bytes()
        digest, body = content[:DIGEST_SIZE], content[DIGEST_SIZE:]
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


def _save(statistics: LogStatistics, path: Path) -> None:
    body = io.BytesIO()
    np.savez(
        body,
        terms=" ".join(map(str, statistics.blocks[0].basis)),
        r=np.array([block.r for block in statistics.blocks]),
        rows=[block.n_samples for block in statistics.blocks],
        log=[statistics.start, statistics.duration, statistics.n_samples],
        training_range=list(statistics.training_range),
        ranges=list(statistics.training_range.values()),
    )
    content = body.getvalue()
    save_bytes(hashlib.sha256(content).digest() + content, path)
