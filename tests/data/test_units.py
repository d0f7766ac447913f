from __future__ import annotations

import math

import pytest

from hydrodamp.data.units import UNITS, factor
from hydrodamp.errors import LogError

# NIST SP 811 (2008), appendix B.8, to the digits printed there.
NIST = {
    ("speed", "knots"): 5.144444e-1,
    ("speed", "km/h"): 2.777778e-1,
    ("speed", "ft/s"): 3.048e-1,
    ("angle", "deg"): 1.745329e-2,
    ("angular rate", "rpm"): 1.047198e-1,
    ("force", "lbf"): 4.448222,
    ("force", "kgf"): 9.80665,
    ("moment", "lbf ft"): 1.355818,
}


@pytest.mark.parametrize(("place", "value"), NIST.items(), ids=lambda item: str(item))
def test_factors_are_those_of_nist(place: tuple[str, str], value: float) -> None:
    assert factor(place[1], place[0]) == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize("quantity", UNITS)
def test_every_quantity_has_its_si_unit_first(quantity: str) -> None:
    assert next(iter(UNITS[quantity].values())) == 1.0


def test_a_unit_of_another_quantity_is_refused() -> None:
    with pytest.raises(LogError, match=r"'deg' is no unit of angular rate .* mean 'deg/s'\?"):
        factor("deg", "angular rate")


def test_any_quantity_will_do_where_none_is_asked() -> None:
    assert factor("deg") == math.pi / 180
    with pytest.raises(LogError, match="'furlong' is no unit known here"):
        factor("furlong")
