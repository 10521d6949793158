"""A task on a time grid, and motions that continue it after a failure."""

import daqp
import numpy as np
import pytest

from ftqp.analysis.survival.continuing import continuation_study, task_session, track
from ftqp.analysis.survival.task_path import robot_digest, task_errors, task_path
from ftqp.control.paths import Line
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_exp, transform
from ftqp.kernel.layout.enums import Survival
from ftqp.model import catalog

PANDA = catalog.load("panda")
Q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
TASK = task_path(PANDA, Line(PANDA.pose(Q0), (0.0, 0.25, 0.0), duration=4.0), dt=0.05)
NODES = np.arange(0, TASK.N, 4)
PAIRS = tuple(a.ravel() for a in np.meshgrid(NODES, np.arange(7), indexing="ij"))


def jacobian(q):
    return PANDA.jacobian(q)


def errors(q, task=TASK, first=0):
    poses = np.stack([task.robot.pose(one) for one in q])
    return task_errors(task.rows, task.axis, task.goals[first : first + len(q)], poses)


def test_motion_stays_on_its_path_with_the_self_motion_speed_that_was_asked_for() -> None:
    theta = 0.4
    q = track(TASK, Q0, theta)
    assert np.abs(errors(q)).max() < 1e-10
    for k in (0, 20, 60):
        _, _, Vt = np.linalg.svd(jacobian(q[k]))
        n = Vt[-1] * np.sign(np.linalg.det(np.vstack([Vt[-1], jacobian(q[k])])))
        assert np.isclose((q[k + 1] - q[k]) @ n / TASK.dt, theta, atol=2e-2)
    least = track(TASK, Q0)
    step = (
        np.linalg.pinv(jacobian(least[30]))
        @ task_errors(TASK.rows, False, TASK.goals[31:32], PANDA.pose(least[30])[None]).ravel()
    )
    assert np.allclose(least[31] - least[30], step, atol=2e-4)


def test_continuation_keeps_the_joint_and_the_path() -> None:
    q, study = track(TASK, Q0, 0.3), continuation_study(TASK)
    found = study.runs(q[PAIRS[0]], *PAIRS)
    survived = np.flatnonzero(found.status == Survival.SURVIVED)
    assert 0.5 < len(survived) / len(found.status) < 1.0
    assert found.position[survived].max() < 1e-8 and found.rotation[survived].max() < 1e-8
    for pair in survived[::60]:
        k, j = PAIRS[0][pair], PAIRS[1][pair]
        motion = study.motion(q[k], k, j)
        assert len(motion) == TASK.N + 1 - k and (motion[:, j] == q[k, j]).all()
        assert np.abs(errors(motion, first=k)).max() < 1e-8
        assert np.isclose(
            np.minimum(motion - PANDA.limits.q_min, PANDA.limits.q_max - motion)[1:, np.arange(7) != j].min(),
            found.margin[pair],
        )
        assert np.isclose(
            (np.abs(np.diff(motion, axis=0)) / TASK.dt / PANDA.limits.v_max).max(), found.hurry[pair]
        )


def test_verdicts_do_not_depend_on_threads_or_company() -> None:
    q, study = track(TASK, Q0, 0.3), continuation_study(TASK)
    for bounded in (False, True):
        alone = study.runs(q[PAIRS[0]], *PAIRS, threads=1, bounded=bounded)
        shared = study.runs(q[PAIRS[0]], *PAIRS, threads=3, bounded=bounded)
        assert (alone.status == shared.status).all() and (alone.margin == shared.margin).all()
        one = study.runs(q[[PAIRS[0][50]]], PAIRS[0][[50]], PAIRS[1][[50]], bounded=bounded)
        assert one.status[0] == alone.status[50] and one.margin[0] == alone.margin[50]


def test_braking_joint_stops_with_its_deceleration_and_then_stands() -> None:
    q, study = track(TASK, Q0, 0.8), continuation_study(TASK)
    k, j, v = 20, 0, 0.6
    motion = study.motion(q[k], k, j, speed=v, bounded=True, whole=True)
    a = 0.25 * PANDA.limits.a_max[j]
    t = TASK.dt * np.arange(len(motion))
    stop = v / a
    expected = np.where(t < stop, v * t - 0.5 * a * t**2, 0.5 * v**2 / a)
    assert stop > TASK.dt and np.allclose(motion[:, j] - q[k, j], expected, atol=1e-12)


def plain_bounded_motion(q, first, j, task, rows):
    """The bounded continuation with another QP solver and pinocchio's kinematics, (N + 1 - first, nv)."""
    robot, w, caution = task.robot, 1e4, 0.5
    limits, scale = robot.limits, np.where(np.array(rows) > 2, robot.length, 1.0)
    motion = [q.copy()]
    for k in range(first, task.N):
        here = motion[-1]
        e = scale * task_errors(task.rows, False, task.goals[k + 1][None], robot.pose(here)[None])[0]
        A = scale[:, None] * robot.jacobian(here)[list(rows)]
        low = np.maximum(-limits.v_max * task.dt, caution * (limits.q_min - here))
        high = np.minimum(limits.v_max * task.dt, caution * (limits.q_max - here))
        low[j] = high[j] = 0.0
        H, f = np.eye(7) + w * A.T @ A, -w * A.T @ e
        sense = np.zeros(7, dtype=np.int32)
        sense[j] = 5
        x, _, flag, _ = daqp.solve(H, f, np.zeros((0, 7)), high, low, sense)
        assert flag > 0
        motion.append(here + x)
    return np.array(motion)


@pytest.mark.parametrize("rows", ["pose", "position"])
def test_bounded_continuation_is_that_of_another_qp_solver(rows: str) -> None:
    task = task_path(PANDA, TASK.goals, dt=TASK.dt, rows=rows)
    q, study = track(TASK, Q0), continuation_study(task)
    for k, j in ((0, 1), (24, 3), (40, 5)):
        mine = study.motion(q[k], k, j, bounded=True, whole=True)
        other = plain_bounded_motion(q[k], k, j, task, task.indices)
        assert np.abs(mine - other).max() < 1e-7, (k, j)


def test_bounded_continuation_stays_inside_limits_that_an_exact_one_leaves() -> None:
    tight = PANDA.with_limits(q_min=Q0 - 0.35, q_max=Q0 + 0.35)
    task = task_path(tight, TASK.goals, dt=TASK.dt)
    q, study = track(TASK, Q0), continuation_study(task)
    k = np.zeros(7, dtype=np.int64)
    exact = study.runs(q[k], k, np.arange(7))
    bounded = study.runs(q[k], k, np.arange(7), bounded=True, whole=True)
    assert (exact.status == Survival.LIMIT).any()
    assert (bounded.margin > -1e-9).all()


def test_axis_rows_have_the_jacobian_of_their_error() -> None:
    task = task_path(PANDA, TASK.goals, dt=TASK.dt, rows="position_axis")
    session = task_session(task)
    q, h = track(TASK, Q0)[0], 1e-6
    e, A, _, _ = session.values(q[None])
    assert np.abs(e).max() < 1e-9
    shifted = np.concatenate([q + h * np.eye(7), q - h * np.eye(7)])
    slopes, _, _, _ = session.values(shifted)
    assert np.allclose(-(slopes[:7] - slopes[7:]).T / (2.0 * h), A[0], atol=1e-7)
    tilted = q + 0.3
    e, _, _, _ = session.values(tilted[None])
    scale = np.array([1.0, 1.0, 1.0, PANDA.length, PANDA.length])
    assert np.allclose(
        e[0], scale * task_errors(task.rows, True, task.goals[:1], PANDA.pose(tilted)[None])[0]
    )


NEUTRAL = PANDA.neutral
LINE = Line(PANDA.pose(NEUTRAL), (0.0, 0.1, 0.0), duration=2.0)


def test_samples_are_those_of_the_path() -> None:
    task = task_path(PANDA, LINE, dt=0.05, q0=NEUTRAL)
    assert task.N == 40 and task.m == 6 and task.redundancy == 1
    assert np.allclose(task.goals, LINE.sample(task.t).pose)
    assert np.isclose(task.t[-1], LINE.duration)
    assert task_path(PANDA, LINE).N == 400


def test_coarser_grids_keep_both_ends_and_have_a_digest_of_their_own() -> None:
    task = task_path(PANDA, LINE, dt=0.05)
    for coarse in (task.every(4), task.coarse(10)):
        assert coarse.N == 10 and np.isclose(coarse.dt, 0.2)
        assert (coarse.goals[0] == task.goals[0]).all() and (coarse.goals[-1] == task.goals[-1]).all()
        assert coarse.digest != task.digest
    assert task.coarse(7).N >= 7
    with pytest.raises(InputError, match="stride is 3, expected a divisor of N = 40"):
        task.every(3)


def test_digest_tells_arms_tools_limits_rows_and_paths_apart() -> None:
    same = task_path(PANDA, LINE, dt=0.05).digest
    assert same == task_path(catalog.load("panda"), LINE.sample(np.arange(41) * 0.05).pose, dt=0.05).digest
    others = [
        task_path(PANDA, LINE, dt=0.05, rows="position"),
        task_path(PANDA, LINE, dt=0.05, rows="position_axis"),
        task_path(PANDA, LINE, dt=0.1),
        task_path(PANDA.with_tip(transform(np.eye(3), np.array([0.0, 0.0, 0.1]))), LINE, dt=0.05),
        task_path(PANDA.with_limits(q_max=PANDA.limits.q_max - 0.1), LINE, dt=0.05),
        task_path(PANDA, Line(PANDA.pose(NEUTRAL), (0.0, 0.11, 0.0), duration=2.0), dt=0.05),
    ]
    assert len({same, *(task.digest for task in others)}) == len(others) + 1
    assert robot_digest(PANDA) == robot_digest(catalog.load("panda")) != robot_digest(others[3].robot)


def test_points_keep_the_orientation_of_the_start() -> None:
    points = PANDA.pose(NEUTRAL)[:3, 3] + np.linspace(0.0, 0.1, 11)[:, None] * np.array([1.0, 0.0, 0.0])
    task = task_path(PANDA, points, dt=0.1, q0=NEUTRAL)
    assert np.allclose(task.goals[:, :3, :3], PANDA.pose(NEUTRAL)[:3, :3]) and np.allclose(
        task.goals[:, :3, 3], points
    )
    with pytest.raises(InputError, match="give poses"):
        task_path(PANDA, points, dt=0.1)


def test_axis_errors_ignore_the_turn_about_the_tool() -> None:
    goal = PANDA.pose(NEUTRAL)
    spun = goal @ transform(rotation_exp(np.array([0.0, 0.0, 0.7])), np.zeros(3))
    tilted = goal @ transform(rotation_exp(np.array([0.2, 0.0, 0.0])), np.zeros(3))
    task = task_path(PANDA, LINE, rows="position_axis")
    off = task_errors(task.rows, True, np.stack([goal, goal]), np.stack([spun, tilted]))
    assert np.allclose(off, [[0.0] * 5, [0.0, 0.0, 0.0, -0.2, 0.0]], atol=1e-12)
