"""Sizes of the embedded identifiers of ``identifiers.c``."""

from __future__ import annotations

from hydrodamp.kernels.composite import CompositeLaw, law_of
from hydrodamp.kernels.core import Gains, Recursion, entries_of, plant_of
from hydrodamp.kernels.library import C, struct


def buffer_sizes(gains: Gains, recursion: Recursion, law: CompositeLaw) -> dict[str, int]:
    """Return the sizes of states and workspaces, in numbers."""
    common = plant_of(gains.plant), entries_of(recursion)
    settings = recursion.unit, recursion.forgetting, recursion.block
    methods = {
        "ai_composite": struct("hd_ai_composite", *common, law_of(law)),
        "rls": struct("hd_rls", *common, *settings),
        "ai": struct("hd_ai", *common, gains.a, gains.gamma),
    }
    sizes = {"STATE": "size", "LASTING": "lasting", "WORK": "work"}
    return {
        f"{method.upper()}_{name}": getattr(C, f"hd_{method}_{size}")(structure)
        for method, structure in methods.items()
        for name, size in sizes.items()
    }
