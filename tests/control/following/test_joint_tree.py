"""Ways of the joints round what is in between."""

import numpy as np
import pytest

import ftqp
from ftqp.control.following.joint_tree import JointTree, passing
from ftqp.control.inverse_kinematics.passable import Passable

PANDA = ftqp.robots.load("panda")
LOW, HIGH = np.full(7, -2.0), np.full(7, 2.0)
BEGIN, GOAL = np.full(7, -0.5), np.full(7, 0.5)


class Around:
    """Stands for a planner with a scene: distances by a function of the joints."""

    clearance = ftqp.Clearance(keep=1.1e-3, stop=0.0)

    def __init__(self, apart):
        self.apart = apart

    def distances(self, q):
        return {("arm", "thing"): self.apart(q)}


def around(apart):
    return Passable(PANDA, np.full(7, np.inf), np.ones(7, bool), surrounded=Around(apart))


def passable_round(middle, radius):
    """No arm may be within so much of a place of the joints."""
    return around(lambda places: np.linalg.norm(places - middle, axis=1) - radius)


def answer(pieces):
    """What a piece-wise thought comes to, and in how many pieces."""
    count = 0
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            return end.value, count
        count += 1


def found(passable, moves=None, seed=0):
    tree = JointTree(
        passable, BEGIN, GOAL, moves=np.ones(7, bool) if moves is None else moves, low=LOW, high=HIGH,
        effort=1.0, seed=seed,
    )  # fmt: skip
    answer(tree.grow())
    return tree.way


@pytest.mark.parametrize("seed", range(4))
def test_way_goes_round_what_is_between_and_ends_at_the_goal(seed):
    passable = passable_round(np.zeros(7), 0.9)
    assert not answer(passing(passable, BEGIN, GOAL, 1.0))[0]
    way = found(passable, seed=seed)
    assert way is not None and np.array_equal(way[-1], GOAL) and len(way) >= 2
    for begin, end in zip([BEGIN, *way[:-1]], way, strict=True):
        share = np.linspace(0.0, 1.0, 200)[:, None]
        assert (np.linalg.norm(begin + share * (end - begin), axis=1) > 0.85).all()
    assert ((way >= LOW) & (way <= HIGH)).all()


def test_joints_that_failed_stand_still():
    begin_moves = np.array([True] * 6 + [False])
    passable = passable_round(np.append(np.zeros(6), -0.5), 0.9)
    tree = JointTree(
        passable, BEGIN, np.append(GOAL[:6], -0.5), moves=begin_moves, low=LOW, high=HIGH, effort=1.0
    )
    answer(tree.grow())
    assert tree.way is not None and (tree.way[:, 6] == -0.5).all()


def test_goal_that_is_walled_in_is_given_up():
    def clearance(places):
        away = np.abs(places - GOAL).max(axis=1)
        return np.where((away > 0.2) & (away < 1.0), -1.0, 1.0)

    assert found(around(clearance)) is None


def test_same_seed_gives_the_same_way():
    passable = passable_round(np.zeros(7), 0.9)
    assert np.array_equal(found(passable), found(passable))


def test_long_ways_are_looked_at_piece_by_piece_and_kept_points_count():
    above = ftqp.Keep("panda_hand_tcp", above=(0.0, 0.0, 0.3))
    passable = Passable(PANDA, np.full(7, np.inf), np.ones(7, bool), [above])
    down = PANDA.neutral + np.array([0.0, 1.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    good, pieces = answer(passing(passable, PANDA.neutral, PANDA.neutral + np.eye(7)[0] * 2.0, 1.0))
    assert good and pieces == 2
    assert not answer(passing(passable, PANDA.neutral, down, 1.0))[0]
    assert passable.clearance(PANDA.neutral[None])[0] == pytest.approx(PANDA.pose(PANDA.neutral)[2, 3] - 0.3)


def test_places_where_a_weak_motor_cannot_hold_the_arm_are_not_passable():
    stretched = np.array([0.0, 1.47, 0.0, -0.2, 0.0, 1.6, 0.8])
    every = np.ones(7, bool)
    strong = Passable(PANDA, PANDA.limits.tau_max, every)
    weak = Passable(PANDA, PANDA.limits.tau_max * 0.3, every)
    assert strong.at(stretched[None]).all() and not weak.at(stretched[None]).any()
    failed = Passable(PANDA, PANDA.limits.tau_max * 0.3, np.arange(7) != 1)
    assert failed.effort(stretched[None])[0] < weak.effort(stretched[None])[0]
