"""What the files of every target say of the craft in them, and what they call it."""

from __future__ import annotations

import keyword
import re

from hydrodamp.export.craft import Craft
from hydrodamp.export.printer import inputs, matrix

#: Words of a language, and names of other files and functions of an export.
_TAKEN = {
    *map(str.casefold, (*keyword.kwlist, *keyword.softkwlist)),
    *("end", "function", "persistent", "np", "numpy", "ca", "casadi"),
    *("mpc", "main", "batch", "onboard"),
    *("damping", "wrench", "acceleration", "derivative", "step", "holoocean"),
}


def name_of(craft: Craft) -> str:
    """Return the vehicle's name as an identifier of every language."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", craft.vehicle.name).strip("_") or "vehicle"
    return f"auv_{plain}" if plain[0].isdigit() or plain.casefold() in _TAKEN else plain


def said_of(craft: Craft, between: str, row: str = "[{}]") -> dict[str, object]:
    """Return the words and the two mass matrices that the templates of all languages take."""
    import hydrodamp

    vehicle, damping = craft.vehicle, craft.damping
    locked = [axis for axis in "XYZKMN" if axis not in vehicle.axes]
    return {
        "name": name_of(craft),
        "title": _plain(f"{vehicle.name} with damping after {damping.model.title}."),
        "about": _plain(
            f"Written by hydrodamp {hydrodamp.__version__}.",
            f"Vehicle: {vehicle.source}." if vehicle.source else "",
            f"Coefficients: {damping.source}." if damping.source else "",
        ),
        "inputs": craft.inputs,
        "variables": inputs(craft),
        "mass": matrix(vehicle.mass_matrix.tolist(), between, row),
        "inverse": matrix(craft.inverse.tolist(), between, row),
        "locked": f" (zero on the locked axes {' '.join(locked)})" if locked else "",
    }


def _plain(*sentences: str) -> str:
    """Return sentences that end no comment and no text of any language."""
    text = " ".join(" ".join(sentences).split())
    return text.replace("\\", "/").replace('"""', "'''").replace("*/", "* /")
