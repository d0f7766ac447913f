"""Drafts of mappings for clocks, units and cells as programs write them: the log that they read."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import suppress_warnings
from hydrodamp.ingest.inspection.probe import inspect
from strangers import write_columns
from table_rows import rows

TIME = np.arange(0.0, 80.0, 0.1)
RATE = 0.2 * np.sin(0.3 * TIME) + 0.1 * np.cos(0.8 * TIME)  # rad/s
YAW = 0.4 - 0.2 / 0.3 * np.cos(0.3 * TIME) + 0.125 * np.sin(0.8 * TIME)
SURGE = 2.0 + 0.2 * np.sin(0.2 * TIME)
SWAY = 0.1 * np.cos(0.3 * TIME)


def read_by_draft(path):
    with suppress_warnings():
        return hd.read_log(path, hd.probe(hd.read_recording(path)).mapping())


def assert_motion(log, step=0.1, atol=2e-4):
    """Check surge, sway, yaw rate and step of a log of the motion above."""
    np.testing.assert_allclose(np.mean(np.diff(log.time)), step, rtol=1e-3)
    for index, values in ((0, SURGE), (1, SWAY), (5, RATE)):
        np.testing.assert_allclose(log.velocity[:, index], values[: log.n], atol=atol)


def canonical(**others):
    angles = {"yaw": np.degrees(YAW), "r": np.degrees(RATE)}
    return {"time": TIME, **others, **angles, "u": SURGE, "v": SWAY}


@pytest.mark.slow
@pytest.mark.parametrize("texts", [["hold"], ["---"], [""], ["auto", "manual"]])
def test_text_among_canonical_names_and_degrees(tmp_path, texts):
    labels = np.resize(texts, len(TIME))
    path = write_columns(tmp_path / "log.csv", canonical(mode=labels))
    assert_motion(read_by_draft(path))
    recording = hd.read_recording(path)
    judged = inspect(hd.probe(recording), [recording])
    assert judged.is_drafted
    assert_motion(judged.log)


def write_netcdf(path, form, *, packed, since):
    """Write the motion as netCDF with attributes of the CF conventions."""
    unit, _, date = since.partition(" since ")
    epoch = (np.datetime64("2023-11-14T22:13:20") - np.datetime64(date[:10])) / np.timedelta64(
        1, "s"
    )
    scale = {"seconds": 1.0, "days": 86400.0, "milliseconds": 1e-3}[unit]
    columns = {
        "obs_time": ((epoch + TIME) / scale, since, "time"),
        "a": (np.degrees(YAW), "degrees_true", "platform_orientation"),
        "b": (np.degrees(RATE), "degree s-1", "platform_yaw_rate"),
        "forward_velocity": (100.0 * SURGE, "cm s-1", ""),
        "starboard_velocity": (SWAY, "m s^-1", ""),
        "downward_velocity": (0.1 * SWAY, "m.s-1", ""),
        "v": (SURGE, "m s-1", "northward_sea_water_velocity"),
        "rudder": (np.degrees(SWAY), "degrees", ""),
    }

    def encode(name, values):
        if not packed or name == "obs_time":
            return values, {}
        offset, factor = float(values.mean()), float(np.ptp(values)) / 4e4
        packed_values = np.round((values - offset) / factor).astype("i2")
        packed_values[-1] = -32768  # the fill value
        return packed_values, {
            "scale_factor": factor,
            "add_offset": offset,
            "_FillValue": np.int16(-32768),
        }

    encoded = {
        name: (*encode(name, values), {"units": units, "standard_name": standard})
        for name, (values, units, standard) in columns.items()
    }
    if form == "hdf5":
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            for name, (values, packing, texts) in encoded.items():
                file[name] = values
                file[name].attrs.update({**packing, **{k: np.bytes_(v) for k, v in texts.items()}})
        return path
    from scipy.io import netcdf_file

    with netcdf_file(path, "w") as file:
        file.createDimension("obs", len(TIME))
        for name, (values, packing, texts) in encoded.items():
            variable = file.createVariable(name, values.dtype, ("obs",))
            variable[:] = values
            for key, value in {**packing, **texts}.items():
                setattr(variable, key, value)
    return path


@pytest.mark.parametrize("form", ["hdf5", "classic"])
@rows("packed, since")
def test_netcdf_has_the_units_of_its_attributes(tmp_path, form, packed, since):
    path = write_netcdf(tmp_path / "auv.nc", form, packed=packed, since=since)
    recording = hd.read_recording(path)
    assert recording.format == "netCDF"
    log = read_by_draft(path)
    assert_motion(log, atol=1e-3)
    assert log.time[0] == pytest.approx(1.7e9, abs=1e-3)
    assert log.n == len(TIME) - packed
    np.testing.assert_allclose(log.velocity[:, 2], 0.1 * SWAY[: log.n], atol=1e-4)
    np.testing.assert_allclose(log.commands[:, 0], SWAY[: log.n], atol=1e-4)


def test_german_names_and_marks_of_thousands(tmp_path):
    def german(value):
        return f"{value:,.4f}".translate(str.maketrans(",.", ".,"))

    columns = {
        "Zeit [s]": 960.0 + TIME,
        "Gier [deg]": np.degrees(YAW),
        "u [m/s]": SURGE,
        "v [m/s]": SWAY,
        "r [deg/s]": np.degrees(RATE),
        "Ruder [deg]": np.degrees(SWAY),
        "Drehzahl [1/min]": 2000.0 + 1000.0 * RATE,
    }
    rows = [";".join(map(german, row)) for row in zip(*columns.values(), strict=True)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([";".join(columns), *rows]), encoding="utf-8")
    log = read_by_draft(path)
    assert_motion(log)
    assert log.command_names == ("Ruder", "Drehzahl")
    np.testing.assert_allclose(log.commands[:, 1], 2000.0 + 1000.0 * RATE, atol=1e-4)


def digits_of(seconds):
    """Return times of day as hhmmss."""
    minutes, second = np.divmod(np.round(seconds, 3) % 86400.0, 60.0)
    hour, minute = np.divmod(minutes, 60.0)
    return 1e4 * hour + 1e2 * minute + second


START = 1717148640.0  # s; 2024-05-31 09:44 UTC
WRAP = 2**32

#: Columns of a clock, and the first time that the log has; None for any.
CLOCKS = {
    "hhmmss": ({"time": digits_of(START + TIME)}, START % 86400.0),
    "hhmmss over midnight": ({"gps_time": digits_of(86390.0 + TIME)}, 86390.0),
    "hhmmssmmm": ({"UTC time": 1e3 * digits_of(START + TIME)}, START % 86400.0),
    "yyyymmddhhmmss": ({"timestamp": 20240531e6 + digits_of(START + TIME)}, START),
    "yyyymmdd beside hhmmss": (
        {"date": np.full(len(TIME), 20240531), "utc": digits_of(START + TIME)},
        START,
    ),
    "dates beside times over midnight": (
        {
            "Date": np.where(TIME < 10.0, "31.05.2024", "01.06.2024"),
            "Time": [
                f"{t // 3600 % 24:02.0f}:{t // 60 % 60:02.0f}:{t % 60:06.3f}"
                for t in (86390.0 + TIME).tolist()
            ],
        },
        1717199990.0,
    ),
    "days of a spreadsheet": ({"Timestamp": (START + TIME) / 86400.0 + 25569.0}, START),
    "days of MATLAB": ({"time": (START + TIME) / 86400.0 + 719529.0}, START),
    "days since 1970": ({"t": (START + TIME) / 86400.0}, START),
    "week and time of the week": (
        {"GPS week": np.full(len(TIME), 2316), "iTOW [ms]": 1e3 * (467040.0 + TIME)},
        315964800.0 + 2316 * 604800.0 + 467040.0,
    ),
    "over the end of the week": (
        {
            "week": np.where(TIME < 10.0, 2316, 2317),
            "tow": np.round((604790.0 + TIME) % 604800.0, 3),
        },
        315964800.0 + 2317 * 604800.0 - 10.0,
    ),
    "tow without week": ({"tow": np.round((604790.0 + TIME) % 604800.0, 3)}, 604790.0),
    "counter of ms": ({"time_boot_ms": (WRAP - 20000 + np.round(1e3 * TIME)) % WRAP}, None),
    "counter of us": ({"TimeUS": (WRAP - 20000000 + np.round(1e6 * TIME)) % WRAP}, None),
    "signed counter of ms": (
        {"t_ms": (2**31 - 20000 + np.round(1e3 * TIME)) % WRAP - WRAP * (TIME >= 20.0)},
        None,
    ),
    "seconds called ms": ({"tow (ms)": 200000.0 + TIME}, 200000.0),
    "seconds called us": ({"time [us]": 50.0 + TIME}, 50.0),
    "ms called seconds": ({"time [s]": 1e3 * TIME}, 0.0),
    "ms called us": ({"time [us]": 1e3 * TIME}, 0.0),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", CLOCKS)
def test_clocks(tmp_path, kind):
    columns, start = CLOCKS[kind]
    motion = {
        "heading (deg)": np.degrees(YAW) % 360.0,
        "r (deg/s)": np.degrees(RATE),
        "u": SURGE,
        "v": SWAY,
    }
    log = read_by_draft(write_columns(tmp_path / "log.csv", {**columns, **motion}))
    assert_motion(log, atol=1e-3)
    assert [len(log.segments), log.n] == [1, len(TIME)]
    np.testing.assert_allclose(np.ptp(log.time), 79.9, rtol=1e-4)
    if start is not None:
        assert log.time[0] == pytest.approx(start, abs=1e-3)


@pytest.mark.parametrize("rate", [50.0, 0.0333])
def test_clocks_with_plausible_units_stay(tmp_path, rate):
    """Seconds since 1970 at 30 s are no milliseconds; a fast sensor keeps its stated unit."""
    columns = {"time": START + TIME * 10.0 / rate, "pitch_deg": 20.0 * SWAY, "depth": SURGE}
    found = hd.probe(hd.read_recording(write_columns(tmp_path / "log.csv", columns)))
    assert found.topics[0].rate == pytest.approx(rate, rel=1e-3)


@pytest.mark.slow
def test_a_fast_sensor_keeps_its_stated_unit_by_its_rates(tmp_path):
    time = np.arange(0.0, 20.0, 5e-4)
    columns = {"t [ms]": 1e3 * time, "yaw": np.sin(time), "r [rad/s]": np.cos(time), "u": time}
    log = read_by_draft(write_columns(tmp_path / "log.csv", columns))
    assert log.time[-1] == pytest.approx(time[-1])


@pytest.mark.slow
@rows("header")
@pytest.mark.parametrize("delay", [0.0, 0.013])
def test_long_form(tmp_path, header, delay):
    columns = {
        "yaw_deg": np.degrees(YAW),
        "yaw_rate_deg_s": np.degrees(RATE),
        "u": SURGE,
        "v": SWAY,
    }
    rows = [
        f"2024-05-31T10:{t // 60:02.0f}:{t % 60:06.3f}Z,{name},{value:.9g}"
        for k, time in enumerate(TIME.tolist())
        for shift, (name, values) in enumerate(columns.items())
        for t, value in [(time + (shift % 2) * delay, float(values[k]))]
    ]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([header, *rows]), encoding="utf-8")
    log = read_by_draft(path)
    assert log.n >= len(TIME) - 1
    assert_motion(log, atol=0.015 if delay else 2e-4)
