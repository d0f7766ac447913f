"""Everything that steps in time, on arrays alone, in one C99 library.

A plant and a model are tables here, so a new model compiles nothing. Read plant and inputs
(the arrays), then core (the functions), then csrc.
"""

from hydrodamp.kernels.core import (
    absorb,
    acceleration,
    adapt,
    adapt_step,
    block_step,
    coriolis,
    recur,
    regressor,
    replay,
    sensitivities,
)
from hydrodamp.kernels.robust_core import robust_run, robust_step

__all__ = [
    "absorb",
    "acceleration",
    "adapt",
    "adapt_step",
    "block_step",
    "coriolis",
    "recur",
    "regressor",
    "replay",
    "robust_run",
    "robust_step",
    "sensitivities",
]
