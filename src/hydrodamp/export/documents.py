"""The fidelity card as strict JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from hydrodamp.export.fidelity import Fidelity

FORMAT, VERSION = "hydrodamp-fidelity", 1


def fidelity_document(card: Fidelity) -> dict[str, Any]:
    """Return what ``fidelity.json`` holds."""
    import hydrodamp

    said = {"format": FORMAT, "version": VERSION, "hydrodamp": hydrodamp.__version__}
    return {**said, "exact": card.exact, **asdict(card), "units": UNITS}


UNITS = {
    "wrench_error": "% of the rms of the damping on that axis",
    "rms": "m/s and deg/s mixed (eq. 24)",
    "power": "W, negative where damping dissipates",
    "mass_ratio": "added mass over the rigid body's",
}
