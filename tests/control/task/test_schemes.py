"""Schemes and resolvers: their formulas at both levels, damping, torque limits and what is refused."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.arm_at import arm_at
from tests.control.planner.test_soft_tasks import LIGHT
from tests.going import closed_loop, targets_along
from tests.kernel.session_ticks import Ticks, hessian

import ftqp
from ftqp.control.task import schemes
from ftqp.core.errors import InputError

DT = 2e-3
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
def test_arm_follows_a_circle_with_every_limit_kept_through_a_locked_joint(panda, home, scheme):
    planner = planner_of(panda, scheme)
    events = {200: lambda p: p.report(ftqp.Locked(2))}
    v, locked_at = np.zeros(7), None
    limits = panda.limits
    for k, step in enumerate(closed_loop(planner, lambda k: circle(home, k), 600, events=events)):
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


def test_free_swinging_joint_moves_by_its_torque_row_and_the_task_is_kept(panda, home):
    planner = planner_of(panda, "pseudoinverse")
    planner.reset(panda.neutral)
    planner.report(ftqp.FreeSwinging(2, damping=2.0))
    q, v = panda.neutral, np.zeros(7)
    for step in closed_loop(planner, ftqp.Target(pose=home), 50):
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
def test_all_joints_locked_stands_still_and_says_so(panda, home, scheme):
    planner = planner_of(panda, scheme)
    for joint in range(7):
        planner.report(ftqp.Locked(joint))
    home[0, 3] += 0.02
    for step in closed_loop(planner, ftqp.Target(pose=home), 3):
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


PANDA = ftqp.robots.load("panda")
WEAK = PANDA.with_limits(tau_max=[87.0, 15.0, 87.0, 87.0, 12.0, 12.0, 12.0])
LIMITS = [ftqp.TorqueLimits()]


def ends(**settings):
    """Torques of every tick of an arm that is to swing faster than its second joint can."""
    planner = ftqp.Planner(WEAK, emergency=None, **settings)

    def there(k):
        pose = WEAK.pose(WEAK.neutral)
        pose[0, 3] += 0.1 * np.sin(0.03 * k)
        return ftqp.Target(pose=pose)

    return np.array([step.tau.copy() for step in closed_loop(planner, there, 300)])


def test_the_entry_and_the_keyword_are_the_same_to_the_last_bit(level):
    listed, usual = ends(level=level, constraints=LIMITS), ends(level=level)
    np.testing.assert_array_equal(listed, usual)
    without = ends(level=level, torque_limits=False)
    assert np.abs(without[:, 1]).max() > 16.0 > 15.0 * (1.0 + 1e-6) > np.abs(listed[:, 1]).max()


@pytest.mark.parametrize(("robot", "settings", "sentence"), [
    (PANDA, {"torque_limits": False}, "TorqueLimits together with torque_limits=False, expected one of "
    "them; leave"),
    (LIGHT, {}, "TorqueLimits, which need masses, and .* has none"),
    (PANDA.with_limits(tau_max=np.inf), {}, "and panda has no torque limit; leave them out or give"),
    (PANDA, {"constraints": LIMITS * 2}, "two things are called 'torque limits'"),
])  # fmt: skip
def test_where_they_could_have_no_effect_is_one_sentence(robot, settings, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Planner(robot, **{"constraints": LIMITS, **settings})


Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
POSTURE = np.array([0.0, -0.3, 0.1, -1.8, 0.1, 1.4, 0.7])


def half(vector):
    """1/2 |vector|^2."""
    return 0.5 * vector @ vector


def kappa(s):
    """What a repetitive motion adds to a."""
    return 8.0 * s.v + 16.0 * (s.q - s.posture)


def impulse(s, u):
    """The torque of the step from s.v to u, times dt."""
    return s.M @ (u - s.v) + s.dt * s.h


ACCELERATION = {
    "mvn": lambda a, s: half(a + 4.0 * s.v),
    "man": lambda a, s: half(a),
    "mke": lambda a, s: 0.5 * (a + 4.0 * s.v) @ s.M @ (a + 4.0 * s.v),
    "mtn": lambda a, s: half(s.M @ a + s.h),
    "iiwt": lambda a, s: 0.5 * (s.M @ a + s.h) @ np.linalg.solve(s.M, s.M @ a + s.h),
    "rmp": lambda a, s: half(a + kappa(s)),
    "dlsm": lambda a, s: 0.995 * half(s.M @ a + s.h) + 0.005 * half(a + kappa(s)),
    "dlsm_mvn": lambda a, s: 0.995 * half(s.M @ a + s.h) + 0.005 * half(a + 4.0 * s.v),
}
"""The formulas of the recipes at the acceleration level, of a and of q, v, posture, M, h, dt in s."""
VELOCITY = {
    "mvn": lambda u, s: half(u),
    "man": lambda u, s: half(u - s.v),
    "mke": lambda u, s: 0.5 * u @ s.M @ u,
    "mtn": lambda u, s: half(impulse(s, u)),
    "iiwt": lambda u, s: 0.5 * impulse(s, u) @ np.linalg.solve(s.M, impulse(s, u)),
    "rmp": lambda u, s: half(u + 4.0 * (s.q - s.posture)),
    "dlsm": lambda u, s: 0.995 * half(impulse(s, u)) + 0.005 * half(u + 4.0 * (s.q - s.posture)),
    "dlsm_mvn": lambda u, s: 0.995 * half(impulse(s, u)) + 0.005 * half(u),
}
"""The formulas of the recipes at the velocity level, of the next velocity u and of s."""


def quadratic(formula, n):
    """Hessian and gradient at zero of a quadratic formula, (n, n) and (n,)."""
    E, zero = np.eye(n), formula(np.zeros(n))
    one = np.array([formula(e) for e in E])
    two = np.array([[formula(e + f) for f in E] for e in E])
    return two - one[:, None] - one + zero, 0.5 * (one - np.array([formula(-e) for e in E]))


@pytest.mark.parametrize(
    ("level", "name"),
    [("acceleration", name) for name in ACCELERATION] + [("velocity", name) for name in VELOCITY],
)
def test_kernel_minimises_the_formula_of_the_recipe(level, name):
    """H and g of a tick of a moving Panda are Hessian and gradient of the formula."""
    robot = ftqp.robots.load("panda")
    ticks = Ticks(robot, DT, level=level, scheme=name, posture=POSTURE, torque_limits=False)
    ticks.reset(Q, V)
    ticks.tick(Q, V, ftqp.Target(pose=robot.pose(Q)))
    arm = arm_at(robot, Q, V)
    s = SimpleNamespace(q=Q, v=V, posture=POSTURE, M=arm.M, h=arm.h, dt=DT, limits=robot.limits)
    formula = {"acceleration": ACCELERATION, "velocity": VELOCITY}[level][name]
    H, g = quadratic(lambda x: formula(x, s), 7)
    assert np.abs(hessian(ticks.K) - H).max() <= 1e-9 * np.abs(H).max()
    assert np.abs(ticks.K.qp.g[:7] - g).max() <= 1e-9 * max(1e-12, np.abs(g).max())


def test_every_recipe_is_known_by_name_and_convex_at_both_levels():
    assert set(ACCELERATION) == set(VELOCITY)
    recipes = {*ACCELERATION, "mvn_manipulability"}
    assert set(schemes.names()) == recipes | set(schemes.closed_forms())
    for name in recipes:
        scheme = schemes.by_name(name)
        assert scheme.name == name
        scheme.at("acceleration"), scheme.at("velocity")


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("mvm", r"'mvm' is not a scheme \(did you mean 'mvn'\?\); there are mvn, .*man, .*rmp, "),
        ("dlsm(alpha=2)", r"not a scheme \(did you mean 'dlsm'\?\); .*, and gains as a table, .*alpha"),
        ({"mu": 1.0}, "expected a name, {name = ..., ...} or an ftqp.Scheme"),
        (7, "scheme is 7, expected a name"),
        ({"name": "dlsm", "alpha": 1.0}, r"alpha is 1, expected a share in \[0, 1\); for torque alone use"),
        ({"name": "dlsm", "tau_ref": 0.0}, "tau_ref is 0, expected a finite number > 0 N m"),
        ({"name": "singularity_robust", "rule": "bond"}, r"damping rule is 'bond' \(did you mean"),
        ({"name": "singularity_robust", "rule": ["row"]}, "damping rule is"),
        ({"name": "singularity_robust", "limit": 0.0}, "limit is 0, expected a finite number > 0 rad/s"),
        ({"name": "singularity_robust", "limit": float("nan")}, "limit is nan, expected"),
    ],
)
def test_wrong_scheme_is_refused_with_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        schemes.by_name(given)


def test_manipulability_is_a_term_for_other_schemes():
    assert schemes.mvn_manipulability(0.2).at("velocity") == (schemes.mvn() + schemes.manipulability(0.2)).at(
        "velocity"
    )
    with pytest.raises(InputError, match="add a scheme that has one, such as mvn"):
        schemes.manipulability().at("velocity")


def test_manipulability_draws_the_arm_away_from_a_singularity(level):
    """An iiwa held in place, its second joint locked near zero, ends with a larger sigma_min."""
    robot, q0 = ftqp.robots.load("iiwa14"), np.array([0.2, 0.3, 0.1, -0.3, 0.2, 0.3, 0.0])
    found = {}
    for name, scheme in (("mvn", None), ("mvn_manipulability", schemes.mvn_manipulability(0.5))):
        planner = ftqp.Planner(robot, 5e-3, level=level, scheme=scheme, task=ftqp.Task(rows="position"))
        *_, step = closed_loop(planner, ftqp.Target(pose=robot.pose(q0)), 600, q0)
        J = arm_at(robot, step.q).J[:3]
        found[name] = 0.5 * np.linalg.slogdet(J @ J.T)[1]
        assert step.position_error < 1e-3
    assert found["mvn_manipulability"] > found["mvn"] + 0.02


IIWA = ftqp.robots.load("iiwa14")
START = np.array([0.0, 0.02, 0.0, -1.2, 0.0, 1.0, 0.0])


def swing(level, damping=None, scaled=False, seconds=9.0, calm=False):
    """Share of ticks in which a joint accelerates at its limit, last speed, and the follower if there is one.

    An iiwa with its second joint locked near zero, on a line with its attitude kept, which it cannot follow.
    """
    task = ftqp.Task(mode="scaled" if scaled else "slack", damping=damping, calm=calm, degrade=())
    planner = ftqp.Planner(IIWA, DT, level=level, task=task, emergency=None)
    planner.report(ftqp.Locked(1, mode="instant"))
    path = ftqp.paths.Line(IIWA.pose(START), (0.0, 0.25, 0.1), duration=4.0)
    follower, ticks, saturated = ftqp.PathFollower(planner, path) if scaled else None, round(seconds / DT), 0
    target = None if scaled else targets_along(path, ticks, DT).at
    for step in closed_loop(follower or planner, target, ticks, START):
        saturated += (np.abs(step.a) / IIWA.limits.a_max).max() > 0.99
    return saturated / ticks, np.abs(step.v).max(), step, follower


def test_greedy_motion_swings_and_damping_calms_it(level):
    greedy, _, undamped, _ = swing(level)
    damped, speed, step, _ = swing(level, ftqp.DirectionalDamping())
    assert greedy > 0.5
    assert damped < 0.01 and speed < 0.01
    assert step.position_error < undamped.position_error + 0.01


@pytest.mark.parametrize("calm", [True, False])
def test_path_that_waits_does_not_leave_the_line_and_comes_to_rest(level, calm):
    saturated, speed, step, follower = swing(level, scaled=True, calm=calm)
    assert saturated < 0.05 and speed < 1e-3
    assert step.position_error < 2e-3
    assert follower.status is ftqp.PathStatus.BLOCKED and "iiwa_joint_2 (locked)" in follower.blocked


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [({"threshold": 0.0}, "threshold of the damping"), ({"factor": -1.0}, "factor of the damping")],
)
def test_wrong_setting_is_one_sentence(settings, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.DirectionalDamping(**settings)
