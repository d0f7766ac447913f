"""The coefficients that both truths are made of."""

from __future__ import annotations

from functools import cache

from hydrodamp.models.damping import Damping
from hydrodamp.models.published import find_published

HORIZONTAL = "vt690-sname2022"
"""The published set of the axes X Y K N."""

VERTICAL = "vt690-field"
"""The published set of the axes Z M."""


@cache
def true_damping() -> Damping:
    """Return the hydrodynamics of the campaign's vehicle."""
    horizontal, vertical = find_published(HORIZONTAL), find_published(VERTICAL)
    values = {
        label: (vertical if label[0] in "ZM" else horizontal)[label]
        for label in horizontal.model.labels
    }
    return Damping.from_dict(
        horizontal.model, values, source=f"{HORIZONTAL} on X Y K N, {VERTICAL} on Z M"
    )
