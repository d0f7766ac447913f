"""Numbers as text that a page carries: two bytes a value, and no character of markup."""

from __future__ import annotations

import base64
import json

import numpy as np

from hydrodamp.arrays import FloatArray

_STEPS = 65000
_NOTHING = 65535

BYTES = 8 / 3
"""Characters that a packed value takes."""


def pack(values: FloatArray) -> dict[str, object]:
    """Return a series in steps of its own range."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    step = (high - low) / _STEPS or 1.0
    counts = np.where(np.isfinite(values), np.rint((values - low) / step), _NOTHING)
    return {"low": low, "step": step, "steps": _text(counts.astype("<u2"))}


def pack_exactly(values: FloatArray) -> str:
    """Return a series as little-endian doubles in base 64."""
    return _text(values.astype("<f8"))


def script_json(document: object) -> str:
    r"""Return a document as JSON that may stand inside a script element."""
    text = json.dumps(document, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
    for mark in "<>&":
        text = text.replace(mark, f"\\u{ord(mark):04x}")
    return text


def _text(array: np.ndarray) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")
