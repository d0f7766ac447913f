"""Everything that steps in time, on arrays alone: the compiled core or its NumPy twin.

A plant and a model are tables here, so a new model compiles nothing. The
functions below are the C99 core's where it was built, else the NumPy
reference's, with one :class:`~hydrodamp.errors.FallbackWarning` at first use.
Read plant and inputs (the arrays), then reference (the equations), then csrc.
"""

try:
    from hydrodamp.kernels.compiled import (
        absorb,
        acceleration,
        adapt,
        adapt_step,
        block_step,
        coriolis,
        recur,
        regressor,
        replay,
        robust_run,
        robust_step,
        sensitivities,
    )

    COMPILED = True
except ImportError:
    from hydrodamp.kernels.fallback import (
        absorb,
        acceleration,
        adapt,
        adapt_step,
        block_step,
        coriolis,
        recur,
        regressor,
        replay,
        robust_run,
        robust_step,
        sensitivities,
    )

    COMPILED = False

__all__ = [
    "COMPILED",
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
