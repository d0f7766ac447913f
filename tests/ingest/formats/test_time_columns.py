"""Columns of digits `hhmmss`, and dates next to times of day."""

import numpy as np
import pytest

import hydrodamp as hd
from table_rows import rows

DAY = 86400.0
JUNE = 1717200000.0  # 2024-06-01


def read_time(path, header, row, n=60):
    path.write_text("\n".join([f"{header},u", *(f"{row(k)},{k}" for k in range(n))]), "utf-8")
    return hd.read_recording(path).topics[0].fields[header.split(",")[-1]]


def day_and_time(since_june):
    day, time = divmod(since_june, 86400)
    return f"2024-06-{day + 1:02d},{time // 3600:02d}:{time // 60 % 60:02d}:{time % 60:02d}"


@pytest.mark.parametrize("start", [36000, 86370], ids=["of two days apart", "over midnight"])
@pytest.mark.parametrize("n_missing", [0, 10, 40])
def test_each_time_of_day_has_the_date_of_its_row(tmp_path, start, n_missing):
    pause = 2 * 86400 - 3600 if start == 36000 else 0
    seconds = [start + k + pause * (k >= 30) for k in range(60)]

    def row(k):
        date, time = day_and_time(seconds[k]).split(",")
        return f"{'' if k < n_missing and (pause == 0 or k < 20) else date},{time}"

    times = read_time(tmp_path / "a.csv", "date,time", row)
    np.testing.assert_array_equal(times, JUNE + np.array(seconds))


def test_a_date_of_the_start_continues_over_midnight(tmp_path):
    def row(k):
        return f"2024-06-01,{day_and_time(86370 + k).split(',')[1]}"

    times = read_time(tmp_path / "a.csv", "date,time", row)
    np.testing.assert_array_equal(times, JUNE + 86370.0 + np.arange(60.0))


@rows("name, period, n_burst")
def test_seconds_with_pauses_are_no_digits(tmp_path, name, period, n_burst):
    seconds = [period * (k // n_burst) + k % n_burst for k in range(150)]
    times = read_time(tmp_path / "a.csv", name, lambda k: f"{seconds[k]}", 150)
    np.testing.assert_array_equal(times, seconds)


@pytest.mark.parametrize("step", [0.2, 1.0, 20.0, 30.0])
def test_digits_with_a_carry_are_times_of_day(tmp_path, step):
    seconds = (86380.0 + step * np.arange(400)) % DAY
    digits = seconds // 3600 * 1e4 + seconds // 60 % 60 * 1e2 + seconds % 60
    times = read_time(tmp_path / "a.csv", "time", lambda k: f"{digits[k]:09.2f}", 400)
    np.testing.assert_allclose(times, 86380.0 + step * np.arange(400), atol=1e-6)
