"""The strict reader of CSV files of numbers."""

import numpy as np
import pytest

from ftqp.core.errors import InputError
from ftqp.sim.csv_table import csv_columns, refuse_large, refuse_repeated


def read(file, text):
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return csv_columns(file, "table", "sample", lambda names: refuse_repeated(file, "table", names))


def test_columns_come_by_name(tmp_path):
    found = read(tmp_path / "a.csv", "t, x\n0, 1\n\n1, nan\n")
    np.testing.assert_array_equal(found["t"], [0.0, 1.0])
    np.testing.assert_array_equal(found["x"], [1.0, np.nan])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (b"\xff\xfe\x00", "is not text in UTF-8"),
        ("t\n", "has 1 lines, expected a header and at least one sample"),
        ("t,t\n0,1\n", "column 't' appears 2 times"),
        ("t,x\n0\n", "line 2 has 1 values, expected 2"),
        ("t,x\n0,1\n0,one\n", "line 3, column 'x' is 'one', expected a number"),
    ],
)
def test_anything_else_is_refused_in_a_sentence(tmp_path, text, sentence):
    with pytest.raises(InputError, match=f"table .*a.csv.*{sentence}"):
        read(tmp_path / "a.csv", text)


def test_large_file_is_refused_unread(tmp_path):
    with (tmp_path / "a.csv").open("wb") as file:
        file.truncate(3_000_000)
    with pytest.raises(InputError, match="has 3 MB, expected at most 2 MB"):
        refuse_large(tmp_path / "a.csv", "table", 2_000_000)
