"""Which failures a motion survives, and where in the workspace a joint can be lost."""

import numpy as np
import pytest

import ftqp
from ftqp.analysis.planning.fault_plan import plan_of
from ftqp.analysis.survival.continuing import track
from ftqp.analysis.survival.coverage import coverage
from ftqp.analysis.survival.coverage_report import SENTENCES, NotSurvived, mission_survival
from ftqp.analysis.survival.survival_map import STEPS, survival_map
from ftqp.analysis.survival.task_path import task_path
from ftqp.analysis.tolerance import velocity_jump
from ftqp.core.errors import InputError
from ftqp.kernel.layout.enums import Survival
from ftqp.model import catalog

PANDA = catalog.load("panda")
Q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
PATH = ftqp.paths.Line(PANDA.pose(Q0), (0.0, 0.25, 0.0), duration=4.0)
TASK = task_path(PANDA, PATH, dt=0.05)
MOTION = track(TASK, Q0, 0.3)
REPORT = coverage(PANDA, TASK, MOTION)


def test_coverage_is_the_mean_of_what_each_joint_survives() -> None:
    assert REPORT.status.shape == (7, 20) and REPORT.names == PANDA.joints
    assert np.isclose(REPORT.coverage, np.mean(list(REPORT.per_joint.values())))
    assert sum(REPORT.counts.values()) == REPORT.status.size
    assert 0.5 < REPORT.coverage < 1.0 and REPORT.post == "exact"
    assert max(REPORT.worst_error) < 1e-8 and REPORT.least_margin > 0.0
    assert set(SENTENCES) == set(Survival)


def test_a_start_stands_for_the_motion_that_moves_the_joints_least() -> None:
    least = coverage(PANDA, TASK, track(TASK, Q0))
    assert (coverage(PANDA, TASK, Q0).status == least.status).all()
    alone = coverage(PANDA, PATH, Q0, dt=0.05)
    assert alone.task.digest == TASK.digest and (alone.status == least.status).all()
    with pytest.raises(InputError, match="expected a motion"):
        coverage(PANDA, PATH, np.zeros((1, 7)))


def test_first_safe_instant_is_where_the_last_lost_failure_ends() -> None:
    late = REPORT.t >= REPORT.first_safe
    assert REPORT.survived[:, late].all() and not REPORT.survived[:, ~late][:, -1].all()
    assert all(REPORT.survives(joint, REPORT.first_safe + 0.01) for joint in range(7))


def test_failure_between_two_instants_is_survived_where_it_is_at_both() -> None:
    joint, k = np.argwhere(REPORT.survived[:, :-1] & ~REPORT.survived[:, 1:])[0]
    assert REPORT.survives(int(joint), float(REPORT.t[k]))
    assert not REPORT.survives(int(joint), float(REPORT.t[k]) + 0.01)


def test_continuation_is_the_verified_one_and_a_lost_failure_says_what_remains() -> None:
    joint, k = np.argwhere(REPORT.survived)[25]
    motion = REPORT.continue_after(int(joint), float(REPORT.t[k]))
    assert len(motion) == TASK.N + 1 - REPORT.samples[k] and np.isfinite(motion).all()
    assert (motion[:, joint] == motion[0, joint]).all()
    joint, k = np.argwhere(~REPORT.survived)[0]
    with pytest.raises(NotSurvived, match="best effort to its end is off by") as lost:
        REPORT.continue_after(PANDA.joints[joint], float(REPORT.t[k]))
    assert lost.value.joint == PANDA.joints[joint] and lost.value.until < PATH.duration
    assert np.isfinite(lost.value.q).all() and lost.value.reason == REPORT.status[joint, k]
    assert np.allclose(lost.value.errors, [effort[joint, k] for effort in REPORT.best_effort()])


def test_plan_brings_its_own_path_and_belongs_to_its_robot() -> None:
    plan = plan_of(TASK, MOTION, coverage=0.0, stride=4, method="constant", settings={})
    assert (coverage(PANDA, None, plan).status == REPORT.status).all()
    with pytest.raises(InputError, match="another robot"):
        coverage(PANDA.with_limits(v_max=1.0), None, plan)
    with pytest.raises(InputError, match="another path"):
        coverage(PANDA, ftqp.paths.Line(PANDA.pose(Q0), (0.0, 0.2, 0.0), duration=4.0), plan)


def test_borderline_pairs_are_close_to_a_limit_or_lost_by_little() -> None:
    unclear, (position, rotation) = REPORT.borderline(), REPORT.best_effort()
    kept, lost = REPORT.survived & unclear, ~REPORT.survived & unclear
    assert ((REPORT.margin[kept] < 0.01) | (REPORT.hurry[kept] > 0.98)).all()
    nearly = (position[lost] <= 4e-3) & (rotation[lost] <= 4e-2)
    assert lost.any() and (nearly | (REPORT.status[lost] == Survival.VELOCITY)).all()
    clear = ~REPORT.survived & ~unclear
    assert clear.any() and ((position[clear] > 4e-3) | (rotation[clear] > 4e-2)).all()


def test_jumps_are_those_of_the_formula() -> None:
    joint, k = 2, 6
    v = np.gradient(MOTION, TASK.dt, axis=0)[REPORT.samples[k]]
    jump = velocity_jump(PANDA.jacobian(MOTION[REPORT.samples[k]]), v, joint)
    assert np.isclose(REPORT.jump[joint, k], np.linalg.norm(jump))
    median, high = REPORT.jump_quantiles()
    assert 0.0 < median <= high


def test_motion_outside_its_limits_is_lost_at_once() -> None:
    tight = PANDA.with_limits(q_max=np.where(np.arange(7) == 0, MOTION[40, 0], PANDA.limits.q_max))
    found = coverage(tight, PATH, MOTION)
    outside = MOTION[found.samples, 0] > MOTION[40, 0] + 1e-9
    assert outside.any() and ((found.status == Survival.NOMINAL) == outside).all()


def test_structural_joint_is_named_and_lost_always() -> None:
    arm = catalog.load("iiwa14")
    q0 = np.deg2rad([0.0, 30.0, 60.0, -90.0, 40.0, 60.0, 0.0])
    path = ftqp.paths.Line(arm.pose(q0), (0.05, 0.0, 0.0), duration=3.0)
    task = task_path(arm, path, dt=0.025)
    found = coverage(arm, task, track(task, q0))
    assert found.structural == (arm.joints[3],)
    assert (found.status[3] == Survival.STRUCTURAL).all()
    assert found.coverage == pytest.approx(6.0 / 7.0)


def test_relaxed_rows_braking_degraded_joints_and_pairs_have_reports_of_their_own() -> None:
    relaxed = coverage(PANDA, TASK, MOTION, rows="position")
    assert relaxed.post == "qp" and relaxed.coverage > REPORT.coverage
    braking = coverage(PANDA, TASK, MOTION, lock="ramp")
    assert abs(braking.coverage - REPORT.coverage) < 0.1 and braking.lock == "ramp"
    joint, k = np.argwhere(braking.survived)[30]
    moved = braking.continue_after(int(joint), float(braking.t[k]))
    assert 0.0 < abs(moved[-1, joint] - moved[0, joint]) < 0.1 and moved[-1, joint] == moved[-2, joint]
    weak = coverage(PANDA, TASK, MOTION, fault="degraded", velocity=0.5)
    assert weak.coverage == 1.0 and weak.structural == ()
    pairs = coverage(PANDA, TASK, MOTION, joints="pairs", rows="position", stride=8)
    assert len(pairs.names) == 21 and pairs.names[0] == "panda_joint1+panda_joint2"
    assert 0.0 < pairs.coverage <= relaxed.coverage
    assert not pairs.survives("panda_joint1+panda_joint2", 0.0) or pairs.per_joint[pairs.names[0]] > 0.0
    one = coverage(PANDA, TASK, MOTION, joints="panda_joint4")
    assert one.names == ("panda_joint4",) and (one.status[0] == REPORT.status[3]).all()


def test_no_posture_at_a_sample_survives_more_than_its_upper_bound() -> None:
    found = coverage(PANDA, TASK, MOTION, upper_bound=4)
    assert found.upper_bound is not None and len(found.upper_bound) == len(found.waypoints) == 4
    reached = coverage(PANDA, TASK, MOTION, stride=1).survived.sum(axis=0)[found.waypoints]
    assert (found.upper_bound >= reached).all() and found.upper_bound.max() <= 7


POSE, POSITION = (survival_map(PANDA, rows, places=40) for rows in ("pose", "position"))


def test_fewer_rows_survive_more_and_the_last_joint_never_matters_to_a_position() -> None:
    assert POSITION.per_joint["panda_joint7"] == 1.0
    assert all(POSITION.per_joint[joint] >= POSE.per_joint[joint] for joint in PANDA.joints)
    for found in (POSE, POSITION):
        assert found.any_joint <= min(found.per_joint.values())
        assert (found.survived <= found.lines[:, None]).all() and found.lines.max() <= 6


def test_structural_joint_is_survived_nowhere() -> None:
    arm = catalog.load("iiwa14")
    assert survival_map(arm, places=30).per_joint[arm.joints[3]] == 0.0


def test_planar_places_are_survived_where_the_closed_form_says_so() -> None:
    arm = catalog.load("planar", lengths=(1.0, 1.0, 1.0), continuous=True).with_limits(v_max=np.inf)
    found = survival_map(arm, places=60, way=0.3)
    same = []
    for place in range(60):
        q1, q2, q3 = found.q[place]
        p = found.places[place, :2]
        ends = p + 0.3 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        lines = p + np.linspace(0.0, 1.0, STEPS + 1)[:, None, None] * (ends - p)
        far = np.linalg.norm(lines, axis=2)
        possible = (far < 3.0).all(axis=0)
        A, B = 2.0 * abs(np.cos(q2 / 2.0)), 2.0 * abs(np.cos(q3 / 2.0))
        rest = np.linalg.norm(lines - [np.cos(q1), np.sin(q1)], axis=2)
        kept = np.array(
            [
                ((rest > 0.0) & (rest < 2.0)).all(axis=0),
                ((np.abs(A - 1.0) < far) & (far < A + 1.0)).all(axis=0),
                ((np.abs(1.0 - B) < far) & (far < 1.0 + B)).all(axis=0),
            ]
        )
        if found.lines[place] == possible.sum():
            same.append(found.survived[place] == (kept & possible).sum(axis=1))
    assert len(same) > 30 and np.mean(same) > 0.97


ARM = catalog.load("planar", lengths=(1.0, 1.0, 1.0))
T = np.arange(100) * 36.0
END = 3600.0


def test_nothing_survived_leaves_the_chance_of_no_failure() -> None:
    found = mission_survival(ARM, np.zeros((3, 100), dtype=bool), T, END, {"j1": 10.0, 1: 20.0})
    assert np.isclose(found.without, np.exp(-1.0 / 10.0 - 1.0 / 20.0))
    assert found.low == found.likely == found.high == found.without and found.coverage == 0.0


def test_everything_survived_fails_by_a_second_failure_only() -> None:
    hours = {0: 5.0, 1: 10.0, 2: 20.0}
    found = mission_survival(ARM, np.ones((3, 100), dtype=bool), T, END, hours)
    assert np.isclose(found.high, 1.0 - 0.0, atol=1e-2) and found.high <= 1.0 + 1e-12
    none, rates = [np.exp(-1.0 / h) for h in hours.values()], [1.0 / h for h in hours.values()]
    exactly_one = sum((1 - none[j]) * np.prod(none) / none[j] for j in range(3))
    assert np.isclose(found.low, np.prod(none) + exactly_one, rtol=1e-9)
    assert found.low < found.likely < found.high and found.coverage == pytest.approx(1.0)
    assert sum(rates) > 0.0


def test_interval_holds_what_random_failures_show() -> None:
    survived = np.zeros((3, 100), dtype=bool)
    survived[0, 50:], survived[1] = True, True
    hours = np.array([1.0, 2.0, 3.0])
    found = mission_survival(ARM, survived, T, END, dict(enumerate(hours)))
    at = np.random.default_rng(0).exponential(hours * 3600.0, size=(200_000, 3))
    first = at.argmin(axis=1)
    when = at.min(axis=1)
    kept = survived[first, np.minimum(when // 36.0, 99).astype(int)]
    second = (at < END).sum(axis=1) > 1
    alone, any_number = (when >= END) | (kept & ~second), (when >= END) | kept
    assert found.low <= alone.mean() + 0.005 and found.high >= any_number.mean() - 0.005
    assert found.high - found.low < 0.35 and found.low <= found.likely <= found.high
    assert found.coverage == pytest.approx((0.5 * 1.0 + 1.0 / 2.0) / (1.0 + 1.0 / 2.0 + 1.0 / 3.0), abs=0.01)
