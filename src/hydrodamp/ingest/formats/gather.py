"""Named arrays of any shape, as scientific files hold them, sorted into topics."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.naming import split_unit

_LONGEST = 64
_CLOCKS = ("time", "t", "timestamp", "time_s")


def recording_of(
    arrays: Mapping[str, Any], source: str, form: str, notes: tuple[str, ...] = ()
) -> Recording:
    """Return arrays as a recording."""
    met = [*notes]
    whole = _samples(arrays, met)
    lengths = {len(array) for array in whole.values()}
    if not whole:
        kinds = ", ".join(f"`{name}`" for name in list(arrays)[:5]) or "nothing"
        raise LogError(
            ["there is no array with a value a sample; there is " + kinds, *met], source=source
        )
    groups = {"": whole} if len(lengths) == 1 else _structures(whole)
    topics = tuple(_topic(name, group, met) for name, group in groups.items())
    return Recording(topics, source, form, tuple(met))


def _samples(arrays: Mapping[str, Any], met: list[str]) -> dict[str, Any]:
    """Return the arrays that hold a row a sample; note the others."""
    found: dict[str, Any] = {}
    rows = _usual_length(arrays)
    for name, array in arrays.items():
        block = np.squeeze(np.asarray(array))
        if block.dtype.names:
            found |= {f"{name}.{part}": block[part] for part in block.dtype.names}
        elif block.ndim == 0 or block.dtype.kind not in "buifUS" or block.ndim > 2:
            met.append(f"`{name}` {_told(np.asarray(array))} holds no samples; left out")
        elif block.ndim == 2:
            tall = block if len(block) == rows or block.shape[1] != rows else block.T
            if tall.shape[1] > _LONGEST:
                met.append(f"`{name}` {_told(block)} is too wide for samples; left out")
            else:
                found |= {f"{name}[{k}]": tall[:, k] for k in range(tall.shape[1])}
        else:
            found[name] = block
    return found


def _usual_length(arrays: Mapping[str, Any]) -> int:
    """Return the length most vectors have, the clock's where there is one."""
    vectors = {name: np.size(array) for name, array in arrays.items() if _is_vector(array)}
    for clock in _CLOCKS:
        if clock in vectors:
            return vectors[clock]
    return Counter(vectors.values()).most_common(1)[0][0] if vectors else 0


def _is_vector(array: Any) -> bool:
    return np.squeeze(np.asarray(array)).ndim == 1


def _told(array: Any) -> str:
    return f"({' x '.join(map(str, array.shape)) or 'one value'})"


def _structures(whole: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Group fields by the structure they stand in."""
    groups: dict[str, dict[str, Any]] = defaultdict(dict)
    for name, array in whole.items():
        stem, dot, field = name.rpartition(".")
        groups[stem if dot else ""][field if dot else name] = array
    return groups


def _topic(name: str, group: Mapping[str, Any], met: list[str]) -> Topic:
    n = _usual_length(group)
    clock = next((clock for clock in _CLOCKS if clock in group and len(group[clock]) == n), "")
    beside = f"where `{clock}` has {n}" if clock else f"where most have {n}"
    fields: dict[str, FloatArray] = {}
    texts: dict[str, tuple[str, ...]] = {}
    units: dict[str, str] = {}
    faults: dict[str, str] = {}
    for spelt, array in group.items():
        field, unit = split_unit(spelt)
        field = spelt if field in fields or field in texts else field
        if len(array) != n:
            faults[field] = f"`{spelt}` has {len(array)} values {beside}; make them equal"
            continue
        if array.dtype.kind in "US":
            texts[field] = tuple(np.asarray(array, dtype=str).tolist())
        else:
            fields[field] = np.asarray(array, dtype=np.float64)
        units |= {field: unit} if unit else {}
    met.extend(faults.values())
    return Topic(name, None, fields, texts, units, faults)
