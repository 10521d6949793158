"""Closed forms in the planner: same bounds, faults, statuses; wrong parameters are refused."""

import numpy as np
import pytest
from tests.arm_at import arm_at

import ftqp
from ftqp.control.task import schemes
from ftqp.core.errors import InputError

DT = 0.002
SCHEMES = {
    "pseudoinverse": "pseudoinverse",
    "weighted_pseudoinverse": {
        "name": "weighted_pseudoinverse",
        "weights": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0],
    },
    "bound": {"name": "singularity_robust", "rule": "bound"},
    "row": "singularity_robust",
    "exact_inf": {"name": "singularity_robust", "rule": "exact_inf", "limit": 0.5},
}


def planner_of(robot, scheme, dt=DT, **options):
    options.setdefault("emergency", None)
    return ftqp.Planner(robot, dt, level="velocity", scheme=scheme, **options)


def circle(home, k, radius=0.05, period=2.0):
    """A target on a circle in the plane y, z, started at rest."""
    phase = 2.0 * np.pi * (k * DT / period) ** 2 / 2.0
    pose = home.copy()
    pose[:3, 3] += radius * np.array([0.0, np.sin(phase), 1.0 - np.cos(phase)])
    return ftqp.Target(pose=pose)


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=list(SCHEMES))
def test_arm_follows_a_circle_with_every_limit_kept_through_a_locked_joint(panda, home, follow, scheme):
    planner = planner_of(panda, scheme)
    events = {200: lambda p: p.report(ftqp.Locked(2))}
    v, locked_at = np.zeros(7), None
    limits = panda.limits
    for k, step in enumerate(follow(planner, lambda k: circle(home, k), 600, events=events)):
        assert np.all(np.abs(step.v) <= limits.v_max + 1e-9)
        assert np.all(np.abs(step.v - v) <= limits.a_max * DT * (1.0 + 1e-9))
        assert step.position_error < 0.01
        v = step.v.copy()
        if k >= 200 and v[2] == 0.0:
            locked_at = step.q[2] if locked_at is None else locked_at
            assert step.q[2] == locked_at
    assert locked_at is not None
    assert step.status is ftqp.StepStatus.OK


def test_closed_forms_are_the_least_norm_scheme_or_its_weighted_kin_where_nothing_binds(panda, home):
    twist = np.array([0.02, -0.01, 0.03, 0.05, 0.0, -0.04])
    target = ftqp.Target(pose=home, twist=0.1 * twist)
    found = []
    relative = (panda.limits.v_max.max() / panda.limits.v_max) ** 2
    weighted = {"name": "weighted_pseudoinverse", "weights": relative.tolist()}
    for scheme in ("mvn", "pseudoinverse", weighted, "singularity_robust"):
        planner = planner_of(panda, scheme)
        planner.reset(panda.neutral)
        found.append(planner.step(panda.neutral, np.zeros(7), target).v.copy())
    assert found[1] == pytest.approx(found[0], abs=2e-6) and found[1].any()
    assert found[3] == pytest.approx(found[2], abs=1e-14)


def test_outside_its_interval_the_nearest_allowed_command_is_given_and_reported(panda, home):
    planner = planner_of(panda, "pseudoinverse", torque_limits=False)
    planner.reset(panda.neutral)
    step = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home, twist=np.full(6, 1.0)))
    J = arm_at(panda, panda.neutral).J
    wanted = ftqp.resolve_rates(J, np.full(6, 1.0), characteristic_length=panda.length)
    assert step.v == pytest.approx(np.clip(wanted, step.lower, step.upper), abs=1e-9)
    assert np.abs(wanted - step.v).max() > 0.1
    assert step.status is ftqp.StepStatus.RELAXED
    assert any("acceleration" in limit for limit in step.limits_active)
    assert step.certificate is not None and step.certificate.obstacles
    assert np.abs(step.slack).max() > 0.1
    assert step.qp.status is not None and step.qp.iterations > 0


def test_torque_rows_hold_when_the_closed_form_breaks_them(panda, home):
    weak = panda.with_limits(tau_max=panda.limits.tau_max * [1.0, 0.42, 1.0, 0.9, 1.0, 1.0, 1.0], a_max=1e3)
    planner = planner_of(weak, "pseudoinverse")
    planner.reset(panda.neutral)
    step = planner.step(
        panda.neutral, np.zeros(7), ftqp.Target(pose=home, twist=np.array([0, 0, 0.5, 0, 0, 0]))
    )
    assert step.status is ftqp.StepStatus.RELAXED
    assert np.all(np.abs(step.tau) <= weak.limits.tau_max * (1.0 + 1e-6))
    assert any("torque" in limit for limit in step.limits_active)


def test_free_swinging_joint_moves_by_its_torque_row_and_the_task_is_kept(panda, home, follow):
    planner = planner_of(panda, "pseudoinverse")
    planner.reset(panda.neutral)
    planner.report(ftqp.FreeSwinging(2, damping=2.0))
    q, v = panda.neutral, np.zeros(7)
    for step in follow(planner, ftqp.Target(pose=home), 50):
        assert step.status is ftqp.StepStatus.OK
        assert np.abs(step.slack).max() < 1e-9
        arm = arm_at(panda, q, v)
        row = arm.M[2] @ (step.v - v) + DT * (arm.h[2] + 2.0 * step.v[2])
        assert row == pytest.approx(0.0, abs=1e-10)
        q, v = step.q.copy(), step.v.copy()
    assert abs(step.v[2]) > 1e-4 and step.tau[2] == 0.0


def test_a_degraded_joint_is_damped_by_what_is_left_of_its_limit(panda, home):
    robot = panda.with_limits(a_max=1e6)  # so that the damping alone shapes the command
    planner = planner_of(robot, {"name": "singularity_robust", "rule": "exact_inf"}, torque_limits=False)
    twist = 5.0 * np.array([0.4, 0.3, 0.2, 0.1, 0.2, 0.3])
    for joint in range(7):
        planner.report(ftqp.Degraded(joint, velocity=0.1 * (joint + 1)))
    planner.reset(panda.neutral)
    step = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home, twist=twist))
    left = panda.limits.v_max * 0.1 * np.arange(1, 8)
    assert step.kappa > 0.0
    assert np.max(np.abs(step.v) / left) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=list(SCHEMES))
def test_all_joints_locked_stands_still_and_says_so(panda, home, follow, scheme):
    planner = planner_of(panda, scheme)
    for joint in range(7):
        planner.report(ftqp.Locked(joint))
    home[0, 3] += 0.02
    for step in follow(planner, ftqp.Target(pose=home), 3):
        assert step.status is ftqp.StepStatus.RELAXED
        assert not step.v.any() and np.array_equal(step.q, panda.neutral)
        assert step.sigma_min == 0.0 and step.condition == np.inf


@pytest.mark.parametrize("scheme", [*SCHEMES.values(), "approximate_pseudoinverse"])
def test_bad_inputs_and_stops_are_handled_as_with_a_qp(scheme):
    robot = ftqp.robots.load("xarm7" if scheme == "approximate_pseudoinverse" else "panda")
    if scheme == "approximate_pseudoinverse":
        robot = ftqp.robots.load("puma560")
    n = robot.nv
    planner = planner_of(robot, scheme, emergency=ftqp.EmergencyStop(position=0.01, samples=1))
    planner.reset(robot.neutral)
    pose = robot.pose(robot.neutral)
    bad = ftqp.Target(pose=pose)
    bad.twist[0] = np.nan
    assert planner.step(robot.neutral, np.zeros(n), bad).status is ftqp.StepStatus.INVALID_INPUT
    pose[0, 3] += 0.1
    q, v = robot.neutral, np.zeros(n)
    for k in range(300):
        pose[0, 3] += 0.01 * min(k, 3)
        step = planner.step(q, v, ftqp.Target(pose=pose))
        q, v = step.q.copy(), step.v.copy()
    assert step.status is ftqp.StepStatus.STOPPED


def test_approximate_pseudoinverse_keeps_the_position_when_the_wrist_is_singular():
    robot = ftqp.robots.load("puma560").with_limits(a_max=1e9)
    q = np.deg2rad([0.0, 45.0, -180.0, 0.0, 0.0, 0.0])
    planner = planner_of(robot, "approximate_pseudoinverse", task=ftqp.Task(kp=0.0))
    planner.reset(q)
    twist = np.array([0.01, 0.02, -0.01, 0.1, 0.1, 0.1])
    step = planner.step(q, np.zeros(6), ftqp.Target(pose=robot.pose(q), twist=twist))
    pose = robot.pose(q)
    omega = twist[3:] + step.slack[3:]
    centre = twist[:3] + step.slack[:3] - np.cross(omega, 0.1 * pose[:3, 2])
    assert centre == pytest.approx(twist[:3] - np.cross(twist[3:], 0.1 * pose[:3, 2]), abs=1e-12)
    assert np.linalg.norm(step.slack[3:]) > 1e-2 and step.status is ftqp.StepStatus.RELAXED


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"name": "singularity_robust", "rule": "bond"}, r"damping rule is 'bond' \(did you mean"),
        ({"name": "singularity_robust", "rule": ["row"]}, "damping rule is"),
        ({"name": "singularity_robust", "limit": 0.0}, "limit is 0, expected a finite number > 0 rad/s"),
        ({"name": "singularity_robust", "limit": -1.0}, "limit is -1, expected"),
        ({"name": "singularity_robust", "limit": float("nan")}, "limit is nan, expected"),
        ({"name": "singularity_robust", "kappa": 1.0}, "'kappa' is not a parameter of scheme"),
        ({"name": "weighted_pseudoinverse"}, "needs weights, one positive number a joint"),
        ({"name": "weighted_pseudoinverse", "weights": [1.0, 0.0]}, "weight 1 is 0, expected a finite"),
        ({"name": "weighted_pseudoinverse", "weights": 3.0}, "weights are 3.0, expected one positive"),
        ({"name": "weighted_pseudoinverse", "weights": ["a"]}, "weight 0 is 'a', expected a number"),
        ({"name": "approximate_pseudoinverse", "threshold": 0.0}, "threshold is 0, expected a finite"),
        ({"name": "pseudoinverse", "limit": 1.0}, "'limit' is not a parameter of scheme 'pseudoinverse'"),
        ("pseudo_inverse", r"is not a scheme \(did you mean 'pseudoinverse'\?\)"),
    ],
)
def test_wrong_parameters_are_refused_with_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        schemes.by_name(given)


@pytest.mark.parametrize(
    ("scheme", "options", "sentence"),
    [
        ("pseudoinverse", {"level": "acceleration"}, "a closed form gives rates; make the planner with"),
        ("pseudoinverse", {"backend": "daqp"}, "a closed form solves no QP and has no backend; leave"),
        ("pseudoinverse", {"task": ftqp.Task(mode="scaled")}, "scheme 'pseudoinverse' does not go with"),
        ({"name": "weighted_pseudoinverse", "weights": [1.0]}, {}, "has 1 weights, expected one a joint: 7"),
        ("approximate_pseudoinverse", {}, "needs a spherical wrist"),
        ("approximate_pseudoinverse", {"task": ftqp.Task(rows="position")}, "follows whole poses"),
    ],
)
def test_planner_refuses_what_does_not_go_with_a_closed_form(panda, scheme, options, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Planner(panda, DT, **{"level": "velocity", "scheme": scheme, **options})
