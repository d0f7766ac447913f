"""A craft printed in a language: its terms and actuators, and the words its files have."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from hydrodamp.basis.atoms import ABSOLUTES, ATOM_PLACE, PROPULSION, is_absolute
from hydrodamp.basis.basis import SLOWEST
from hydrodamp.basis.term import Term
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.vehicle.actuators import Limited, Thruster

#: What u_c and the propulsion ratio less one are called in every language.
SPEED, RATIO = "u_c", "eta_1"

#: Before every generated name: no keyword, built-in, file or function of an export has it.
PREFIX = "auv_"


@dataclass(frozen=True)
class Language:
    """How a language spells what its template does not: ``limited``, ``outside``, ``along``."""

    prefix: str = ""
    absolute: str = "abs({})"
    constant: str = "{}"
    table: str = "[{at}], [{values}]"

    def number(self, value: float) -> str:
        """Return a number in the middle of a formula."""
        return self.constant.format(number(value))


PYTHON = Language()
CASADI = Language(absolute="absolute({})")
C99 = Language(
    prefix="hd_",
    constant="(hd_real){}",
    table="{n}, (const hd_real[]){{{at}}}, (const hd_real[]){{{values}}}",
)


def number(value: float) -> str:
    """Return the shortest decimal that is read back as the same double."""
    return repr(float(value))


def command(name: str) -> str:
    """Return what a command or a channel is called in every language."""
    return f"cmd_{name}"


def actuation(craft: ExportedPlant, language: Language) -> Iterator[tuple[str, str]]:
    """Yield the actuators' channels, and u_c, by what they are made of."""
    for actuator in craft.vehicle.actuators:
        if isinstance(actuator, Limited) and actuator.derived:
            yield command(actuator.channel), _channel(actuator, language)
    known = [
        f"({language.number(one.speed_slope or 0.0)} * {command(one.channel)} "
        f"+ {language.number(one.speed_offset)})"
        for one in craft.propellers
    ]
    if known and craft.asks_speed:
        yield SPEED, known[0] if len(known) == 1 else f"({' + '.join(known)}) / {len(known)}"


def _channel(actuator: Limited, language: Language) -> str:
    """Return what a command does within its limit, nothing in its dead zone."""
    given = command(actuator.command)
    if actuator.limit is not None:
        given = f"{language.prefix}limited({given}, {language.number(actuator.limit)})"
    acting = given
    if isinstance(actuator, Thruster) and actuator.curve is None:
        acting = f"{language.number(actuator.gain or 0.0)} * {given}"
    elif isinstance(actuator, Thruster) and actuator.curve is not None:
        at, values = (", ".join(map(number, each)) for each in zip(*actuator.curve, strict=True))
        table = language.table.format(n=len(actuator.curve), at=at, values=values)
        acting = f"{language.prefix}along({given}, {table})"
    if actuator.dead_zone is None:
        return acting
    low, high = map(language.number, actuator.dead_zone)
    return f"{acting} * {language.prefix}outside({given}, {low}, {high})"


def product(term: Term, language: Language) -> str:
    """Return a term as a product."""
    return " * ".join(_factor(factor, language) for factor in term.factors) or "1.0"


def _factor(factor: str, language: Language) -> str:
    if factor == PROPULSION:
        return RATIO
    if factor in ABSOLUTES or (factor not in ATOM_PLACE and is_absolute(factor)):
        return language.absolute.format(_factor(factor.strip("|"), language))
    return factor if factor in ATOM_PLACE else command(factor)


def name_of(craft: ExportedPlant) -> str:
    """Return the vehicle's name as an identifier of every language."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", craft.vehicle.name).strip("_")
    return f"{PREFIX}{plain or 'vehicle'}"


def said_of(craft: ExportedPlant, language: Language = PYTHON) -> dict[str, object]:
    """Return what the templates of all languages take: words, inputs, terms and matrices."""
    import hydrodamp

    vehicle, damping = craft.vehicle, craft.damping
    locked = [axis for axis in "XYZKMN" if axis not in vehicle.axes]
    terms = (*vehicle.known_columns(), *damping.model.basis)
    return {
        "name": name_of(craft),
        "title": _plain(f"{vehicle.name} with damping after {damping.model.title}."),
        "about": _plain(
            f"Written by hydrodamp {hydrodamp.__version__}.",
            f"Vehicle: {vehicle.source}." if vehicle.source else "",
            f"Coefficients: {damping.source}." if damping.source else "",
        ),
        "inputs": craft.inputs,
        "variables": [*map(command, craft.commands), *([SPEED] if craft.needs_speed else [])],
        "channels": [*actuation(craft, language)],
        "asks_speed": craft.asks_speed,
        "slowest": SLOWEST,
        "terms": [*map(str, terms)],
        "products": [product(term, language) for term in terms],
        "n_known": craft.columns.n_known,
        "matrix": craft.matrix.tolist(),
        "mass": vehicle.mass_matrix.tolist(),
        "inverse": craft.inverse.tolist(),
        "locked": f" (zero on the locked axes {' '.join(locked)})" if locked else "",
    }


def _plain(*sentences: str) -> str:
    """Return sentences that begin or end no comment and end no text of any language."""
    text = " ".join(" ".join(sentences).split())
    text = text.replace("\\", "/").replace('"""', "'''")
    return text.replace("*/", "* /").replace("/*", "/ *")
