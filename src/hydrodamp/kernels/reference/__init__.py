"""The kernels in NumPy: they read like the paper and are the oracle of the compiled core.

Same names, arguments and results as :mod:`hydrodamp.kernels`. Read them in the
order atoms, products, motion, integration, identifier, robust, blocks, recursive,
derivative.
"""

from hydrodamp.kernels.reference.blocks import block_step
from hydrodamp.kernels.reference.derivative import sensitivities
from hydrodamp.kernels.reference.identifier import adapt, adapt_step
from hydrodamp.kernels.reference.integration import replay
from hydrodamp.kernels.reference.motion import acceleration, coriolis
from hydrodamp.kernels.reference.products import regressor
from hydrodamp.kernels.reference.recursive import absorb, recur
from hydrodamp.kernels.reference.robust import robust_run, robust_step

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
