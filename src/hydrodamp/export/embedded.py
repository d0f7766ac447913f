"""The identifiers of a craft on board: their constants, as the exported header has them."""

from __future__ import annotations

import zlib

import numpy as np

from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.data.channels import ATTITUDE, EULER
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.identification.adaptive import AdaptiveIdentifier
from hydrodamp.identification.recursive import TYPICAL_VELOCITY, RecursiveLeastSquares
from hydrodamp.kernels import core


def identified_of(craft: ExportedPlant) -> dict[str, object]:
    """Return what the templates of the identifiers take: those of a live run, with its settings."""
    model, columns = craft.damping.model, craft.columns
    recursive = RecursiveLeastSquares(typical_velocity=TYPICAL_VELOCITY).bind(columns, model)
    gains, recursion = AdaptiveIdentifier().bind(columns, model).gains, recursive.recursion
    plant = columns.plant
    arrays = plant.mass_matrix, plant.free, plant.factors, recursion.known, recursion.unit
    mark = zlib.crc32(repr(model.labels).encode() + b"".join(map(np.ndarray.tobytes, arrays)))
    return {
        "labels": model.labels,
        "rooms": core.buffer_sizes(gains, recursion),
        "start": recursive.start.coefficients.tolist(),
        "exported": craft.damping.coefficients.tolist(),
        "starts": recursion.starts.tolist(),
        "rows": recursion.rows.tolist(),
        "known": recursion.known.tolist(),
        "unit": recursion.unit.tolist(),
        "forgetting": recursion.forgetting,
        "length": recursion.block,
        "a": gains.a.tolist(),
        "gamma": gains.gamma.tolist(),
        "marks": {"rls": mark, "ai": mark ^ 1},
        "holds_speed": craft.asks_speed and not craft.needs_speed,
        "needs_speed": craft.needs_speed,
        "has_wrench": not craft.vehicle.actuators,
        "columns": [*_columns(craft)],
    }


def _columns(craft: ExportedPlant) -> list[tuple[str, int, float]]:
    """Return columns of the canonical form, whether they are needed, and what else stands there."""
    free, wrench = craft.vehicle.free.tolist(), () if craft.vehicle.actuators else AXES
    return [
        ("time", 1, 0.0),
        *((name, int(moves), 0.0) for name, moves in zip(VELOCITIES, free, strict=True)),
        *((name, 0, 0.0) for name in (*ATTITUDE.columns, *EULER[:2])),
        *((name, 1, 0.0) for name in craft.commands),
        *([("eta", 1, 0.0)] if craft.needs_speed else []),
        *((name, 0, 0.0) for name in wrench),
    ]
