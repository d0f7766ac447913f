"""The kernels in NumPy: they read like the paper and are the oracle of the compiled core.

Same names, arguments and results as :mod:`hydrodamp.kernels`. Read them in the
order atoms, products, motion, integration, identifier, derivative.
"""

from hydrodamp.kernels.reference.derivative import sensitivities
from hydrodamp.kernels.reference.identifier import adapt, adapt_step
from hydrodamp.kernels.reference.integration import replay
from hydrodamp.kernels.reference.motion import acceleration, coriolis
from hydrodamp.kernels.reference.products import regressor

__all__ = [
    "acceleration",
    "adapt",
    "adapt_step",
    "coriolis",
    "regressor",
    "replay",
    "sensitivities",
]
