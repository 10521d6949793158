"""Ticks by closed forms, with joints that failed and limits that are met: against numpy."""

import numpy as np
import pytest
from scipy.optimize import minimize

import ftqp
from ftqp import StepStatus

DT = 0.01
TASK = ftqp.Task(rows=("x", "y"))


def ridden(robot, faults, scheme="pseudoinverse", *, speed=0.02, ticks=4, task=TASK, spoilt=(), start=None):
    """q and v before the last tick of a ride with faults from the third one on, and its step."""
    planner = ftqp.Planner(robot, DT, level="velocity", scheme=scheme, task=task, emergency=None)
    q, v = np.array(robot.neutral if start is None else start), np.zeros(robot.nv)
    planner.reset(q)
    target = ftqp.Target(pose=robot.pose(q), twist=[0.0, speed, 0.0, 0.0, 0.0, 0.0])
    for k in range(ticks):
        if k == 2:
            for fault in faults:
                planner.report(fault)
        target.position[1] += DT * speed
        before = q, v
        step = planner.step(q * (np.nan if k in spoilt else 1.0), v, target)
        q, v = step.q.copy(), step.v.copy()
    return *before, step


def torques(robot, q, v, step):
    """M (v+ - v)/dt + h."""
    return robot.mass_matrix(q) @ (step.v - v) / DT + robot.bias(q, v)


@pytest.mark.parametrize(
    "faults",
    [
        [ftqp.FreeSwinging(1, damping=0.5)],
        [ftqp.FreeSwinging(4)],
        [ftqp.FreeSwinging(1, damping=0.5), ftqp.FreeSwinging(3)],
        [ftqp.FreeSwinging(2), ftqp.Locked(0)],
        [ftqp.FreeSwinging(0, damping=2.0), ftqp.FreeSwinging(2), ftqp.Locked(4)],
    ],
    ids=["one", "the last", "two", "one beside a lock", "two beside a lock"],
)
def test_joints_that_swing_freely_move_as_physics_says_and_the_others_as_little_as_the_task_allows(faults):
    robot = ftqp.robots.load("planar", count=5)
    q, v, step = ridden(robot, faults)
    friction = {fault.joint: fault.damping for fault in faults if isinstance(fault, ftqp.FreeSwinging)}
    free = sorted(friction)
    tau = torques(robot, q, v, step)
    assert tau[free] == pytest.approx([-friction[i] * step.v[i] for i in free], abs=1e-8)
    locked = [fault.joint for fault in faults if isinstance(fault, ftqp.Locked)]
    working = [i for i in range(5) if i not in free and i not in locked]
    damping = np.diag([friction.get(i, 0.0) for i in range(5)])
    rows = np.vstack([robot.jacobian(q)[:2], (robot.mass_matrix(q) / DT + damping)[free]])
    b = rows @ step.v - rows[:, locked] @ step.v[locked]
    G, F = rows[:, working], rows[:, free]
    # x_w of least norm with G x_w + F x_f = b for some x_f: b less what F can make of it
    keep = np.linalg.svd(F)[0][:, len(free) :].T
    expected = np.linalg.pinv(keep @ G) @ (keep @ b)
    assert step.v[working] == pytest.approx(expected, abs=1e-9)
    assert np.abs(step.v[working]).max() > 1e-3 or len(working) <= 2


@pytest.mark.slow
def test_a_free_joint_of_an_arm_in_space_is_taken_into_account():
    robot = ftqp.robots.load("iiwa14")
    fault = ftqp.FreeSwinging(6, damping=0.5)
    q, v, step = ridden(robot, [fault], "singularity_robust", task=ftqp.Task(rows="position"))
    assert step.status is StepStatus.OK
    assert torques(robot, q, v, step)[6] == pytest.approx(-0.5 * step.v[6], abs=1e-9)


@pytest.mark.slow
def test_the_limits_of_the_robust_inverse_are_those_of_the_joints_that_work():
    """Where it does not damp it is the least sum of (v/limit)^2 of those that work."""
    robot = ftqp.robots.load("panda")
    task = ftqp.Task(rows="position")
    q, _, step = ridden(robot, [ftqp.Locked(3)], "singularity_robust", speed=0.005, task=task, ticks=12)
    limits = robot.limits.v_max.copy()
    others = [i for i in range(7) if i != 3]
    J = robot.jacobian(q)[:3]
    b = J @ step.v - J[:, 3] * step.v[3]
    W = np.diag(limits[others])
    assert step.v[others] == pytest.approx(W @ np.linalg.pinv(J[:, others] @ W) @ b, abs=1e-9)
    assert step.v[3] == 0.0 and step.kappa == 0.0


def asked(robot, q, step, most):
    """The pseudoinverse's rates: along the target's way, as large as the joints that met no limit say."""
    along = np.linalg.pinv(robot.jacobian(q)[:2])[:, 1]
    kept = np.abs(step.v) < most - 1e-6
    sizes = step.v[kept] / along[kept]
    assert kept.any() and not kept.all() and np.ptp(sizes) < 1e-9
    return along * sizes[0]


def test_rates_beyond_their_limits_are_cut_off_and_the_others_stay():
    """min |x - x_cf|^2 over the interval of every joint."""
    robot = ftqp.robots.load("planar", count=4)
    q, _, step = ridden(robot, [], speed=0.05, ticks=1)
    most = DT * robot.limits.a_max
    assert step.status is StepStatus.RELAXED
    assert step.v == pytest.approx(np.clip(asked(robot, q, step, most), -most, most), abs=1e-9)


def test_rates_beyond_the_torque_limits_become_the_nearest_that_keep_them():
    """min |x - x_cf|^2 over intervals and |M x/dt + h| <= tau_max, by scipy."""
    planar = ftqp.robots.load("planar", count=4)
    tau_max, speed = np.array([3.0, 2.0, 1.0, 0.5]), 0.02
    limits = {"q_min": -2.6, "q_max": 2.6, "v_max": 1.0, "a_max": 5.0}
    made = [
        ftqp.Robot.from_pinocchio(planar.model, "tip", limits=limits | {"tau_max": most}, name="arm")
        for most in (1e3, tau_max.tolist())
    ]
    start = [0.0, 1.05, 0.85, -1.4]  # which posture is neutral hangs on rounding, as the links are alike
    (q, v, wide), (_, _, step) = (ridden(robot, [], speed=speed, ticks=1, start=start) for robot in made)
    robot = made[1]
    assert wide.status is StepStatus.OK and step.status is StepStatus.RELAXED
    assert np.abs(torques(robot, q, v, wide)).max() > 1.5 * tau_max.min()
    M, h = robot.mass_matrix(q) / DT, robot.bias(q, v)
    rows = [{"type": "ineq", "fun": lambda x, s=s: tau_max - s * (M @ (x - v) + h)} for s in (1.0, -1.0)]
    nearest = minimize(
        lambda x: 1e4 * ((x - wide.v) ** 2).sum(), np.zeros(4), constraints=rows, method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 300},
    )  # fmt: skip
    assert step.v == pytest.approx(nearest.x, abs=1e-6)
    assert np.abs(torques(robot, q, v, step) / tau_max).max() == pytest.approx(1.0, abs=1e-7)


def test_a_sample_that_is_no_number_and_what_is_allowed_as_it_is_need_no_closed_form():
    robot = ftqp.robots.load("planar", count=4)
    _, v, step = ridden(robot, [], ticks=3, spoilt=[2])
    assert step.status is StepStatus.INVALID_INPUT and step.kappa == 0.0
    assert np.abs(step.v - v).max() <= DT * robot.limits.a_max[0] + 1e-12
    _, _, good = ridden(robot, [], ticks=3)
    assert good.status is StepStatus.OK and good.qp.iterations == 0
