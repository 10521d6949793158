"""The strict reader of files of numbers; what it refuses is in the tests of those who read by it, too."""

import numpy as np
import pytest

from ftqp.core.errors import InputError
from ftqp.sim.number_files import TableFile


def given(file, text):
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return TableFile(
        file=file, what="table", sample="sample", valid=("t", "x", "y"), needed=("t",), together=("x", "y")
    )


def test_columns_come_by_name(tmp_path):
    found = given(tmp_path / "a.csv", "t, y, x\n0, 2, 1\n\n1, 3, nan\n").csv_columns()
    np.testing.assert_array_equal(found["t"], [0.0, 1.0])
    np.testing.assert_array_equal(found["x"], [1.0, np.nan])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (b"\xff\xfe\x00", "is not text in UTF-8"),
        ("t\n", "has 1 lines, expected a header and at least one sample"),
        ("t,t\n0,1\n", "column 't' appears 2 times"),
        ("t,x\n0,1\n", "column 'y' is missing; it has t, x"),
        ("t,tt\n0,1\n", "'tt' is not a column .*; expected some of t, x, y"),
        ("t,x,y\n0\n", "line 2 has 1 values, expected 3"),
        ("t,x,y\n0,1,2\n0,one,2\n", "line 3: x is 'one'"),
        ("\nt,x,y\n\n0,1,2\n\n0,one,2\n", "line 6: x is 'one'"),
        ("t\n0\n1\ninf\n", "t of sample 3 is inf, expected a finite number"),
        ("t\n0\n2\n1\n", r"t does not rise from sample 2 \(2 s\) to 3 \(1 s\); sort the samples by time"),
    ],
)
def test_anything_else_is_refused_in_a_sentence(tmp_path, text, sentence):
    table = given(tmp_path / "a.csv", text)
    with pytest.raises(InputError, match=f"table .*a.csv.*{sentence}"):
        table.check_values(table.csv_columns())
