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


TWIST, MORE = np.arange(6.0) + 1.0, np.arange(6.0) - 9.0


def moving():
    return Target(pose=T, twist=TWIST, acceleration=MORE)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: Target(), "a target needs exactly one of pose and position"),
        (lambda: Target(pose=T, position=T[:3, 3]), "a target needs exactly one of pose and position"),
        (lambda: Target(pose=np.eye(3)), r"pose has shape \(3, 3\), expected \(4, 4\)"),
        (lambda: Target(pose=2.0 * np.eye(4)), "pose has a rotation part that is not a rotation"),
        (lambda: Target(position=[0.0, 0.0]), r"position has shape \(2,\), expected \(3,\)"),
        (lambda: Target(pose=np.full((3, 3), np.nan)), r"pose has shape \(3, 3\), expected \(4, 4\)"),
        (lambda: Target(pose=T, twist=[0.0, 0.0, 0.0]), r"twist has shape \(3,\), expected \(6,\)"),
        (lambda: Target(pose=T, acceleration="none"), "acceleration is not an array of numbers: 'none'"),
        (lambda: Target(pose=T, stamp=1), "needs a stamp"),
        (lambda: Target(twist=np.zeros(6)), "needs a stamp"),
        (lambda: Target(twist=np.zeros(6), stamp=1.0).at(T), r"write target\.twist and target\.stamp"),
        (lambda: Target(position=[1.0, 2.0, 3.0]).at(T), r"position has shape \(4, 4\), expected \(3,\)"),
        (lambda: Targets(T[None]).at(-1), "there is no target -1; the trajectory has targets 0 to 0"),
        (lambda: Targets(T[None]).at(1), "there is no target 1; the trajectory has targets 0 to 0"),
    ],
)
def test_wrong_target_is_refused_with_one_sentence(call, sentence):
    with pytest.raises(InputError, match=sentence):
        call()


@pytest.mark.parametrize(
    ("write", "sentence"),
    [
        (lambda target: target.at(np.eye(3)), r"pose has shape \(3, 3\), expected \(4, 4\)"),
        (lambda target: target.at(np.eye(4), np.zeros(3)), r"twist has shape \(3,\), expected \(6,\)"),
        (lambda target: target.at(np.eye(4), None, np.zeros(7)), r"acceleration has shape \(7,\), expected"),
        (lambda target: target.at(None), r"pose has shape \(\), expected \(4, 4\)"),
        (lambda target: target.at("home"), "pose is not an array of numbers: 'home'"),
        (lambda target: target.at(np.eye(4), "fast"), "twist is not an array of numbers: 'fast'"),
        (lambda target: setattr(target, "pose", np.zeros((4, 3))), "pose "),
        (lambda target: setattr(target, "position", 0.0), "position "),
        (lambda target: setattr(target, "twist", np.zeros(5)), "twist "),
        (lambda target: setattr(target, "acceleration", "none"), "acceleration "),
    ],
)
def test_what_is_no_number_of_a_target_is_one_sentence_and_writes_nothing(write, sentence):
    target = moving()
    before = target.packed.copy()
    with pytest.raises(InputError, match=sentence):
        write(target)
    assert np.array_equal(target.packed, before)


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
def test_a_target_that_is_moved_is_what_a_new_one_would_be(as_given):
    there = transform(np.eye(3), np.array([0.25, -0.5, 2.0]))
    target = Target(pose=np.eye(4), twist=np.ones(6), acceleration=np.ones(6))
    assert target.at(as_given(there), as_given(TWIST), as_given(MORE)) is target
    assert np.array_equal(target.packed, Target(pose=there, twist=TWIST, acceleration=MORE).packed)
    assert np.array_equal(target.at(T).packed, Target(pose=T).packed), "what is not given is zero"
    moved = Target(position=[1.0, 2.0, 3.0]).at(np.array([4.0, 5.0, 6.0]), [0.1, 0.2, 0.3])
    assert np.array_equal(moved.packed, Target(position=[4.0, 5.0, 6.0], twist=[0.1, 0.2, 0.3]).packed)


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
