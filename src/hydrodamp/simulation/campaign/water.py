"""The coefficients that both truths are made of.

The axes X Y K N are those of ``vt690-sname2022``, whose steady turns are those of
SNAME T&R Bulletin 1-45. Its vertical plane is barely unstable in open loop: with
the pitch angle given, heave and pitch rate run away with +0.05 1/s at 2.13 m/s, so
that a replay of the truth itself from a noisy first sample is some 0.8 off in the
paper's metric, and no open-loop comparison in that plane means anything. The axes
Z and M are therefore those of ``vt690-field``, the same laboratory's simulation of
the same vehicle, which is stable; there the truth replays itself to 0.044.
"""

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
    """Return the hydrodynamics of the campaign's vehicle.

    Returns
    -------
    damping : Damping
        Prestero's terms and K_up, the viscous remainder: H(M nu) nu with the full
        M stands apart.

    Examples
    --------
    >>> true_damping()["M_uw"] == find_published("vt690-field")["M_uw"]
    True
    """
    horizontal, vertical = find_published(HORIZONTAL), find_published(VERTICAL)
    values = {
        label: (vertical if label[0] in "ZM" else horizontal)[label]
        for label in horizontal.model.labels
    }
    return Damping.from_dict(
        horizontal.model, values, source=f"{HORIZONTAL} on X Y K N, {VERTICAL} on Z M"
    )
