"""A craft printed in a language: its terms by one visitor, and the words its files have."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import ABSOLUTES, ATOM_PLACE, AXES, PROPULSION, is_absolute
from hydrodamp.basis.basis import SLOWEST
from hydrodamp.basis.term import Term
from hydrodamp.export.craft import Craft
from hydrodamp.vehicle.actuators import Limited, Thruster

#: What u_c and the propulsion ratio less one are called in every language.
SPEED, RATIO = "u_c", "eta_1"

#: Words of a language, and names of other files and functions of an export.
_TAKEN = {
    *map(str.casefold, (*keyword.kwlist, *keyword.softkwlist)),
    *("end", "function", "persistent", "np", "numpy", "ca", "casadi"),
    *("mpc", "main", "batch", "onboard"),
    *("damping", "wrench", "acceleration", "derivative", "step", "holoocean"),
}


@dataclass(frozen=True)
class Syntax:
    """How a language spells what terms and actuators need."""

    absolute: str = "abs({x})"
    root: str = "np.sqrt({x})"
    sign: str = "np.sign({x})"
    larger: str = "np.maximum({x}, {y})"
    smaller: str = "np.minimum({x}, {y})"
    outside: str = "(({x} < {low}) | ({x} > {high}))"
    table: str = "np.interp({x}, {at}, {values})"
    row: str = "[{}]"
    constant: str = "{}"
    assign: str = "{name} = {value}"
    sum: str = "(\n        {}\n    )"
    plus: str = "\n        "

    def number(self, value: float) -> str:
        """Return a number in the middle of a formula."""
        return self.constant.format(number(value))


PYTHON = Syntax()
OCTAVE = Syntax(
    root="sqrt({x})",
    sign="sign({x})",
    larger="max({x}, {y})",
    smaller="min({x}, {y})",
    outside="({x} < {low} | {x} > {high})",
    table="interp1({at}, {values}, min(max({x}, {first}), {last}))",
    assign="{name} = {value};",
    sum="{}",
    plus=" ...\n        ",
)
CASADI = Syntax(
    absolute="absolute({x})",
    root="root({x})",
    sign="sign({x})",
    larger="ca.fmax({x}, {y})",
    smaller="ca.fmin({x}, {y})",
    outside="ca.logic_or({x} < {low}, {x} > {high})",
    table="ca.pw_lin(ca.fmin(ca.fmax({x}, {first}), {last}), {at}, {values})",
)
C99 = Syntax(
    larger="larger({x}, {y})",
    smaller="smaller({x}, {y})",
    outside="(hd_real)({x} < {low} || {x} > {high})",
    table="along({x}, {n}, (const hd_real[]){at}, (const hd_real[]){values})",
    row="{{{}}}",
    constant="(hd_real){}",
    assign="const hd_real {name} = {value};",
)


def number(value: float) -> str:
    """Return the shortest decimal that is read back as the same double."""
    return repr(float(value))


def matrix(rows: Iterable[Iterable[float]], between: str, row: str = "[{}]") -> str:
    """Return a table of numbers, one row a line."""
    return between.join(row.format(", ".join(map(number, each))) for each in rows)


def inputs(craft: Craft) -> list[str]:
    """Return the names of the inputs as they are printed; no language has them as words."""
    return [*map(command, craft.commands), *([SPEED] if craft.needs_speed else [])]


def command(name: str) -> str:
    """Return what a command or a channel is called in every language."""
    return f"cmd_{name}"


def printed(craft: Craft, syntax: Syntax) -> list[str]:
    """Return the lines that make `damping_X` to `known_N` of velocities, directions and inputs."""
    terms, n = craft.damping.model.basis.terms, craft.columns.n_known
    return [
        *actuation(craft, syntax),
        *speeds(terms, syntax),
        *sums("damping", terms, craft.matrix[n:], syntax),
        *sums("known", craft.known, craft.matrix[:n], syntax),
    ]


def actuation(craft: Craft, syntax: Syntax) -> Iterator[str]:
    """Yield the lines that make the actuators' channels, and u_c, of commands."""
    for actuator in craft.vehicle.actuators:
        if isinstance(actuator, Limited) and actuator.derived:
            name = command(actuator.channel)
            yield syntax.assign.format(name=name, value=_channel(actuator, syntax))
    asked = any(term.needs_propulsion for term in craft.damping.model.basis)
    known = [
        f"({syntax.number(one.speed_slope or 0.0)} * {command(one.channel)} "
        f"+ {syntax.number(one.speed_offset)})"
        for one in craft.propellers
    ]
    if known and asked:
        value = known[0] if len(known) == 1 else f"({' + '.join(known)}) / {len(known)}"
        yield syntax.assign.format(name=SPEED, value=value)


def _channel(actuator: Limited, syntax: Syntax) -> str:
    """Return what a command does within its limit, nothing in its dead zone."""
    given = command(actuator.command)
    if actuator.limit is not None:
        most = syntax.number(actuator.limit)
        lower = syntax.larger.format(x=given, y=f"-{most}")
        given = syntax.smaller.format(x=lower, y=most)
    acting = given
    if isinstance(actuator, Thruster):
        acting = _thrust(actuator, given, syntax)
    if actuator.dead_zone is None:
        return acting
    low, high = map(syntax.number, actuator.dead_zone)
    return f"{acting} * {syntax.outside.format(x=given, low=low, high=high)}"


def _thrust(thruster: Thruster, given: str, syntax: Syntax) -> str:
    if thruster.curve is None:
        return f"{syntax.number(thruster.gain or 0.0)} * {given}"
    at, values = (
        [number(value) for value in column] for column in zip(*thruster.curve, strict=True)
    )
    rows = (syntax.row.format(", ".join(column)) for column in (at, values))
    names = dict(zip(("at", "values"), rows, strict=True))
    return syntax.table.format(x=given, n=len(at), first=at[0], last=at[-1], **names)


def speeds(terms: Iterable[Term], syntax: Syntax) -> Iterator[str]:
    """Yield the lines that make the speeds and the propulsion ratio that terms contain."""
    used = {factor for term in terms for factor in term.factors}
    across = syntax.root.format(x="v*v + w*w")
    values = {
        "U": syntax.root.format(x="u*u + v*v + w*w"),
        "V": across,
        "V_v": f"{syntax.sign.format(x='v')} * {across}",
        "V_w": f"{syntax.sign.format(x='w')} * {across}",
    }
    for name, value in values.items():
        if name in used or (name == "U" and PROPULSION in used):
            yield syntax.assign.format(name=name, value=value)
    if PROPULSION in used:
        slow = syntax.larger.format(x="U", y=number(SLOWEST))
        yield syntax.assign.format(name=RATIO, value=f"{SPEED} / {slow} - 1.0")


def sums(
    name: str, terms: Iterable[Term], coefficients: FloatArray, syntax: Syntax
) -> Iterator[str]:
    """Yield a line an axis: what its coefficients, a row a term, make of the terms."""
    products = [product(term, syntax) for term in terms]
    for axis, column in zip(AXES, coefficients.T.tolist(), strict=True):
        parts = [
            f"{'-' if value < 0 else '+'} {number(abs(value))}{each}"
            for value, each in zip(column, products, strict=True)
            if value != 0.0
        ]
        value = syntax.sum.format(syntax.plus.join(parts)) if parts else "0.0"
        yield syntax.assign.format(name=f"{name}_{axis}", value=value)


def product(term: Term, syntax: Syntax) -> str:
    """Return a term as factors that follow a number."""
    return "".join(f" * {_factor(factor, syntax)}" for factor in term.factors)


def _factor(factor: str, syntax: Syntax) -> str:
    if factor == PROPULSION:
        return RATIO
    if factor in ABSOLUTES or (factor not in ATOM_PLACE and is_absolute(factor)):
        return syntax.absolute.format(x=_factor(factor.strip("|"), syntax))
    return factor if factor in ATOM_PLACE else command(factor)


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
