"""Dates as day/month or month/day: one order for all files of a call."""

from datetime import UTC, datetime

import numpy as np

import hydrodamp as hd
from hydrodamp.ingest.formats.dates import is_date, parse_dates
from hydrodamp.ingest.read import read_recordings
from table_rows import rows


def write_dive(path, *dates, suffix=""):
    rows = [f"{date} 11:45:{k:02}{suffix},{0.1 * k}" for date in dates for k in range(20)]
    path.write_text("\n".join(["when,u", *rows]), encoding="utf-8")
    return str(path)


def start_day(recording):
    return f"{datetime.fromtimestamp(recording.topics[0].fields['when'][0], tz=UTC):%m-%d}"


@rows("dates, days, note")
def test_all_files_of_a_call_have_one_order(tmp_path, dates, days, note):
    paths = [write_dive(tmp_path / f"{k}.csv", date) for k, date in enumerate(dates)]
    for order in (1, -1):
        recordings = read_recordings(paths[::order])[::order]
        assert [*map(start_day, recordings)] == days
        assert any(f"are read {note}" in text for text in recordings[0].notes)


def test_a_log_over_midnight_and_a_lone_ambiguous_day(tmp_path):
    over_midnight = hd.read_recording(write_dive(tmp_path / "a.csv", "09/11/2020", "09/12/2020"))
    alone = hd.read_recording(write_dive(tmp_path / "b.csv", "12/09/2020"))
    american = hd.read_recording(write_dive(tmp_path / "c.csv", "12/09/2020", suffix=" AM"))
    assert [start_day(it) for it in (over_midnight, alone, american)] == ["09-11", "09-12", "12-09"]
    assert "day first, as both orders fit" in alone.notes[-1]
    assert "month first, as both orders fit" in american.notes[-1]
    same = hd.read_recording(write_dive(tmp_path / "d.csv", "09/09/2020"))
    assert not any("order" in note for note in same.notes)


def test_read_logs_joins_days_in_order(tmp_path):
    mapping = tmp_path / "m.yaml"
    mapping.write_text("frame: FRD\ntime: when\nvelocity: {u: u}\n", encoding="utf-8")
    paths = [
        write_dive(tmp_path / f"{day}.csv", date)
        for day, date in (("a", "09/12/2020"), ("b", "09/13/2020"))
    ]
    log = hd.read_logs(paths, mapping)
    assert log.time[20] - log.time[0] == 86400.0


@rows("cell, seconds")
def test_forms_of_dates(cell, seconds):
    assert is_date(cell)
    assert parse_dates([cell])[0][0] == 1717200000.0 + seconds


@rows("cell")
def test_other_cells_are_no_dates(cell):
    assert not is_date(cell)
    assert np.isnan(parse_dates([cell])[0][0])


@rows("cell")
def test_months_by_name_and_years_of_two_digits(cell):
    expected = datetime(2024, 6, 1, 12, 0, 5, tzinfo=UTC).timestamp()
    assert is_date(cell)
    assert parse_dates([cell])[0].tolist() == [expected]
