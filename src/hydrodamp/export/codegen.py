"""Code generation: terms, actuators and template values of a plant in a programming language."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hydrodamp.basis.basis import SLOWEST
from hydrodamp.basis.term import (
    ABSOLUTES,
    ATOM_PLACE,
    AXES,
    PROPULSION,
    VELOCITIES,
    Term,
    is_absolute,
)
from hydrodamp.data.channels import ATTITUDE, EULER
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.identification.adaptive import AdaptiveIdentifier
from hydrodamp.identification.recursive import TYPICAL_VELOCITY, RecursiveLeastSquares
from hydrodamp.kernels import core
from hydrodamp.vehicle.actuators import Limited, Thruster

#: Identifiers of u_c and of the propulsion ratio minus one in every language.
SPEED, RATIO = "u_c", "eta_1"

#: Prefix of every generated identifier; no keyword, built-in, file or function begins with it.
PREFIX = "auv_"


@dataclass(frozen=True)
class Language:
    """Syntax of expressions: prefix of functions, absolute value, constants, lookup tables."""

    prefix: str = ""
    absolute: str = "abs({})"
    constant: str = "{}"
    table: str = "[{at}], [{values}]"

    def number(self, value: float) -> str:
        """Return a number as part of an expression."""
        return self.constant.format(number(value))


PYTHON = Language()
CASADI = Language(absolute="absolute({})")
C99 = Language(
    prefix="hd_",
    constant="(hd_real){}",
    table="{n}, (const hd_real[]){{{at}}}, (const hd_real[]){{{values}}}",
)


def number(value: float) -> str:
    """Return the shortest decimal that parses to the same double."""
    return repr(float(value))


def command(name: str) -> str:
    """Return the identifier of a command or channel in every language."""
    return f"cmd_{name}"


def actuator_channels(plant: ExportedPlant, language: Language) -> Iterator[tuple[str, str]]:
    """Yield the channels derived from commands, and u_c, each with its expression."""
    for actuator in plant.vehicle.actuators:
        if isinstance(actuator, Limited) and actuator.derived:
            yield command(actuator.channel), _channel(actuator, language)
    known = [
        f"({language.number(propeller.speed_slope or 0.0)} * {command(propeller.channel)} "
        f"+ {language.number(propeller.speed_offset)})"
        for propeller in plant.propellers
    ]
    if known and plant.uses_propulsion_speed:
        yield SPEED, known[0] if len(known) == 1 else f"({' + '.join(known)}) / {len(known)}"


def _channel(actuator: Limited, language: Language) -> str:
    """Return the expression of a command within its limit, zero in its dead zone."""
    value = command(actuator.command)
    if actuator.limit is not None:
        value = f"{language.prefix}limited({value}, {language.number(actuator.limit)})"
    acting = value
    if isinstance(actuator, Thruster) and actuator.curve is None:
        acting = f"{language.number(actuator.gain or 0.0)} * {value}"
    elif isinstance(actuator, Thruster) and actuator.curve is not None:
        at, values = (
            ", ".join(map(number, points)) for points in zip(*actuator.curve, strict=True)
        )
        table = language.table.format(n=len(actuator.curve), at=at, values=values)
        acting = f"{language.prefix}along({value}, {table})"
    if actuator.dead_zone is None:
        return acting
    low, high = map(language.number, actuator.dead_zone)
    return f"{acting} * {language.prefix}outside({value}, {low}, {high})"


def product(term: Term, language: Language) -> str:
    """Return a term as a product of identifiers."""
    return " * ".join(_factor(factor, language) for factor in term.factors) or "1.0"


def _factor(factor: str, language: Language) -> str:
    if factor == PROPULSION:
        return RATIO
    if factor in ABSOLUTES or (factor not in ATOM_PLACE and is_absolute(factor)):
        return language.absolute.format(_factor(factor.strip("|"), language))
    return factor if factor in ATOM_PLACE else command(factor)


def vehicle_identifier(plant: ExportedPlant) -> str:
    """Return the vehicle's name as a valid identifier of every language."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", plant.vehicle.name).strip("_")
    return f"{PREFIX}{name or 'vehicle'}"


def template_values(plant: ExportedPlant, language: Language = PYTHON) -> dict[str, object]:
    """Return the values of templates in all languages: texts, inputs, terms and matrices."""
    import hydrodamp

    vehicle, damping = plant.vehicle, plant.damping
    locked = [axis for axis in "XYZKMN" if axis not in vehicle.axes]
    terms = (*vehicle.known_columns(), *damping.model.basis)
    return {
        "name": vehicle_identifier(plant),
        "title": _plain_text(f"{vehicle.name} with damping after {damping.model.title}."),
        "about": _plain_text(
            f"Written by hydrodamp {hydrodamp.__version__}.",
            f"Vehicle: {vehicle.source}." if vehicle.source else "",
            f"Coefficients: {damping.source}." if damping.source else "",
        ),
        "inputs": plant.inputs,
        "variables": [
            *map(command, plant.commands),
            *([SPEED] if plant.needs_propulsion_speed else []),
        ],
        "channels": [*actuator_channels(plant, language)],
        "uses_propulsion_speed": plant.uses_propulsion_speed,
        "slowest": SLOWEST,
        "terms": [*map(str, terms)],
        "products": [product(term, language) for term in terms],
        "n_known": plant.columns.n_known,
        "matrix": plant.matrix.tolist(),
        "mass": vehicle.mass_matrix.tolist(),
        "inverse": plant.inverse.tolist(),
        "locked": f" (zero on the locked axes {' '.join(locked)})" if locked else "",
    }


def identifier_values(plant: ExportedPlant) -> dict[str, object]:
    """Return the template values of the embedded estimators: settings of ``hydrodamp live``."""
    model, columns = plant.damping.model, plant.columns
    recursive = RecursiveLeastSquares(typical_velocity=TYPICAL_VELOCITY).bind(columns, model)
    gains, recursion = AdaptiveIdentifier().bind(columns, model).gains, recursive.recursion
    table = columns.plant
    arrays = table.mass_matrix, table.free, table.factors, recursion.known, recursion.unit
    checksum = zlib.crc32(repr(model.labels).encode() + b"".join(map(np.ndarray.tobytes, arrays)))
    return {
        "labels": model.labels,
        "buffer_sizes": core.buffer_sizes(gains, recursion),
        "start": recursive.start.coefficients.tolist(),
        "exported": plant.damping.coefficients.tolist(),
        "starts": recursion.starts.tolist(),
        "rows": recursion.rows.tolist(),
        "known": recursion.known.tolist(),
        "unit": recursion.unit.tolist(),
        "forgetting": recursion.forgetting,
        "length": recursion.block,
        "a": gains.a.tolist(),
        "gamma": gains.gamma.tolist(),
        "marks": {"rls": checksum, "ai": checksum ^ 1},
        "holds_speed": plant.uses_propulsion_speed and not plant.needs_propulsion_speed,
        "needs_propulsion_speed": plant.needs_propulsion_speed,
        "has_wrench": not plant.vehicle.actuators,
        "columns": [*_log_columns(plant)],
    }


def _log_columns(plant: ExportedPlant) -> Iterator[tuple[str, int, float]]:
    """Yield columns of the canonical log, whether each is required, and its default."""
    yield "time", 1, 0.0
    free = plant.vehicle.free.astype(int).tolist()
    required = dict(zip(VELOCITIES, free, strict=True))
    required |= dict.fromkeys((*ATTITUDE.columns, *EULER[:2]), 0)
    required |= dict.fromkeys(plant.commands, 1)
    required |= {"eta": 1} if plant.needs_propulsion_speed else {}
    required |= {} if plant.vehicle.actuators else dict.fromkeys(AXES, 0)
    for name, flag in required.items():
        yield name, flag, 0.0


def _plain_text(*sentences: str) -> str:
    """Return sentences without delimiters of comments or strings in any language."""
    text = " ".join(" ".join(sentences).split())
    text = text.replace("\\", "/").replace('"""', "'''")
    return text.replace("*/", "* /").replace("/*", "/ *")
