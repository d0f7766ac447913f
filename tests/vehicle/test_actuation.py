from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.basis.term import Term
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.actuators import command_of, limited, wrench_columns


def test_missing_command_names_the_nearest():
    with pytest.raises(VehicleError, match=r"`rudder`; got rudr, rpm. Did you mean 'rudr'"):
        command_of({"rudr": np.zeros(2), "rpm": np.zeros(2)}, "rudder")
    with pytest.raises(VehicleError, match=r"`rudder`; got none"):
        command_of({}, "rudder")


def test_limit_is_symmetric():
    values = np.linspace(-2, 2, 9)
    np.testing.assert_array_equal(limited(values, 1.0), -limited(-values, 1.0))
    assert np.abs(limited(values, 1.0)).max() == 1.0
    np.testing.assert_array_equal(limited(values, None), values)


def test_wrench_columns_drop_zeros_and_keep_order():
    columns = wrench_columns([0, 2, 0, 0, 0, -3], Term.parse("rudder"))
    assert [(c.axis, c.value) for c in columns] == [("Y", 2.0), ("N", -3.0)]
