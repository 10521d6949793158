import numpy as np
import pytest

from ftqp.core.errors import InputError
from ftqp.sim.number_files import waypoint_table


def csv_file(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "way.csv"
    path.write_text(text, encoding=encoding)
    return path


def test_csv_with_times_and_orientations(tmp_path):
    table = waypoint_table(csv_file(tmp_path, "t, x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n\n1,4,5,6,1,0,0,0\n"))
    np.testing.assert_array_equal(table.times, [0, 1])
    np.testing.assert_array_equal(table.positions, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(table.orientations, [[0, 0, 0, 1], [1, 0, 0, 0]])


def test_csv_columns_come_in_any_order_and_some_are_optional(tmp_path):
    table = waypoint_table(csv_file(tmp_path, "z,x,y\r\n3,1,2\r\n", encoding="utf-8-sig"))
    np.testing.assert_array_equal(table.positions, [[1, 2, 3]])
    assert table.times is None
    assert table.orientations is None


def test_npz_with_named_columns(tmp_path):
    np.savez(tmp_path / "w.npz", x=[1.0, 2.0], y=[0.0, 0.0], z=[0.0, 1.0], t=[0.5, 1.0])
    table = waypoint_table(tmp_path / "w.npz")
    np.testing.assert_array_equal(table.positions, [[1, 0, 0], [2, 0, 1]])
    np.testing.assert_array_equal(table.times, [0.5, 1.0])


def test_npz_with_stacked_arrays(tmp_path):
    np.savez(tmp_path / "w.npz", positions=np.ones((2, 3)), orientations=[[0, 0, 0, 1.0]] * 2, times=[1, 2])
    table = waypoint_table(tmp_path / "w.npz")
    assert table.positions.shape == (2, 3)
    np.testing.assert_array_equal(table.orientations, [[0, 0, 0, 1]] * 2)
    np.testing.assert_array_equal(table.times, [1, 2])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has 0 lines, expected a header and at least one waypoint"),
        ("x,y,z\n", "has 1 lines, expected a header"),
        ("1,2,3\n4,5,6\n", "'1' is not a column; expected some of t, x, y, z"),
        ("x,y,zz\n1,2,3\n", r"'zz' is not a column \(did you mean 'z'\?\)"),
        ("x,y\n1,2\n", "column 'z' is missing; it has x, y"),
        ("x,y,z,qx\n1,2,3,4\n", "column 'qy' is missing"),
        ("x,y,z,x\n1,2,3,4\n", "column 'x' appears 2 times"),
        ("x,y,z\n1,2\n", "line 2 has 2 values, expected 3"),
        ("x,y,z\n1,2,three\n", "'three', expected a number"),
        ("x,y,z\n1,2,nan\n", "z of waypoint 1 is nan, expected a finite number"),
        ("x,y,z\n1,2,inf\n", "z of waypoint 1 is inf"),
        ("t,x,y,z\n1,1,1,1\n0,1,1,1\n", r"t does not rise from waypoint 1 \(1 s\) to 2 \(0 s\); sort"),
        ("t,x,y,z\n1,1,1,1\n1,1,1,1\n", "t does not rise"),
    ],
)
def test_wrong_csv_is_one_clear_sentence(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        waypoint_table(csv_file(tmp_path, text))


@pytest.mark.parametrize("content", [b"\xff\xfe\x00\x01", b"x,y,z\n1,2,\x00\n", b"\x80abc"])
def test_csv_that_is_not_text_is_refused(tmp_path, content):
    (tmp_path / "w.csv").write_bytes(content)
    with pytest.raises(InputError, match=r"is not text|expected a number"):
        waypoint_table(tmp_path / "w.csv")


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"x": [1.0]}, "column 'y' is missing"),
        ({"x": [1.0], "y": [1.0, 2.0], "z": [1.0]}, "arrays have shapes"),
        ({"positions": np.ones((2, 2))}, r"positions has shape \(2, 2\), expected \(N, 3\)"),
        ({"positions": np.ones((0, 3))}, "has no waypoint"),
        ({"positions": np.ones((1, 3)), "speed": [1.0]}, "'speed' is not a column"),
        ({"positions": np.array([[1, None, 2]], dtype=object)}, "is not an NPZ file of numbers"),
        ({"positions": np.array([["a", "b", "c"]])}, "is not an NPZ file of numbers"),
    ],
)
def test_wrong_npz_is_one_clear_sentence(tmp_path, arrays, message):
    np.savez(tmp_path / "w.npz", **arrays)
    with pytest.raises(InputError, match=message):
        waypoint_table(tmp_path / "w.npz")


@pytest.mark.parametrize("content", [b"not a zip", b"", b"PK\x03\x04broken"])
def test_npz_that_is_none_is_refused(tmp_path, content):
    (tmp_path / "w.npz").write_bytes(content)
    with pytest.raises(InputError, match="is not an NPZ file of numbers"):
        waypoint_table(tmp_path / "w.npz")


def test_missing_file_folder_and_strange_ending_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"waypoint file .*none.csv does not exist"):
        waypoint_table(tmp_path / "none.csv")
    with pytest.raises(InputError, match="does not exist"):
        waypoint_table(tmp_path)
    (tmp_path / "w.txt").write_text("x,y,z\n1,2,3\n")
    with pytest.raises(InputError, match=r"ends in '.txt', expected .csv or .npz"):
        waypoint_table(tmp_path / "w.txt")
