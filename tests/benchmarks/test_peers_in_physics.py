"""What a peer is asked for and what is sent of its answer; peers themselves are not needed here."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from peers.independent_arm import IndependentArm
from peers.motion_case import turn, vector_of
from peers.servant import Charge, aimed

import ftqp

ROOT = Path(__file__).parents[2]
DT, N = 1e-3, 3
ASKS_TOO_MUCH = """
import numpy as np
import peers_in_physics
from peers.servant import serve

def make(charge):
    count = iter(range(1000))
    return lambda q, pose, twist, failed, v: None if next(count) == 20 else np.array([9.0, 9.0, -9.0])

serve(make, ("numpy",))
"""


def test_the_tip_is_asked_to_make_good_its_error_at_the_gain_and_to_move_as_its_target():
    robot = ftqp.robots.load("panda")
    T = robot.pose(robot.neutral)
    assert np.allclose(aimed(T, T, np.zeros(6), 60.0, DT), T, atol=1e-15)
    pose = T.copy()
    pose[0, 3] += 0.01
    aim = aimed(T, pose, np.array([0.0, 0.2, 0.0, 0.0, 0.0, 0.5]), 60.0, DT)
    assert np.allclose(aim[:3, 3] - T[:3, 3], [60.0 * 0.01 * DT, 0.2 * DT, 0.0], atol=1e-15)
    turned = aim[:3, :3] @ T[:3, :3].T
    assert np.isclose(turned[1, 0], 0.5 * DT, rtol=1e-6)


def test_what_a_peer_asks_for_is_sent_within_limits_and_a_lock_stands_at_once():
    limits = [[-1.0] * N, [0.05, 1.0, 1.0], [2.0] * N, [10.0] * N]
    charge = Charge(
        urdf="", tip="", joints=list("abc"), q=[0.0] * N, limits=limits, dt=DT, gain=60.0, length=0.2,
        fed_back=True, rods=[], box=[], keep=0.0,
    )  # fmt: skip
    program = subprocess.Popen(
        [sys.executable, "-P", "-c", ASKS_TOO_MUCH], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "benchmarks"), str(ROOT / "src")])},
    )  # fmt: skip
    assert program.stdin is not None and program.stdout is not None
    program.stdin.write(charge.line())
    program.stdin.flush()
    assert b"numpy" in program.stdout.readline()
    q, before, failed = np.zeros(N), np.zeros(N), np.zeros(N)
    unsolved = 0
    for k in range(300):
        failed[2] = float(k >= 100)
        program.stdin.write(np.concatenate([q, np.eye(4).ravel(), np.zeros(6), failed]).tobytes())
        program.stdin.flush()
        answer = np.frombuffer(program.stdout.read(8 * (2 * N + 1)))
        q, v = answer[:N].copy(), answer[N : 2 * N]
        unsolved += int(answer[-1])
        stands = np.array([q[0] < 0.05 - 1e-12, True, k < 100])  # an end or a lock stops at once
        assert (np.abs(v - before)[stands] <= 10.0 * DT + 1e-9).all()
        assert k < 100 or v[2] == 0.0
        before = v
    program.stdin.close()
    program.stdout.close()
    assert program.wait() == 0 and unsolved == 1 and q[0] <= 0.05


@pytest.mark.parametrize("name", ["panda", "iiwa14", "xarm7"])
def test_poses_and_jacobians_are_those_of_the_robot(name: str) -> None:
    robot = ftqp.robots.load(name)
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (5, robot.nv))
    R, p, J = IndependentArm(robot).poses(q)
    for k, row in enumerate(q):
        T = robot.pose(row)
        assert np.abs(R[k] - T[:3, :3]).max() < 1e-12 and np.abs(p[k] - T[:3, 3]).max() < 1e-12
        assert np.abs(J[k] - robot.jacobian(row)).max() < 1e-12


def test_restarts_find_a_posture_with_the_locked_joint_in_its_place() -> None:
    robot = ftqp.robots.load("panda")
    here, there = robot.neutral, robot.neutral + np.array([0.5, 0.3, 0.0, 0.4, 0.2, 0.3, 0.1])
    arm, goal = IndependentArm(robot), robot.pose(there)
    found = arm.restarts(goal, here, [2], count=500)
    assert found is not None and found[2] == here[2]
    assert np.abs(arm.errors(found[None], goal)[0]).max() < 1e-5
    goal[:3, 3] += 3.0
    assert arm.restarts(goal, here, [2], count=250) is None


def test_rotation_vectors_come_back() -> None:
    for w in np.random.default_rng(1).normal(size=(20, 3)):
        w *= min(1.0, 3.0 / np.linalg.norm(w))
        assert np.abs(vector_of(turn(w)) - w).max() < 1e-9
