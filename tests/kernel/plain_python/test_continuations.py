"""Motions after a failure, and at a given self-motion speed: against inverse kinematics by hand."""

import numpy as np
import pytest
from studies import at, study_of, unit_arm

from ftqp.core.errors import InputError
from ftqp.kernel.continuation import bounded_runs, exact_runs
from ftqp.kernel.entry.continuation_study import ContinuationStudy
from ftqp.kernel.layout.survival import Survival
from ftqp.model import catalog

DT = 0.1
START = np.array([0.4, 0.9, -1.1])


def tip(q):
    """The tip of unit links."""
    p = np.exp(1j * np.cumsum(q, axis=-1)).sum(axis=-1)
    return np.stack([p.real, p.imag], axis=-1)


def path(start, way, samples=9):
    """Poses of a line from the tip at ``start``."""
    return np.array([at(*(tip(start) + s * np.array(way))) for s in np.linspace(0.0, 1.0, samples)])


def study(start, way, *, samples=9, joints=3, q_max=np.inf, v_max=np.inf, a_max=5.0, **settings):
    """Continuations of an arm of unit links along a line."""
    n = np.ones(joints)
    return ContinuationStudy(
        study_of(unit_arm(joints), (0, 1)), path(start, way, samples), DT,
        q_min=-n * q_max, q_max=n * q_max, v_max=n * v_max, a_max=n * a_max, **settings,
    )  # fmt: skip


def by_hand(start, goals, moves, held=lambda k: {}):
    """Newton steps of two joints from sample to sample, by numpy."""
    q, way = start.copy(), [start.copy()]
    for k, goal in enumerate(goals[1:], 1):
        for j, value in held(k).items():
            q[j] = value
        for _ in range(30):
            p = np.cumsum(np.exp(1j * np.cumsum(q))[::-1])[::-1]
            J = np.array([-p.imag, p.real])[:, moves]
            q[moves] += np.linalg.solve(J, goal - tip(q))
        way.append(q.copy())
    return np.array(way)


@pytest.mark.parametrize("locked", [0, 1, 2])
@pytest.mark.parametrize("brakes", [False, True])
def test_two_joints_that_are_left_go_on_as_inverse_kinematics_says(locked, brakes):
    way, others = (-0.1, 0.15), [i for i in range(3) if i != locked]
    continuations = study(START, way)
    v, T = (0.3, 0.3 / 5.0) if brakes else (0.0, 1.0)

    def held(k):
        s = min(DT * k, T)
        return {locked: START[locked] + v * s * (1.0 - 0.5 * s / T)}

    goals = tip(START) + np.linspace(0.0, 1.0, 9)[:, None] * np.array(way)
    expected = by_hand(START, goals, others, held)
    speed = v if brakes else None
    found = continuations.motion(START, 0, locked, speed=speed)
    np.testing.assert_allclose(found, expected, atol=1e-8)
    ends = continuations.runs([START], [0], [locked], speed=None if speed is None else [speed], threads=2)
    assert ends.status.tolist() == [Survival.SURVIVED] and ends.sample.tolist() == [8]
    assert ends.position[0] < 1e-8 and ends.margin[0] == np.inf and ends.hurry[0] == 0.0


def test_each_way_in_which_two_joints_fail_is_told_with_its_sample():
    way, locked = (-0.1, 0.15), 0
    goals = tip(START) + np.linspace(0.0, 1.0, 9)[:, None] * np.array(way)
    q = by_hand(START, goals, [1, 2])
    steps = np.abs(np.diff(q, axis=0))[:, 1:] / DT
    ends = study(START, way, v_max=0.999 * steps.max()).runs([START], [0], [locked])
    assert ends.status.tolist() == [Survival.VELOCITY]
    assert ends.sample[0] == 1 + steps.max(axis=1).argmax()
    assert ends.hurry[0] == pytest.approx(1.0 / 0.999, rel=1e-6)
    farthest = np.abs(q[1:, 1:]).max(axis=1)
    highest = farthest.max()
    ends = study(START, way, q_max=0.999 * highest).runs([START], [0], [locked])
    assert ends.status.tolist() == [Survival.LIMIT]
    assert ends.sample[0] == 1 + np.flatnonzero(farthest > 0.999 * highest)[0]
    assert study(START, way, v_max=1.001 * steps.max(), q_max=1.001 * highest).runs(
        [START], [0], [locked]
    ).status.tolist() == [Survival.SURVIVED]


def test_a_line_out_of_what_two_joints_reach_ends_at_the_singularity():
    elbow = np.exp(0.4j)
    outwards = complex(*tip(START)) - elbow
    way = outwards / abs(outwards) * (2.2 - abs(outwards))  # two links reach 2
    line = (way.real, way.imag)
    ends = study(START, line).runs([START], [0], [0])
    reach = np.linspace(abs(outwards), 2.2, 9)
    assert ends.status[0] == Survival.SINGULAR and reach[ends.sample[0]] > 2.0 - 0.1
    ends = study(START, line, v_max=0.5).runs([START], [0], [0])
    assert ends.status[0] == Survival.SINGULAR_VELOCITY and ends.sample[0] < 8
    stretched = np.array([0.4, 0.9, 0.0])
    ends = study(stretched, (0.1, 0.0)).runs([stretched], [0], [0])
    assert ends.status[0] == Survival.SINGULAR and ends.sample[0] == 0
    q = study(START, line).motion(START, 0, 0)
    assert np.isnan(q[-1]).all() and not np.isnan(q[1]).any()


def test_a_jump_of_the_path_that_newton_steps_do_not_follow_is_not_converged(monkeypatch):
    monkeypatch.setattr(exact_runs, "CORRECTIONS", 2)
    far, near = (
        study(START, way, samples=2).runs([START], [0], [0]) for way in ((-0.4, 0.5), (-0.004, 0.005))
    )
    assert far.status[0] == Survival.NOT_CONVERGED and far.position[0] > 1e-5 and far.sample[0] == 1
    assert near.status[0] == Survival.SURVIVED and near.position[0] < 1e-5


@pytest.mark.parametrize("share", [None, 0.4])
def test_joints_to_spare_keep_every_limit_on_the_way(share):
    """Each sample's increments are those of min |x|^2 + w |A x - e|^2 within their bounds."""
    start, way = np.array([0.4, 0.9, -1.1, 0.3]), (-0.05, 0.08)
    limits = {"q_max": 1.11, "v_max": 0.2}
    continuations = study(start, way, joints=4, samples=6, **limits)
    q = continuations.motion(start, 1, [1, -1], speed=[0.2, 0.0], bounded=True, share=share)
    assert q.shape == (5, 4) and not np.isnan(q).any()
    v_max = np.full(4, 0.2)
    v_max[1] *= 1.0 if share is None else share
    assert (np.abs(np.diff(q, axis=0)) <= DT * v_max + 1e-9).all() and np.abs(q).max() < 1.11 + 1e-12
    if share is None:
        assert q[-1, 1] == pytest.approx(start[1] + 0.5 * 0.2**2 / 5.0)
    goals = tip(start) + np.linspace(0.0, 1.0, 6)[:, None] * np.array(way)
    ends = continuations.runs([start], [1], [[1, -1]], speed=[[0.2, 0.0]], bounded=True, share=share)
    errors = np.linalg.norm(tip(q[1:]) - goals[2:], axis=1)
    assert ends.status[0] == Survival.SURVIVED and ends.position[0] == pytest.approx(errors.max())
    assert ends.hurry[0] == pytest.approx((np.abs(np.diff(q, axis=0)) / DT / v_max).max())


def test_a_bounded_motion_that_is_lost_is_followed_to_the_end_only_where_that_is_wanted():
    start, way = np.array([0.4, 0.9, -1.1, 0.3]), (-0.15, 0.25)
    continuations = study(start, way, joints=4, samples=6, v_max=0.1)
    runs = {
        whole: continuations.runs([start], [0], [2], bounded=True, whole=whole) for whole in (False, True)
    }
    assert [ends.status[0] for ends in runs.values()] == [Survival.ERROR] * 2
    assert runs[False].sample[0] == runs[True].sample[0] < 5
    assert runs[True].position[0] > runs[False].position[0] > 2e-3
    lost, kept = (continuations.motion(start, 0, 2, bounded=True, whole=whole) for whole in (False, True))
    assert np.isnan(lost[-1]).all() and not np.isnan(kept).any()
    kept_by_all = study(start, way, joints=4, samples=6).runs([start], [0], [-1], bounded=True)
    assert kept_by_all.status[0] == Survival.SURVIVED


def test_a_qp_that_takes_too_many_iterations_is_not_converged(monkeypatch):
    start = np.array([0.4, 0.9, -1.1, 0.3])
    continuations = study(start, (-0.15, 0.25), joints=4, samples=4, v_max=0.5)
    assert continuations.runs([start], [0], [2], bounded=True).status[0] == Survival.ERROR
    monkeypatch.setattr(bounded_runs, "ITERATIONS", 1)
    ends = continuations.runs([start], [0], [2], bounded=True)
    assert ends.status[0] == Survival.NOT_CONVERGED and ends.sample[0] == 3
    assert ends.position[0] == ends.rotation[0] == np.inf


@pytest.mark.parametrize("threads", [1, 2])
def test_self_motion_at_a_given_speed_goes_along_the_null_direction_and_stays_on_the_path(threads):
    """q += dt u n, det [n; A] > 0, then q += A^+ e until nothing is left of e."""
    goals = path(START, (-0.2, 0.1))
    continuations = study(START, (-0.2, 0.1))
    rng = np.random.default_rng(0)
    speeds = rng.normal(size=(2, 8))
    speeds[1, 3] = 0.0
    others = np.array([0.4 + 1e-12, 0.9, -1.1])
    q, last, errors = continuations.tracks([START, others], speeds, threads=threads)
    assert last.tolist() == [8, 8] and errors.max() < 1e-8
    for run, (begin, speed) in enumerate(zip((START, others), speeds, strict=True)):
        x = begin.copy()
        for k in range(8):

            def J(x):
                p = np.cumsum(np.exp(1j * np.cumsum(x))[::-1])[::-1]
                return np.array([-p.imag, p.real])

            n = np.linalg.svd(J(x))[2][2]
            x = x + DT * speed[k] * n * np.sign(np.linalg.det(np.vstack([n, J(x)])))
            for _ in range(20):
                x = x + np.linalg.pinv(J(x)) @ (goals[k + 1, :2, 3] - tip(x))
            np.testing.assert_allclose(q[run, k + 1], x, atol=1e-8)


def test_a_path_that_leaves_the_workspace_is_followed_to_its_edge():
    way = np.array([2.0, 0.0])
    q, last, _ = study(START, way).tracks([START], np.zeros((1, 8)))
    reached = np.linalg.norm(tip(START) + np.linspace(0.0, 1.0, 9)[:, None] * way, axis=1) < 3.0
    assert 0 < last[0] == reached.sum() - 1
    assert np.isnan(q[0, last[0] + 1 :]).all() and not np.isnan(q[0, : last[0] + 1]).any()
    four = np.array([0.4, 0.9, -1.1, 0.3])
    _, last, errors = study(four, (0.1, 0.1), joints=4).tracks([four], np.zeros((1, 8)))
    assert last[0] == 8 and errors[0] < 1e-8, "without self-motion any arm goes"


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        (lambda s: s.runs([START[:2]], [0], [0]), r"q has shape \(1, 2\)"),
        (lambda s: s.runs([START], [9], [0]), "samples are 9 to 9, expected 0 to 8"),
        (lambda s: s.runs([START], [0], [3]), "failed has joints -1 to 3, expected -1 to 2"),
        (lambda s: s.runs([START], [0], [[0, 1]]), "leave not as many as 2 rows"),
        (lambda s: s.runs([START], [0], [[-1, -1]]), "leave not as many as 2 rows"),
        (lambda s: s.tracks([START], np.zeros((1, 7))), r"speeds \(1, 7\), expected"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_sentence(asked, sentence):
    with pytest.raises(InputError, match=sentence):
        asked(study(START, (-0.2, 0.1)))


def test_a_joint_that_is_named_twice_is_one():
    ends = study(START, (-0.1, 0.15)).runs([START, START], [0, 0], [[1, 1], [1, -1]])
    assert ends.status.tolist() == [Survival.SURVIVED] * 2 and ends.position[0] == ends.position[1]


def test_rotation_is_told_apart_from_position():
    """Of an arm in space, whose pose has six rows: the error of rotation in radians."""
    robot = catalog.load("iiwa14")
    session = study_of(robot, range(6))
    start = robot.neutral + 0.2
    goal = robot.pose(start)
    turned = goal.copy()
    c, s = np.cos(0.3), np.sin(0.3)
    turned[:3, :3] = goal[:3, :3] @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    n = np.ones(7)
    continuations = ContinuationStudy(
        session, [goal, turned], DT, q_min=-4 * n, q_max=4 * n, v_max=0.1 * n, a_max=n,
    )  # fmt: skip
    ends = continuations.runs([start], [0], [0], bounded=True)
    assert ends.status[0] == Survival.ERROR and 0.25 < ends.rotation[0] < 0.31 and ends.position[0] < 0.05
