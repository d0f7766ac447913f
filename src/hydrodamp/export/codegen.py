"""Code generation: terms, actuators and template values of a plant in a programming language.

Templates are of jinja2; numbers of XML files are read back.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from hydrodamp.arrays import FloatArray
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
from hydrodamp.errors import MethodError
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.identification.adaptive import AdaptiveIdentifier
from hydrodamp.identification.composite import ONBOARD
from hydrodamp.identification.recursive import RecursiveLeastSquares
from hydrodamp.kernels.embedded import buffer_sizes
from hydrodamp.simulation.ranges import TYPICAL_VELOCITY
from hydrodamp.vehicle.actuators import Curve, Limited, Thruster
from hydrodamp.vehicle.mass import STANDARD_GRAVITY

if TYPE_CHECKING:
    from jinja2 import Environment

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
    actuators = plant.vehicle.actuators
    for actuator in sorted(actuators, key=lambda each: not isinstance(each, Curve)):
        if isinstance(actuator, Limited) and actuator.derived:
            yield command(actuator.channel), _channel(actuator, language)
    number = language.number
    known = [
        f"({number(x.speed_slope or 0.0)} * {command(x.channel)} + {number(x.speed_offset)})"
        for x in plant.propellers
    ]
    if known and plant.uses_propulsion_speed:
        yield SPEED, known[0] if len(known) == 1 else f"({' + '.join(known)}) / {len(known)}"


def _channel(actuator: Limited, language: Language) -> str:
    """Return the expression of a command within its limit, zero in its dead zone."""
    value = command(actuator.command)
    if isinstance(actuator, Curve):
        value = f"raw_{actuator.command}"
    if actuator.limit is not None:
        value = f"{language.prefix}limited({value}, {language.number(actuator.limit)})"
    acting = value
    if isinstance(actuator, Thruster) and (curve := actuator.curve) is not None:
        at, values = (", ".join(map(number, points)) for points in zip(*curve, strict=True))
        table = language.table.format(n=len(curve), at=at, values=values)
        acting = f"{language.prefix}along({value}, {table})"
    elif isinstance(actuator, Thruster):
        acting = f"{language.number(actuator.gain or 0.0)} * {value}"
    elif isinstance(actuator, Curve):
        acting = _curve(actuator, value, language)
    if actuator.dead_zone is None:
        return acting
    low, high = map(language.number, actuator.dead_zone)
    return f"{acting} * {language.prefix}outside({value}, {low}, {high})"


def _curve(curve: Curve, value: str, language: Language) -> str:
    """Return the expression of the value of a curve."""
    shape = curve.reference, curve.reverse_ratio, curve.dead_band, curve.exponent
    numbers = ", ".join(map(language.number, shape))
    text = f"{language.prefix}shaped({value}, {numbers})"
    if curve.voltage is None or curve.reference_voltage is None:
        return text
    reference, exponent = map(language.number, (curve.reference_voltage, curve.voltage_exponent))
    return f"{text} * {language.prefix}scaled({command(curve.voltage)}, {reference}, {exponent})"


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
    curved = {each.command for each in vehicle.actuators if isinstance(each, Curve)}
    locked = [axis for axis in "XYZKMN" if axis not in vehicle.axes]
    terms = (*vehicle.known_columns(), *damping.model.basis)
    return {
        "name": vehicle_identifier(plant),
        "title": _plain_text(f"{vehicle.name} with damping after {damping.model.title}."),
        "about": _plain_text(
            f"Written by hydrodamp {hydrodamp.__version__}.",
            f"Vehicle: {vehicle.source}." if vehicle.source else "",
            f"Coefficients: {damping.source}." if damping.source else "",
            *plant.reservations,
        ),
        "inputs": plant.inputs,
        "variables": [
            *(f"raw_{name}" if name in curved else command(name) for name in plant.commands),
            *[SPEED] * plant.needs_propulsion_speed,
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
    gains, recursion = AdaptiveIdentifier().bind(columns, model).settings, recursive.settings
    law = ONBOARD.bind(columns, model).settings
    table = columns.plant
    arrays = table.mass_matrix, table.free, table.factors, recursion.known, recursion.unit
    checksum = zlib.crc32(repr(model.labels).encode() + b"".join(map(np.ndarray.tobytes, arrays)))
    return {
        "labels": model.labels,
        "buffer_sizes": buffer_sizes(gains, recursion, law),
        "start": recursive.start.tolist(),
        "exported": plant.damping.coefficients.tolist(),
        "starts": recursion.starts.tolist(),
        "rows": recursion.rows.tolist(),
        "known": recursion.known.tolist(),
        "unit": recursion.unit.tolist(),
        "forgetting": recursion.forgetting,
        "length": recursion.block,
        "a": gains.a.tolist(),
        "gamma": gains.gamma.tolist(),
        "composite": {
            name: np.asarray(getattr(law, name)).tolist()
            for name in ("a", "gamma", "unit", "rate", "block", "kappa", "forgetting")
        },
        "methods": {
            "ai_composite": ("The composite adaptive identifier", checksum ^ 2),
            "rls": ("Recursive least squares", checksum),
            "ai": ("The adaptive identifier", checksum ^ 1),
        },
        "holds_speed": plant.uses_propulsion_speed and not plant.needs_propulsion_speed,
        "needs_propulsion_speed": plant.needs_propulsion_speed,
        "has_wrench": not plant.vehicle.actuators,
        "columns": _log_columns(plant),
    }


def _log_columns(plant: ExportedPlant) -> list[tuple[str, int, float]]:
    """Return columns of the canonical log, whether each is required, and its default."""
    required = dict(zip(VELOCITIES, plant.vehicle.free.astype(int).tolist(), strict=True))
    required |= dict.fromkeys((*ATTITUDE.columns, *EULER[:2]), 0)
    required |= dict.fromkeys(plant.commands, 1)
    required |= {"eta": 1} if plant.needs_propulsion_speed else {}
    required |= {} if plant.vehicle.actuators else dict.fromkeys(AXES, 0)
    return [(name, flag, 0.0) for name, flag in {"time": 1, **required}.items()]


def _plain_text(*sentences: str) -> str:
    """Return sentences without delimiters of comments or strings in any language."""
    text = " ".join(" ".join(sentences).split())
    text = text.replace("\\", "/").replace('"""', "'''")
    return text.replace("*/", "* /").replace("/*", "/ *")


def render_template(template: str, /, **values: object) -> str:
    """Return the text of a template."""
    return _environment().get_template(template).render(values, gravity=STANDARD_GRAVITY)


def _format_value(value: object) -> object:
    """Return floats as their shortest exact decimals; those of an array separated by spaces."""
    if isinstance(value, np.ndarray):
        return " ".join(map(number, value.ravel().tolist()))
    return number(value) if isinstance(value, float) else value


@cache
def _environment() -> Environment:
    try:
        from jinja2 import Environment, PackageLoader, StrictUndefined
    except ImportError as error:
        raise MethodError(
            'export needs the package jinja2: pip install "hydrodamp[export]"'
        ) from error
    return Environment(
        loader=PackageLoader("hydrodamp.export", "assets"),
        undefined=StrictUndefined,
        finalize=_format_value,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def parse_numbers(text: str) -> dict[str, FloatArray]:
    """Return the numbers in text and attributes of XML elements, by ``tag`` and ``parent/tag``."""
    numbers: dict[str, FloatArray] = {}
    for parent in ElementTree.fromstring(text).iter():
        for child in parent:
            texts = " ".join((child.text or "", *child.attrib.values())).split()
            with suppress(ValueError):
                values = np.array(texts, dtype=float)
                numbers |= {child.tag: values, f"{parent.tag}/{child.tag}": values}
    return numbers


def symmetric(values: Sequence[float] | FloatArray) -> FloatArray:
    """Return the symmetric matrix of an upper triangle."""
    matrix = np.zeros((3, 3) if len(values) == 6 else (6, 6))
    rows, columns = np.triu_indices(len(matrix))
    matrix[rows, columns] = matrix[columns, rows] = values
    return matrix
