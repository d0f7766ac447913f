"""Attributes of the CF conventions: epochs of times and fill values."""

import numpy as np

import hydrodamp as hd
from hydrodamp.ingest.formats.netcdf import decode_variable
from table_rows import rows


@rows("units, seconds")
def test_epochs(units, seconds):
    variable = decode_variable(np.array([1.0]), {"units": units})
    assert (variable.values[0], variable.unit, variable.fault) == (seconds, "s", "")


@rows("kind, fill")
def test_the_default_fill_is_missing(kind, fill):
    values = np.array([7, fill, 100], dtype=kind)
    found = decode_variable(values, {"units": "m/s", "scale_factor": 0.5}).values
    np.testing.assert_array_equal(found, [3.5, np.nan, 50.0])
    stated = decode_variable(values, {"units": "m/s", "_FillValue": values[2]}).values
    np.testing.assert_array_equal(np.isnan(stated), [False, False, True])


def test_integers_next_to_the_fill_stay():
    values = np.array([-2147483647, -2147483646], dtype="i4")
    found = decode_variable(values, {"units": "m"}).values
    np.testing.assert_array_equal(found, [np.nan, -2147483646.0])


def test_an_unreadable_epoch_is_a_fault_of_its_variable(tmp_path):
    from scipy.io import netcdf_file

    with netcdf_file(tmp_path / "a.nc", "w") as file:
        file.createDimension("obs", 20)
        for name, units in {"time": "seconds since launch", "u": "m/s"}.items():
            variable = file.createVariable(name, "f8", ("obs",))
            variable[:] = np.arange(20.0)
            variable.units = units
    topic = hd.read_recording(tmp_path / "a.nc").topics[0]
    assert "found 'seconds since launch'" in topic.faults["time"]
    assert [*topic.fields] == ["u"]
