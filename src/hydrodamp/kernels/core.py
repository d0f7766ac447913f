"""The compiled library, loaded by its own headers, and what it does with whole records.

Shapes are checked here, once, because C cannot. cffi reads the two headers beside the C files,
so they are the only declarations there are.
"""

from __future__ import annotations

import functools
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from cffi import FFI

from hydrodamp.arrays import FloatArray, IndexArray, IntArray
from hydrodamp.errors import ProblemError
from hydrodamp.kernels.plant import Inputs, Plant

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
_TYPES = {
    np.dtype(np.float64): ffi.typeof("double[]"),
    np.dtype(np.int64): ffi.typeof("int64_t[]"),
    np.dtype(np.int32): ffi.typeof("int32_t[]"),
    np.dtype(np.bool_): ffi.typeof("unsigned char[]"),
}
ROOM = ffi.typeof("double[]")


def regressor(
    factors: IndexArray,
    velocity: FloatArray,
    down: FloatArray,
    channels: FloatArray,
    propulsion_speed: FloatArray,
    out: FloatArray | None = None,
) -> FloatArray:
    """Return every term at every sample, shape (n, n_terms), in float64 ``out`` where given."""
    table = np.ascontiguousarray(factors, dtype=np.int32)
    n, m = len(velocity), np.shape(channels)[-1]
    xi = np.empty((n, len(table)), order="F") if out is None else out
    nu, south = floats(velocity, (n, 6), "velocity"), floats(down, (n, 3), "down")
    held = floats(channels, (n, m), "channels")
    speed = floats(propulsion_speed, (n,), "propulsion_speed")
    moving = {"velocity": pointer(nu), "down": pointer(south), "channels": pointer(held)}
    record = ffi.new("hd_record *", {"n": n, "n_channels": m, **moving})
    to, (row, column) = ffi.cast("double *", xi.ctypes.data), xi.strides
    work = ffi.new(ROOM, C.hd_atom_count(m) * C.HD_BLOCK)
    atoms, places = pointer(table), (to, row // 8, column // 8)
    C.hd_regressor(atoms, len(table), record, pointer(speed), *places, work)
    return xi


def coriolis(mass_matrix: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return the wrench H(M nu) nu of the moving frame at n velocities, shape (n, 6).

    With p = M nu it is [p1 x w ; p1 x v + p2 x w]: eq. 1, second term.
    """
    mass = floats(np.transpose(mass_matrix), (6, 6), "mass_matrix")
    nu = floats(velocity, (len(velocity), 6), "velocity")
    wrench = np.empty(nu.shape)
    C.hd_coriolis_rows(pointer(mass), pointer(nu), len(nu), pointer(wrench))
    return wrench


def mass_inverse(plant: Plant) -> FloatArray:
    """Return the inverse of the mass matrix on the free axes, zero on the locked ones."""
    inverse = np.empty((6, 6))
    C.hd_mass_inverse(plant_of(plant), pointer(inverse))
    return inverse


def replay(
    plant: Plant,
    matrix: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    entries: tuple[np.ndarray, np.ndarray] | None = None,
    *,
    attitude: FloatArray | None = None,
    max_step: float = 0.05,
    limit: float = 50.0,
    block: int = 1,
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Integrate eq. 1 open loop by RK4 from the first sample of every segment, and differentiate.

    Wrench and recorded down vector are interpolated linearly, channels and u_c held; with
    quaternions (n, 4) in ``attitude`` the attitude is integrated too. No sub-step is longer than
    ``max_step`` [s]. Velocity (n, 6) is NaN outside the segments and from where one passed
    ``limit``; that sample, or -1, is the second result. The third are slopes on coefficients at
    p ``entries`` (rows, columns) of ``matrix`` and on the initial velocity: a row (6, p + 6) a
    block of samples, segment by segment, their sum over the root of their number.
    """
    rows, n, null = spans(segments, inputs.n), inputs.n, ffi.NULL
    table = floats(matrix, (plant.n_terms, 6), "matrix")
    poses = None if attitude is None else floats(attitude, (n, 4), "attitude")
    chosen = np.column_stack(entries or ((), ())).astype(np.int32)
    blocks = 0 if entries is None else int(np.sum(-(-np.diff(rows) // block)))
    jacobian = np.empty((blocks, 6, len(chosen) + 6))
    velocity, diverged_at = np.empty((n, 6)), np.empty(len(rows), dtype=np.int64)
    system, pose = plant_of(plant), null if poses is None else pointer(poses)
    fields = [system, pointer(table), record_of(plant, inputs), pose, max_step, limit]
    motion, work = ffi.new("hd_motion *", fields), C.hd_replay_work(system, len(chosen))
    slopes = null if entries is None else pointer(jacobian)
    to = block, pointer(velocity), slopes, pointer(diverged_at), ffi.new(ROOM, work)
    C.hd_replay(motion, pointer(rows), len(rows), pointer(chosen), len(chosen), *to)
    return velocity, diverged_at, jacobian


def pointer(array: npt.NDArray[Any]) -> Any:
    """Return a C pointer to a contiguous array, which lives while the pointer does."""
    return ffi.from_buffer(_TYPES[array.dtype], array)


def floats(values: npt.ArrayLike, shape: tuple[int, ...], name: str) -> FloatArray:
    """Return ``values`` as C-contiguous float64 of exactly this shape."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.shape != shape:
        raise ProblemError(f"`{name}` must have shape {shape}; got {array.shape}")
    return array


def spans(segments: npt.ArrayLike, n: int) -> IntArray:
    """Return segments as int64 rows (start, stop) inside ``n`` samples."""
    rows = np.ascontiguousarray(segments, dtype=np.int64)
    wrong = (rows[:, 0] < 0) | (rows[:, 0] >= rows[:, 1]) | (rows[:, 1] > n)
    if wrong.any():
        raise ProblemError(
            f"`segments` must hold rows 0 <= start < stop <= {n}; got {rows[wrong][0].tolist()}"
        )
    return rows


# C structures of values that never change are kept for the next call. Pointers in a structure
# keep nothing alive: the arrays belong to the value, which the caller holds.


@functools.lru_cache(maxsize=32)
def plant_of(plant: Plant) -> Any:
    fields = plant.n_terms, plant.n_channels, pointer(plant.factors), pointer(plant.mass_columns)
    return ffi.new("hd_plant *", [*fields, pointer(plant.free)])


def record_of(plant: Plant, inputs: Inputs) -> Any:
    if inputs.n_channels != plant.n_channels:
        raise ProblemError(
            f"`inputs.channels` must have {plant.n_channels} columns, as the plant has channels; "
            f"got {inputs.n_channels}"
        )
    arrays = inputs.time, inputs.velocity, inputs.down, inputs.wrench, inputs.channels
    pointers = [pointer(array) for array in (*arrays, inputs.propulsion)]
    return ffi.new("hd_record *", [inputs.n, inputs.n_channels, *pointers])
