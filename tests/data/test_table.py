from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hydrodamp.data.table import read_table
from hydrodamp.errors import FileError

Write = Callable[..., Path]


def test_numbers_and_texts_are_told_apart(csv_file: Write) -> None:
    table = read_table(csv_file("a,tag,b\n1,x,2\n3,y,4e-1\n"), texts=("tag",))
    assert table.faults == []
    assert table.numbers["a"].tolist() == [1, 3]
    assert table.numbers["b"].tolist() == [2, 0.4]
    assert table.texts == {"tag": ("x", "y")}
    assert table.lines == [2, 3]


@pytest.mark.parametrize(
    "text",
    [
        "\ufeffa,b\n1,2\n3,4\n",
        '"a","b"\n"1","2"\n3,4\n',
        "a, b\n1, 2\n 3 ,4\n",
        "a,b\r\n1,2\r\n3,4\r\n",
        "a,b\n1,2\n3,4",
        "\na,b\n\n1,2\n\n3,4\n\n\n",
        "a,b\n1,2\n3,4\n  \n,\n,,,\n",
        "a,b,\n1,2,\n3,4,\n",
        "a,b\n1,2,\n3,4, \n",
    ],
    ids=["bom", "quotes", "spaces", "crlf", "no-end", "blank", "commas", "end-comma", "end-cell"],
)
def test_harmless_oddities_are_tolerated(csv_file: Write, text: str) -> None:
    path = csv_file("")
    path.write_bytes(text.encode())
    table = read_table(path)
    assert table.faults == []
    assert {name: column.tolist() for name, column in table.numbers.items()} == {
        "a": [1, 3],
        "b": [2, 4],
    }


@pytest.mark.parametrize("cell", ["", " ", "nan", "NaN", "NA", "n/a", "null", "None"])
def test_cells_without_a_value_are_nan(csv_file: Write, cell: str) -> None:
    table = read_table(csv_file(f"a,b\n1,{cell}\n3,4\n"))
    assert table.faults == []
    np.testing.assert_array_equal(table.numbers["b"], [np.nan, 4])


def test_bad_cells_are_listed_by_column_with_row_and_line(csv_file: Write) -> None:
    rows = "".join(f"{k},oops{k},fine\n" for k in range(5))
    table = read_table(csv_file(f"a,b,c\n\n1,2,3\n4,5,1.2.3\n{rows}"))
    assert table.unreadable == {"b", "c"}
    assert table.faults == [
        "column `c` must hold numbers; got '1.2.3' in row 2 (line 4), 'fine' in row 3 (line 5),"
        " 'fine' in row 4 (line 6) and 3 more",
        "column `b` must hold numbers; got 'oops0' in row 3 (line 5), 'oops1' in row 4 (line 6),"
        " 'oops2' in row 5 (line 7) and 2 more",
    ]


def test_rows_of_another_length_are_named(csv_file: Write) -> None:
    table = read_table(csv_file("a,b\n1\n1,2\n1,2,3\n1\n1\n1\n"))
    assert table.faults[0] == "line 2 has 1 cells, the header has 2"
    assert table.faults[1] == "line 4 has 3 cells, the header has 2"
    assert len(table.faults) == 3
    assert table.numbers["b"].tolist() == [2]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "the file is empty"),
        ("\n\n", "the file is empty"),
        ("a;b\n1;2\n", "must be separated by commas; got semicolons"),
        ("a\tb\n1\t2\n", "must be separated by commas; got tabs"),
        ("a,b,a\n1,2,3\n", "column `a` stands 2 times in the header; keep one"),
    ],
)
def test_headers_that_cannot_be(csv_file: Write, text: str, says: str) -> None:
    assert says in " ".join(read_table(csv_file(text)).faults)


def test_only_the_columns_asked_for_are_read(csv_file: Write) -> None:
    path = csv_file("a,b,c,b\n1,x,y,z\n")
    table = read_table(path, ["a", "absent"], ["c"])
    assert table.faults == []
    assert list(table.numbers) == ["a"]
    assert table.texts == {"c": ("y",)}


def test_a_header_alone_has_no_rows(csv_file: Write) -> None:
    table = read_table(csv_file("a,tag\n"), texts=("tag",))
    assert table.numbers["a"].shape == (0,)
    assert table.texts == {}


def test_text_that_is_none_is_a_fault(csv_file: Write) -> None:
    path = csv_file("")
    path.write_bytes("a,b\n1,\xe9\n".encode("latin-1"))
    assert "must be UTF-8 text" in read_table(path).faults[0]
    path.write_text('a,b\n1,"' + "x" * 200000 + '"\n')
    assert "no comma-separated text: field larger" in read_table(path).faults[0]


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"absent\.csv: cannot be read: No such file"):
        read_table(tmp_path / "absent.csv")
