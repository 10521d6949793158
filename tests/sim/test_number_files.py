"""Columns of numbers from files: tables, waypoints, motions of a base, torques; each mistake a sentence."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ftqp
from ftqp.core.errors import InputError
from ftqp.sim.base.moving_world import FreeBase, Platform
from ftqp.sim.number_files import TableFile, recorded_motion, waypoint_table
from ftqp.sim.torque_logs import torque_log_of_csv, write_torque_log

PLATFORM, FREE = Platform().coordinates, FreeBase().coordinates
JOINTS = ("a", "b")
WAYS = {
    "table": lambda file: checked(
        TableFile(file=file, what="table", sample="sample", valid=None, needed=("t",), together=("x", "y"))
    ),
    "waypoints": waypoint_table,
    "platform": lambda file: recorded_motion(file, PLATFORM),
    "free base": lambda file: recorded_motion(file, FREE),
    "torques": lambda file: torque_log_of_csv(file, JOINTS, 0.002),
}


def checked(given):
    table = given.csv_columns()
    given.check_values(table)
    return table


@pytest.fixture
def read(tmp_path):
    def read(way, content, name="file.csv"):
        if isinstance(content, dict):
            np.savez(tmp_path / name, **content)
        else:
            (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return WAYS[way](tmp_path / name)

    return read


def test_columns_come_by_name_in_any_order(read):
    found = read("table", "\ufefft, y, x\r\n0, 2, 1\r\n\r\n1, 3, 4\r\n")
    np.testing.assert_array_equal([found["t"], found["x"], found["y"]], [[0.0, 1.0], [1.0, 4.0], [2.0, 3.0]])


def test_waypoints_have_times_and_orientations_or_not(read):
    table = read("waypoints", "t, x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n\n1,4,5,6,1,0,0,0\n")
    np.testing.assert_array_equal(table.times, [0, 1])
    np.testing.assert_array_equal(table.positions, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(table.orientations, [[0, 0, 0, 1], [1, 0, 0, 0]])
    bare = read("waypoints", "z,x,y\n3,1,2\n")
    np.testing.assert_array_equal(bare.positions, [[1, 2, 3]])
    assert bare.times is None and bare.orientations is None


def test_waypoints_of_arrays_are_named_or_stacked(read):
    table = read("waypoints", {"x": [1.0, 2.0], "y": [0, 0], "z": [0, 1], "t": [0.5, 1.0]}, "w.npz")
    np.testing.assert_array_equal(table.positions, [[1, 0, 0], [2, 0, 1]])
    np.testing.assert_array_equal(table.times, [0.5, 1.0])
    stacked = {"positions": np.ones((2, 3)), "orientations": [[0, 0, 0, 1.0]] * 2, "times": [1, 2]}
    table = read("waypoints", stacked, "stacked.npz")
    assert table.positions.shape == (2, 3)
    np.testing.assert_array_equal(table.orientations, [[0, 0, 0, 1]] * 2)


def test_columns_of_a_motion_are_coordinates_of_the_base(read):
    found = read("platform", "t, tilt,track\n0,0.0,1\n\n2,0.4,3\n")
    assert set(found.coordinates) == {"tilt", "track"}
    values = found.sample(np.array([1.0]))
    assert values["tilt"][0] == pytest.approx(0.2) and values["track"][0] == pytest.approx(2.0)


def test_attitude_may_be_a_quaternion(read):
    numbers = ",".join(map(str, Rotation.from_rotvec([0.1, -0.2, 0.3]).as_quat()))
    values = read("free base", f"t,x,qx,qy,qz,qw\n0,5,{numbers}\n").sample(np.array([0.0]))
    np.testing.assert_allclose([values[name][0] for name in ("rx", "ry", "rz")], [0.1, -0.2, 0.3])
    assert values["x"][0] == 5.0


def test_torques_that_are_written_are_read_and_others_left_alone(read, tmp_path):
    t = np.arange(0.0, 1.0, 0.01)
    q = np.stack([np.sin(t), np.cos(t)], axis=1)
    log = ftqp.TorqueLog(t=t, q=q, tau=2.0 * q)
    write_torque_log(tmp_path / "log.csv", JOINTS, log)
    again = WAYS["torques"](tmp_path / "log.csv")
    np.testing.assert_allclose(again.q, q, atol=1e-8)
    np.testing.assert_allclose(again.tau, 2.0 * q, atol=1e-8)
    assert again.late == 0.002
    with pytest.raises(InputError, match="exists, and nothing is overwritten"):
        write_torque_log(tmp_path / "log.csv", JOINTS, log)
    rows = [f"{0.01 * k},{k},0,1,2,{'nan' if k == 5 else 3}" for k in range(20)]
    assert len(read("torques", "\n".join(["t,note,q.a,q.b,tau.a,tau.b", *rows])).t) == 19


@pytest.mark.parametrize(
    ("way", "content", "sentence"),
    [
        ("table", b"\xff\xfe\x00", "is not text in UTF-8"),
        ("table", "", "has 0 lines, expected a header and at least one sample"),
        ("table", "t,t\n0,1\n", "column 't' appears 2 times"),
        ("table", "x,y\n0,1\n", "column 't' is missing; it has x, y"),
        ("table", "t,x\n0,1\n", "column 'y' is missing; it has t, x"),
        ("table", "t,x,y\n0\n", "line 2 has 1 values, expected 3"),
        ("table", "t,x\n0,1\n1\n", "column 'y' is missing"),
        ("table", "t,z\n0,1\n1\n", "columns changed from 2 to 1"),
        ("table", "\nt,x,y\n\n0,1,2\n\n0,one,2\n", "line 6: x is 'one'"),
        ("table", "t\n0\n1\ninf\n", "t of sample 3 is inf, expected a finite number"),
        ("table", "t\n0\n2\n1\n", r"t does not rise from sample 2 \(2 s\) to 3 \(1 s\); sort the samples"),
        ("waypoints", "1,2,3\n4,5,6\n", "'1' is not a column; expected some of t, x, y, z"),
        ("waypoints", "x,y,z,qx\n1,2,3,4\n", "column 'qy' is missing"),
        ("platform", "t\n1\n", "moves nothing, expected some of track, rotation, tilt"),
        ("free base", "t,rx,qx,qy,qz,qw\n0,0,0,0,0,1\n", "has rx, ry, rz and a quaternion"),
        ("free base", "t,qx,qy,qz,qw\n0,0,0,0,2\n", "quaternion of sample 1 has the length 2, expected 1"),
        ("free base", "t,qx,qy,qz,qw\n0,0,0,1,0.01\n1,0,0,1,-0.01\n", "more than half a turn"),
        ("torques", "t,q.x,q.b,tau.a,tau.b\n0,0,0,0,0\n", "is of another arm: it has 'q.x', but no 'q.a'"),
        ("torques", "t,q.a,q.b,tau.a\n0,0,0,0\n", "column 'tau.b' is missing"),
    ],
)
def test_wrong_table_is_one_clear_sentence(read, way, content, sentence):
    with pytest.raises(InputError, match=sentence):
        read(way, content)
