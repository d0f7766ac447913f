"""cffi loader of the compiled C core, declared by its two headers."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from cffi import FFI

_HERE = Path(__file__).parent


def _load() -> tuple[Any, Any]:
    suffix = {"win32": "dll", "darwin": "dylib"}.get(sys.platform, "so")
    library, ffi, declared = _HERE / f"_core.{suffix}", FFI(), "typedef double HD_REAL;"
    for name in ("onboard.h", "batch.h"):
        header = (_HERE / "csrc" / name).read_text(encoding="utf-8")
        header = re.sub(r"/\*.*?\*/|#ifdef __cplusplus.*?#endif", "", header, flags=re.DOTALL)
        declared += re.sub(r"^#.*$", "", header, flags=re.MULTILINE)
    ffi.cdef(declared)
    try:
        return ffi, ffi.dlopen(str(library))
    except OSError as error:
        raise ImportError(
            f"the compiled core does not load: {error}. Install hydrodamp again, or run "
            "`make core` among its sources."
        ) from error


ffi, C = _load()
DOUBLES = ffi.typeof("double[]")
_TYPES = {
    np.dtype(np.float64): DOUBLES,
    np.dtype(np.int64): ffi.typeof("int64_t[]"),
    np.dtype(np.int32): ffi.typeof("int32_t[]"),
    np.dtype(np.bool_): ffi.typeof("unsigned char[]"),
}
#: The arrays that each C structure points to, so that they live as long as it does.
_ARRAYS_OF: WeakKeyDictionary[Any, list[Any]] = WeakKeyDictionary()


def to_c(value: Any) -> Any:
    """Convert an argument to its C type; an array becomes a pointer that keeps it alive."""
    if isinstance(value, np.ndarray):
        return ffi.from_buffer(_TYPES[value.dtype], value)
    return ffi.NULL if value is None else value


def struct(kind: str, *values: Any) -> Any:
    fields = [*map(to_c, values)]
    value = ffi.new(f"{kind} *", fields)
    _ARRAYS_OF[value] = fields
    return value


def call(name: str, *values: Any) -> None:
    getattr(C, name)(*map(to_c, values))
