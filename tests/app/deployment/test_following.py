"""A library with a path follows it as Python's follower does, bit by bit, and keeps its limits when late."""

import ctypes

import numpy as np
import pytest
from tests.app.deployment.in_c import MISTAKES, PANDA, Library, fault_of, numbers

import ftqp
from ftqp.app.deployment.built_folder import BuildRequest, build_folder
from ftqp.app.deployment.headers import arm_file

DT = 1e-3
PATH = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), radius=0.1, duration=0.6)
"""Faster than the arm can: the path has to wait."""
BAD_SPEED = -35


def made(level="acceleration"):
    return ftqp.Planner(PANDA, DT, level=level, task=ftqp.Task(mode="scaled"))


def file_of(planner):
    return arm_file(planner.deployable(), 7, path=ftqp.PathFollower(planner, PATH, stall=None).memory)


class Follower(Library):
    """The functions of the shared library on one planner with a path."""

    def follow(self, q, ticks=1):
        return self.call("follow", numbers(q), None, ticks)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library with a path."""
    folder = tmp_path_factory.mktemp("following") / "built"
    wanted = {"planner": made(), "name": "panda", "target": "host", "cpu": None, "embed": False}
    build_folder(BuildRequest(**wanted, folder=folder, path=PATH))
    assert "#define FTQP_ARM_PATH_DURATION 0.6" in (folder / "arm.h").read_text()
    return folder


@pytest.mark.long
@pytest.mark.parametrize("fault", [ftqp.Locked(2), ftqp.FreeSwinging(4)], ids=["locked", "free"])
def test_a_path_is_followed_as_in_python_bit_by_bit(built, level, fault):
    planner = made(level)
    arm = Follower(built, file_of(planner))
    follower = ftqp.PathFollower(planner, PATH, stall=None)
    q, rng = PANDA.neutral.copy(), np.random.default_rng(1)
    follower.reset(q)
    assert arm.open() == arm.reset(q) == 0
    for k in range(1500):
        if k == 200:
            planner.speed = 0.4
            assert arm.call("speed", ctypes.c_double(0.4)) == 0
        if k == 400:
            planner.report(fault)
            kind = 1 if isinstance(fault, ftqp.Locked) else 2
            assert arm.call("report", fault_of(fault.joint, kind)) == 0
        if k == 900:
            planner.withdraw(fault.joint)
            assert arm.call("withdraw", fault.joint) == 0
        measured = q + rng.normal(0.0, 1e-6, 7)
        step = follower.step(measured, None)
        assert arm.follow(measured) == step.code
        arm.has_sent(step, k)
        assert arm.call("progress") == follower.progress
        q = step.q.copy()
    assert follower.progress > 0.1


@pytest.mark.long
def test_a_late_loop_on_a_path_keeps_its_limits_and_arrives(built):
    arm = Follower(built, file_of(made()))
    arm.open()
    arm.reset()
    q, v, rng = PANDA.neutral.copy(), np.zeros(7), np.random.default_rng(2)
    v_max, a_max = PANDA.limits.v_max, PANDA.limits.a_max
    ticks = 0
    while arm.call("progress") < PATH.duration:
        gap = int(rng.integers(2, 6)) if rng.random() < 0.1 else 1
        assert 0 <= arm.follow(q, gap) < 4
        sent = arm.sent("q")
        assert (np.abs(sent - q) <= gap * DT * v_max * (1.0 + 1e-9)).all()
        if gap == 1:
            assert (np.abs((sent - q) / DT - v) <= DT * a_max * (1.0 + 1e-6)).all()
        q, ticks = sent, ticks + gap
        v = arm.sent("v")
        assert ticks < 20_000
    assert arm.call("begin") == 0 and arm.call("progress") == 0.0


def test_a_path_that_is_not_there_is_said(panda_with, built):
    plain = Follower(built, arm_file(ftqp.Planner(PANDA).deployable(), 7))
    assert plain.follow(PANDA.neutral) == MISTAKES["NOT_OPEN"]
    plain.open()
    plain.reset()
    for answer in (
        plain.follow(PANDA.neutral),
        plain.call("begin"),
        plain.call("speed", ctypes.c_double(0.5)),
    ):
        assert answer == MISTAKES["UNSUPPORTED"]
    assert np.isnan(plain.call("progress"))
    for share in (0.0, -1.0, 1.1, np.nan):
        assert panda_with.call("speed", ctypes.c_double(share)) == BAD_SPEED
    assert panda_with.call("follow", None, None, 1) == MISTAKES["NULL"]
    assert panda_with.follow(PANDA.neutral, 0) == MISTAKES["BAD_TICKS"]


@pytest.fixture
def panda_with(built):
    arm = Follower(built, file_of(made()))
    arm.open()
    return arm


def test_a_planner_of_another_mode_has_no_path():
    with pytest.raises(ftqp.InputError, match="scaled"):
        file_of(ftqp.Planner(PANDA))
