"""Parameters of sensors, commands and vehicle that are estimated together with the coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hydrodamp.identification.fit import Estimate


@dataclass(frozen=True)
class Parameter:
    """A parameter θ with prior mean zero: its physical value is ``prior + θ`` or ``prior exp(θ)``.

    ``std`` is the prior standard deviation of θ.
    """

    label: str
    unit: str
    kind: Literal["sensor", "command", "vehicle"]
    std: float
    prior: float = 0.0
    transform: Literal["identity", "logarithm"] = "identity"

    def estimate(self, theta: float, error: float, cause: str = "") -> Estimate:
        """Return the physical value and standard error of θ."""
        value, slope = self.prior + theta, 1.0
        if self.transform == "logarithm":
            value = slope = self.prior * float(np.exp(theta))
        return Estimate(value, slope * error, self.prior, self.unit, cause)
