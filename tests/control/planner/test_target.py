"""A target is one packed buffer behind named views."""

import pickle
from copy import copy, deepcopy

import numpy as np
import pytest

from ftqp.control.planner.target import Target, Targets
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_x, transform
from ftqp.kernel.layout.enums import TARGET_HAS_ROTATION, TARGET_SIZE

T = transform(rotation_x(0.4), np.array([0.1, 0.2, 0.3]))


def test_pose_twist_and_acceleration_are_packed_as_the_kernel_reads_them():
    target = Target(pose=T, twist=np.arange(6), acceleration=np.arange(6) + 10)
    assert target.packed.shape == (TARGET_SIZE,)
    np.testing.assert_array_equal(target.packed[:16], T.ravel())
    np.testing.assert_array_equal(target.packed[16:22], np.arange(6))
    np.testing.assert_array_equal(target.packed[22:28], np.arange(6) + 10)
    assert target.packed[TARGET_HAS_ROTATION] == 1.0


def test_position_target_has_no_rotation_and_takes_a_linear_twist():
    target = Target(position=[1.0, 2.0, 3.0], twist=[4.0, 5.0, 6.0], acceleration=[7.0, 8.0, 9.0])
    assert target.packed[TARGET_HAS_ROTATION] == 0.0
    np.testing.assert_array_equal(target.position, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(target.twist, [4.0, 5.0, 6.0, 0.0, 0.0, 0.0])
    np.testing.assert_array_equal(target.acceleration, [7.0, 8.0, 9.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({}, "a target needs exactly one of pose and position"),
        ({"pose": T, "position": T[:3, 3]}, "a target needs exactly one of pose and position"),
        ({"pose": np.eye(3)}, r"pose has shape \(3, 3\), expected \(4, 4\)"),
        ({"pose": 2.0 * np.eye(4)}, "pose has a rotation part that is not a rotation"),
        ({"position": [0.0, 0.0]}, r"position has shape \(2,\), expected \(3,\)"),
        ({"pose": np.full((3, 3), np.nan)}, r"pose has shape \(3, 3\), expected \(4, 4\)"),
        ({"pose": T, "twist": [0.0, 0.0, 0.0]}, r"twist has shape \(3,\), expected \(6,\)"),
        ({"pose": T, "acceleration": "none"}, "acceleration is not an array of numbers: 'none'"),
    ],
)
def test_wrong_target_is_refused_with_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        Target(**given)


class TestMoved:
    """``target.at``: one target rewritten in a loop."""

    TWIST, MORE = np.arange(6.0) + 1.0, np.arange(6.0) - 9.0

    @pytest.mark.parametrize(
        "as_given",
        [
            lambda values: values,
            lambda values: values.tolist(),
            lambda values: values.astype(np.float32).astype(">f8"),
            lambda values: np.asfortranarray(values),
            lambda values: memoryview(values),
        ],
        ids=["array", "list", "other bytes", "other order", "buffer"],
    )
    def test_it_is_what_a_new_target_would_be(self, as_given):
        T = transform(np.eye(3), np.array([0.25, -0.5, 2.0]))
        target = Target(pose=np.eye(4), twist=np.ones(6), acceleration=np.ones(6))
        assert target.at(as_given(T), as_given(self.TWIST), as_given(self.MORE)) is target
        assert np.array_equal(target.packed, Target(pose=T, twist=self.TWIST, acceleration=self.MORE).packed)

    def test_what_is_not_given_is_zero(self):
        target = Target(pose=np.eye(4), twist=np.ones(6), acceleration=np.ones(6))
        assert np.array_equal(target.at(T).packed, Target(pose=T).packed)
        assert np.array_equal(target.at(T, acceleration=self.MORE).acceleration, self.MORE)
        assert not target.twist.any()

    def test_position_target_is_moved_by_positions(self):
        target = Target(position=[1.0, 2.0, 3.0])
        moved = target.at(np.array([4.0, 5.0, 6.0]), [0.1, 0.2, 0.3])
        again = Target(position=[4.0, 5.0, 6.0], twist=[0.1, 0.2, 0.3])
        assert np.array_equal(moved.packed, again.packed)
        with pytest.raises(InputError, match=r"position has shape \(4, 4\), expected \(3,\)"):
            target.at(T)

    @pytest.mark.parametrize(
        ("given", "sentence"),
        [
            ((np.eye(3),), r"pose has shape \(3, 3\), expected \(4, 4\)"),
            ((np.zeros(16),), r"pose has shape \(16,\), expected \(4, 4\)"),
            ((np.eye(4), np.zeros(3)), r"twist has shape \(3,\), expected \(6,\)"),
            ((np.eye(4), np.zeros((6, 1))), r"twist has shape \(6, 1\), expected \(6,\)"),
            ((np.eye(4), None, np.zeros(7)), r"acceleration has shape \(7,\), expected \(6,\)"),
            ((None,), r"pose has shape \(\), expected \(4, 4\)"),
            (("home",), "pose is not an array of numbers: 'home'"),
            ((np.eye(4), "fast"), "twist is not an array of numbers: 'fast'"),
        ],
    )
    def test_bad_input_is_one_sentence_and_writes_nothing(self, given, sentence):
        target = Target(pose=T, twist=self.TWIST, acceleration=self.MORE)
        before = target.packed.copy()
        with pytest.raises(InputError, match=sentence):
            target.at(*given)
        assert np.array_equal(target.packed, before)

    def test_twist_alone_has_no_pose_to_be_moved_to(self):
        with pytest.raises(InputError, match=r"write target\.twist and target\.stamp"):
            Target(twist=np.zeros(6), stamp=1.0).at(T)


class TestTrajectory:
    poses = np.repeat(T[None], 3, axis=0)

    @pytest.mark.parametrize("k", [-1, 3])
    def test_tick_outside_is_refused(self, k):
        with pytest.raises(InputError, match=f"there is no target {k}; the trajectory has targets 0 to 2"):
            Targets(self.poses).at(k)


@pytest.mark.parametrize("again", [copy, deepcopy, lambda target: pickle.loads(pickle.dumps(target))])
def test_copy_of_a_target_has_a_buffer_of_its_own(again):
    first = Target(pose=T)
    second = again(first)
    first.position[0] = 9.0
    assert second.position[0] == second.packed[3] == 0.1 and second.row == 0


def test_assigning_a_pose_writes_into_the_buffer():
    target = Target(pose=np.eye(4))
    target.pose = T
    np.testing.assert_array_equal(target.packed[:16], T.ravel())
    with pytest.raises(AttributeError, match="not 'packed'"):
        target.packed = np.zeros(29)


def test_twist_alone_needs_a_stamp_and_a_stamp_a_twist_alone():
    target = Target(twist=np.arange(6), stamp=3)
    np.testing.assert_array_equal(target.twist, np.arange(6))
    assert target.packed[TARGET_HAS_ROTATION] == -1.0 and target.stamp == 3.0
    for wrong in ({"twist": np.zeros(6)}, {"pose": T, "stamp": 1}, {"stamp": 1}):
        with pytest.raises(InputError, match="needs a stamp"):
            Target(**wrong)
    for wrong in ("now", None, [1.0, 2.0]):
        with pytest.raises(InputError):
            target.stamp = wrong
    with pytest.raises(AttributeError):
        Target(pose=T).stamp = 1.0


def test_twist_alone_need_not_be_finite_and_is_kept_with_its_stamp():
    target = Target(twist=np.full(6, np.nan), stamp=1)
    target.twist, target.stamp = np.arange(6), 2
    for kept in (pickle.loads(pickle.dumps(target)), copy(target), deepcopy(target)):
        assert kept.stamp == 2.0
        np.testing.assert_array_equal(kept.packed, target.packed)
    assert "stamp=2" in repr(target)


@pytest.mark.parametrize("name", ["pose", "position", "twist", "acceleration"])
@pytest.mark.parametrize("value", [0.0, np.zeros(5), np.zeros((4, 3)), "none"])
def test_wrong_shape_written_into_a_target_is_refused(home, name, value):
    target = Target(pose=home)
    before = target.packed.copy()
    with pytest.raises(InputError, match=f"{name} "):
        setattr(target, name, value)
    np.testing.assert_array_equal(target.packed, before)
