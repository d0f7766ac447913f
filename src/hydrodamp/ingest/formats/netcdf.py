"""netCDF: variables of classic files, and the attributes of the CF conventions.

netCDF-4 files are HDF5; `arrays` reads them and decodes the same attributes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.channels import UNITS, parse_unit
from hydrodamp.ingest.formats.content import open_seekable
from hydrodamp.ingest.formats.dates import is_date, parse_dates

#: Attributes of a variable that state its numbers and their meaning.
ATTRIBUTES = (
    *("units", "standard_name", "scale_factor", "add_offset", "_FillValue", "missing_value"),
)
_SINCE = re.compile(r"\s*(\w+)\s+since\s+(.*)", re.IGNORECASE)
_DIGIT = re.compile(r"(?<![\d.])\d(?!\d)")
_YEAR = re.compile(r"^\d+(?=-\d+-\d\d(?!\d))")
_HOUR = re.compile(r"[T ]\d\d(?=Z?$)")
#: Fill of variables without _FillValue by type; bytes have none.
_DEFAULT_FILLS = {
    **dict.fromkeys(("f4", "f8"), 9.969209968386869e36),
    "i2": -(2**15) + 1,
    "i4": -(2**31) + 1,
    "i8": -(2**63) + 2,
    "u2": 2**16 - 1,
    "u4": 2**32 - 1,
    "u8": 2**64 - 2,
}

#: Attributes of variables by name.
Attributes = dict[str, Mapping[str, Any]]


class Variable(NamedTuple):
    """Numbers of a variable, their unit and the standard name of their quantity."""

    values: Any
    unit: str = ""
    standard_name: str = ""
    fault: str = ""


def read_classic(path: str | Path, attributes: Attributes) -> Iterator[tuple[str, Any]]:
    """Yield the numeric variables of a file of the classic format."""
    from scipy.io import netcdf_file

    with open_seekable(path) as content, netcdf_file(content, mmap=False) as file:
        variables: Mapping[str, Any] = file.variables
        for name, variable in variables.items():
            if variable.data.dtype.kind in "if":
                attributes[name] = variable._attributes
                yield name, np.array(variable.data, variable.data.dtype.newbyteorder("="))


def decode_variable(array: Any, attributes: Mapping[str, Any]) -> Variable:
    """Return the physical values of a packed array; times since a date count from 1970 [s]."""
    plain = {key: _plain_value(attributes[key]) for key in ATTRIBUTES if key in attributes}
    unit, standard_name = (str(plain.pop(key, "")).strip() for key in ATTRIBUTES[:2])
    dtype = np.asarray(array).dtype
    if dtype.kind not in "buif" or not (plain or unit):
        return Variable(array, unit, standard_name)
    values: FloatArray = np.array(array, dtype=np.float64)
    fills = (plain.get("_FillValue", _DEFAULT_FILLS.get(dtype.str[1:])), plain.get("missing_value"))
    for fill in fills:
        if isinstance(fill, (int, float)):
            rounding = 1e-6 if dtype.kind == "f" else 0.0
            values[np.isclose(values, fill, rtol=rounding, atol=0.0)] = np.nan
    scale, offset = plain.get("scale_factor", 1.0), plain.get("add_offset", 0.0)
    if (scale, offset) != (1.0, 0.0):
        values = values * scale + offset
    if (match := _SINCE.fullmatch(unit)) and (word := parse_unit(match[1], "time")):
        if (epoch := _parse_epoch(match[2])) is None:
            fault = f"expected units such as 'seconds since 1970-01-01 00:00:00', found '{unit}'"
            return Variable(values, unit, standard_name, fault)
        return Variable(values * UNITS["time"][word] + epoch, "s", standard_name or "time")
    return Variable(values, unit, standard_name)


def _parse_epoch(text: str) -> float | None:
    """Return seconds since 1970 of an epoch such as `1970-1-1 0:0:0`; None if it is no date."""
    text = _YEAR.sub(lambda year: year[0].zfill(4), _DIGIT.sub(r"0\g<0>", text.strip()), count=1)
    text = _HOUR.sub(r"\g<0>:00", text)
    with suppress(ValueError):
        return float(parse_dates([text])[0][0]) if is_date(text) else None
    return None


def _plain_value(value: Any) -> Any:
    """Return an attribute as text or number; the first of several numbers."""
    if isinstance(value, (bytes, np.bytes_)):
        return value.decode("utf-8", errors="replace")
    first: Any = np.ravel(value)[0] if np.size(value) else ""
    return first.item() if isinstance(first, np.generic) else first


def is_netcdf(path: str | Path, names: Iterable[str]) -> bool:
    """Return whether an HDF5 file is netCDF, by its suffixes or the attributes of its root."""
    suffixes = {suffix.lower() for suffix in Path(path).suffixes}
    return bool({".nc", ".nc4", ".cdf"} & suffixes or {"_NCProperties", "Conventions"} & {*names})
