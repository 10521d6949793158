"""A recorded base motion is read strictly, each mistake one sentence."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ftqp.core.errors import InputError
from ftqp.sim.base.moving_world import FreeBase, Platform
from ftqp.sim.number_files import recorded_motion

PLATFORM, FREE = Platform().coordinates, FreeBase().coordinates


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / "motion.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_columns_are_coordinates_of_the_base(file):
    found = recorded_motion(file("t, tilt,track\n0,0.0,1\n\n2,0.4,3\n"), PLATFORM)
    assert set(found.coordinates) == {"tilt", "track"}
    values = found.sample(np.array([1.0]))
    assert values["tilt"][0] == pytest.approx(0.2) and values["track"][0] == pytest.approx(2.0)


def test_attitude_may_be_a_quaternion(file):
    turn = Rotation.from_rotvec([0.1, -0.2, 0.3])
    numbers = ",".join(map(str, turn.as_quat()))
    values = recorded_motion(file(f"t,x,qx,qy,qz,qw\n0,5,{numbers}\n"), FREE).sample(np.array([0.0]))
    np.testing.assert_allclose([values[name][0] for name in ("rx", "ry", "rz")], [0.1, -0.2, 0.3])
    assert values["x"][0] == 5.0


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "has 0 lines, expected a header and at least one sample"),
        ("t,tilt\n", "has 1 lines"),
        (
            "t,tillt\n0,1\n",
            r"'tillt' is not a column \(did you mean 'tilt'\?\); expected some of t, track",
        ),
        ("t,qx\n0,1\n", "'qx' is not a column"),
        ("tilt\n1\n", "column 't' is missing; it has tilt"),
        ("t\n1\n", "moves nothing, expected some of track, rotation, tilt"),
        ("t,tilt,tilt\n0,1,1\n", "column 'tilt' appears 2 times"),
        ("t,tilt\n0,1\n1\n", "columns changed from 2 to 1"),
        ("t,tilt\n0,much\n", "'much', expected a number"),
        ("t,tilt\n0,nan\n", "tilt of sample 1 is nan, expected a finite number"),
        ("t,tilt\n0,1\n0,2\n", r"t does not rise from sample 1 \(0 s\) to 2 \(0 s\)"),
    ],
)
def test_wrong_recording_is_one_clear_sentence(file, text, sentence):
    with pytest.raises(InputError, match=f"recording .*{sentence}"):
        recorded_motion(file(text), PLATFORM)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("t,qx,qy,qz\n0,0,0,0\n", "column 'qw' is missing"),
        ("t,rx,qx,qy,qz,qw\n0,0,0,0,0,1\n", "has rx, ry, rz and a quaternion"),
        ("t,qx,qy,qz,qw\n0,0,0,0,2\n", "the quaternion of sample 1 has the length 2, expected 1"),
        ("t,qx,qy,qz,qw\n0,0,0,1,0.01\n1,0,0,1,-0.01\n", "more than half a turn"),
    ],
)
def test_wrong_attitude_is_one_clear_sentence(file, text, sentence):
    with pytest.raises(InputError, match=sentence):
        recorded_motion(file(text), FREE)


def test_missing_file_and_no_text_are_clear_sentences(tmp_path):
    with pytest.raises(InputError, match=r"does not exist; expected a \.csv file"):
        recorded_motion(tmp_path / "none.csv", PLATFORM)
    (tmp_path / "raw.csv").write_bytes(b"\xff\xfe\x00t,x")
    with pytest.raises(InputError, match="is not text in UTF-8"):
        recorded_motion(tmp_path / "raw.csv", PLATFORM)
