"""The compiled library, loaded through its own headers."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from cffi import FFI

_HERE = Path(__file__).parent


def _declarations() -> str:
    """Return the headers without comments and lines of the preprocessor, for cffi to read."""
    text = "typedef double HD_REAL;\n"
    for name in ("onboard.h", "batch.h"):
        header = (_HERE / "csrc" / name).read_text(encoding="utf-8")
        header = re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL)
        header = re.sub(r"#ifdef __cplusplus.*?#endif", "", header, flags=re.DOTALL)
        text += re.sub(r"^#.*$", "", header, flags=re.MULTILINE)
    return text


def _load() -> tuple[Any, Any]:
    suffix = {"win32": "dll", "darwin": "dylib"}.get(sys.platform, "so")
    library, ffi = _HERE / f"_core.{suffix}", FFI()
    ffi.cdef(_declarations())
    try:
        return ffi, ffi.dlopen(str(library))
    except OSError as error:
        raise ImportError(
            f"the compiled core does not load: {error}. Install hydrodamp again, or run "
            "`make core` among its sources."
        ) from error


INTERFACE, C = _load()
_NUMBERS = {
    np.dtype(np.float64): INTERFACE.typeof("double[]"),
    np.dtype(np.int64): INTERFACE.typeof("int64_t[]"),
    np.dtype(np.int32): INTERFACE.typeof("int32_t[]"),
    np.dtype(np.bool_): INTERFACE.typeof("unsigned char[]"),
}


def pointer(array: npt.NDArray[Any]) -> Any:
    """Return a C pointer to the numbers of a contiguous array."""
    return INTERFACE.from_buffer(_NUMBERS[array.dtype], array)


def room(count: int) -> Any:
    """Return a workspace of that many numbers."""
    return INTERFACE.new("double[]", count)
