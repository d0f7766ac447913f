"""Tables in long form: names of columns, times and dates."""

import numpy as np

import hydrodamp as hd
from hydrodamp.ingest.read import read_recordings


def read_rows(path, header, *rows):
    path.write_text("\n".join([header, *rows]), encoding="utf-8")
    return hd.read_recording(path)


def test_a_wide_table_with_a_tag_stays(tmp_path):
    rows = [f"{0.1 * k:.1f},{'start' if k < 5 else 'run'},{k},{k},{2 * k}" for k in range(60)]
    topic = read_rows(tmp_path / "a.csv", "time,tag,value,u,heading", *rows).topics[0]
    assert [*topic.fields] == ["time", "value", "u", "heading"]


def test_texts_that_distinguish_rows_join_the_names_of_a_long_form(tmp_path):
    rows = [
        f"{k},,_result,0,{0.1 * k:.1f},{sensor},{field},{value + k},m"
        for k in range(30)
        for sensor, field, value in (("imu", "x", 0), ("dvl", "x", 1000), ("imu", "y", 5))
    ]
    header = "Unnamed: 0,,result,table,_time,_measurement,_field,_value,unit"
    topic = read_rows(tmp_path / "a.csv", header, *rows).topics[0]
    assert [*topic.fields] == ["_time", "imu.x", "dvl.x", "imu.y"]
    np.testing.assert_array_equal(topic.fields["dvl.x"], 1000.0 + np.arange(30))


def test_a_long_form_keeps_its_time_and_the_order_of_its_dates(tmp_path):
    def write(day):
        path = tmp_path / f"{day[:2]}-{day[3:5]}.csv"
        rows = [f"{day} 12:00:{k:02d},{name},{k}" for k in range(50) for name in ("u", "time")]
        read_rows(path, "time,name,value", *rows)
        return path

    recordings = read_recordings([write("06/01/2024"), write("06/13/2024")])
    first, last = (recording.topics[0].fields["time"] for recording in recordings)
    np.testing.assert_array_equal(first, 1717243200.0 + np.arange(50.0))
    np.testing.assert_array_equal(last, first + 12 * 86400.0)
