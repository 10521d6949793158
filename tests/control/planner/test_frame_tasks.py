"""Tasks of further frames, on trees: their rows against pinocchio, what goes first, and wrong ones."""

import numpy as np
import pinocchio as pin
import pytest
from tests.going import closed_loop, started, targets_along

import ftqp

DT = 1e-3
HANDS = ("left_hand", "right_hand")
GRIP = ftqp.RelativeTask("right_hand", "left_hand", level=0, name="grip")


BOTH = ftqp.robots.load("dual_panda")
RNG = np.random.default_rng(7)
Q = BOTH.neutral + RNG.uniform(-0.2, 0.2, 14)
V = RNG.uniform(-0.3, 0.3, 14)


def first_tick(tasks, level, **settings):
    """The QP of the first tick of a moving arm."""
    planner = ftqp.Planner(BOTH, DT, level=level, torque_limits=False, tasks=tasks, **settings)
    planner.reset(Q, V)
    planner.step(Q, V, ftqp.Target(pose=BOTH.pose(Q)))
    return planner.session().K


def frame(name):
    """Pose, Jacobian and Jdot v of a frame at (Q, V), by pinocchio."""
    model = BOTH.model
    data, number = model.createData(), model.getFrameId(name)
    pin.forwardKinematics(model, data, Q, V, np.zeros(14))
    pin.updateFramePlacements(model, data)
    J = pin.computeFrameJacobian(model, data, Q, number, pin.LOCAL_WORLD_ALIGNED)
    drift = pin.getFrameClassicalAcceleration(model, data, number, pin.LOCAL_WORLD_ALIGNED).vector
    return data.oMf[number], J, drift


def at_point(pose, J, drift, place):
    """The same of another point of that body."""
    r = place - pose.translation
    w, spun = J[3:] @ V, drift.copy()
    shifted = J.copy()
    shifted[:3] -= pin.skew(r) @ J[3:]
    spun[:3] += np.cross(drift[3:], r) + np.cross(w, np.cross(w, r))
    return shifted, spun


def right_side(level, J, error, drift, kp, kv, rate=0.0, ahead=0.0):
    if level == "velocity":
        return rate + kp * error
    return ahead + kp * error + kv * (rate - J @ V) - drift


def close(found, expected):
    assert np.abs(found - expected).max() <= 1e-11 * max(1.0, np.abs(expected).max())


GOAL = pin.SE3(pin.exp3(np.array([0.4, 2.0, -0.7])), np.array([0.4, -0.2, 0.5]))


@pytest.mark.parametrize("rows", ["pose", "orientation", ("z", "rx", "y")])
def test_a_pose_is_the_term_that_pinocchio_says(level, rows):
    task = ftqp.PoseTask("right_hand", rows=rows, target=GOAL, level=3, weight=3.0, kp=7.0, kv=4.0)
    made = [first_tick(tasks, level) for tasks in ([task], [ftqp.PostureTask(weight=0.0)])]
    (H, g), (H0, g0) = (
        (K.qp.H[:14, :14].copy() if K.qp.dense else np.diag(K.qp.H_diagonal[:14]), K.qp.g[:14].copy())
        for K in made
    )
    T, J, drift = frame("right_hand")
    error = np.r_[GOAL.translation - T.translation, pin.log3(GOAL.rotation @ T.rotation.T)]
    names = ("x", "y", "z", "rx", "ry", "rz")
    asked = {"pose": names, "orientation": names[3:]}.get(rows, rows)
    keep = [k for k, name in enumerate(names) if name in asked]
    scale = np.r_[np.ones(3), np.full(3, BOTH.length)]
    A = (scale[:, None] * J)[keep]
    b = (scale * right_side(level, J, error, drift, 7.0, 4.0))[keep]
    close(H - H0, 3.0 * A.T @ A)
    close(g - g0, -3.0 * A.T @ b)


def test_a_pose_in_another_frame_is_the_rows_that_pinocchio_says(level):
    """The goal is a place of the other body, so that the rows are those of two points of two bodies."""
    task = ftqp.RelativeTask("right_hand", "left_hand", level=0, target=GOAL, kp=5.0, kv=2.0)
    K = first_tick([task], level)
    (T, J, drift), (S, J_other, drift_other) = frame("right_hand"), frame("left_hand")
    goal = S * GOAL
    J_other, drift_other = at_point(S, J_other, drift_other, goal.translation)
    error = np.r_[goal.translation - T.translation, pin.log3(goal.rotation @ T.rotation.T)]
    rows, moves = J - J_other, drift - drift_other
    scale = np.r_[np.ones(3), np.full(3, BOTH.length)]
    first = int(K.qp.nc) - 6
    assert first == 14, "torque rows come before"
    close(K.qp.C[first : first + 6, :14], scale[:, None] * rows)
    close(K.terms.asked[0], scale * right_side(level, rows, error, moves, 5.0, 2.0))


def test_a_target_that_moves_is_followed_without_lag(level):
    """Twist and acceleration of a target go ahead of its pose, on level 0 as for the tip."""
    path = ftqp.paths.Circle(BOTH.pose(Q, "right_hand"), radius=0.03, duration=4.0)
    targets, still = targets_along(path, 2000, DT), ftqp.Target(pose=BOTH.pose(Q))
    planner = ftqp.Planner(BOTH, DT, level=level, tasks=[ftqp.PoseTask("right_hand", level=0)])
    for step in closed_loop(planner, lambda k: {"tip": still, "right_hand": targets.at(k)}, 2000, Q):
        assert step.status is ftqp.StepStatus.OK
    assert np.abs(step.tasks["right_hand"].error).max() < 2e-5
    assert np.abs(BOTH.pose(step.q) - still.pose).max() < 2e-5
    assert planner.tasks["right_hand"].target == pytest.approx(path.sample(1999 * DT).pose[0], abs=1e-12)


def carried(planner, lock=None, steps=1500, way=(-0.1, 0.0, 0.1)):
    """Two hands carry a bar along a line: the last step, the worst slip, and the load's error at last [m]."""
    q = BOTH.neutral.copy()
    planner.reset(q)
    T0, bar = BOTH.pose(q), np.linalg.solve(BOTH.pose(q, HANDS[0]), BOTH.pose(q, HANDS[1]))
    slip, T = 0.0, T0
    for k in range(steps):
        if lock is not None and k == 300:
            planner.report(ftqp.Locked(lock))
        s = min(k / (0.7 * steps), 1.0)
        T = T0.copy()
        T[:3, 3] += np.array(way) * (10 * s**3 - 15 * s**4 + 6 * s**5)
        step = planner.step(q, None, ftqp.Target(pose=T))
        assert (step.q >= BOTH.limits.q_min - 1e-9).all() and (step.q <= BOTH.limits.q_max + 1e-9).all()
        assert (np.abs(step.v) <= BOTH.limits.v_max + 1e-9).all()
        q = step.q.copy()
        if k % 20 == 0:
            held = np.linalg.solve(BOTH.pose(q, HANDS[0]), BOTH.pose(q, HANDS[1]))
            slip = max(slip, np.linalg.norm((held - bar)[:3, 3]))
    return step, slip, np.linalg.norm((BOTH.pose(q) - T)[:3, 3])


def leaving(v, ramp=1):
    """A target that leaves the tip's place at so many m/s, which it has after a ramp of some ticks."""
    T = BOTH.pose(BOTH.neutral)

    def target(k):
        T[:3, 3] += np.array(v) * DT * min(1.0, k / ramp)
        return ftqp.Target(pose=T)

    return target


@pytest.mark.parametrize("lock", [None, 2, 11])
def test_when_a_joint_locks_the_load_goes_on_and_the_grip_does_not_slip(level, lock):
    planner = ftqp.Planner(BOTH, DT, level=level, tasks=[ftqp.Task("pose", mode="scaled"), GRIP])
    step, slip, left = carried(planner, lock)
    assert slip < 1e-5 and left < 1e-3
    assert step.status is ftqp.StepStatus.OK


def test_where_both_cannot_be_the_load_gives_way_and_the_grip_is_kept():
    """Both elbows locked: thirteen equations for twelve joints."""
    planner = started(BOTH, DT, level="velocity", tasks=[ftqp.Task("pose"), GRIP], emergency=None)
    for joint in (3, 10):
        planner.report(ftqp.Locked(joint))
    step, slip, left = carried(planner, 5)
    assert slip < 1e-5 < 1e-3 < left
    assert step.status is ftqp.StepStatus.RELAXED
    assert any(bound.joint.startswith("grip") for bound in step.certificate.obstacles)


def test_what_is_out_of_reach_on_level_0_leaves_limits_kept_and_the_arm_at_rest(level):
    away = BOTH.pose(BOTH.neutral, "right_hand")
    away[:3, 3] += (0.0, -3.0, 0.0)
    reach = ftqp.PoseTask("right_hand", level=0, target=away)
    planner = ftqp.Planner(BOTH, DT, level=level, tasks=[ftqp.Task("pose"), reach])
    for step in closed_loop(planner, ftqp.Target(pose=BOTH.pose(BOTH.neutral)), 3000):
        assert (step.q >= BOTH.limits.q_min - 1e-9).all() and (step.q <= BOTH.limits.q_max + 1e-9).all()
        assert (np.abs(step.v) <= BOTH.limits.v_max + 1e-9).all()
    assert step.status is ftqp.StepStatus.STOPPED and np.abs(step.v).max() < 1e-9


def test_a_stop_brings_both_arms_to_rest_and_keeps_the_grip(level):
    planner = ftqp.Planner(BOTH, DT, level=level, tasks=[ftqp.Task("pose"), GRIP])
    stop = {300: lambda planner: planner.stop()}
    *_, step = closed_loop(planner, leaving((-0.2, 0.0, 0.2), 200), 900, events=stop)
    assert step.status is ftqp.StepStatus.STOPPED and np.abs(step.v).max() < 1e-9
    bar, held = (
        np.linalg.solve(BOTH.pose(q, HANDS[0]), BOTH.pose(q, HANDS[1])) for q in (BOTH.neutral, step.q)
    )
    assert np.linalg.norm((held - bar)[:3, 3]) < 1e-4


def test_an_axis_looks_at_a_frame_that_moves(level):
    """An axis of the left hand points at the right one, which goes round a circle."""
    q = BOTH.neutral.copy()
    left, right = BOTH.pose(q), BOTH.pose(q, "right_hand")
    axis = left[:3, :3].T @ (right[:3, 3] - left[:3, 3] + np.array([0.1, 0.1, 0.1]))
    look = ftqp.AxisTask("left_hand", axis=axis, towards="right_hand", name="look", level=0)
    hand = ftqp.PoseTask("right_hand", rows="position", level=0)
    planner = started(BOTH, DT, level=level, tasks=[ftqp.Task("position"), hand, look], at=q)
    circle, tip = ftqp.paths.Circle(right, radius=0.05, duration=4.0), ftqp.Target(position=left[:3, 3])
    targets = targets_along(circle, 3000, DT)
    both = lambda k: {"tip": tip, "right_hand": targets.at(max(k - 1000, 0))}  # noqa: E731
    for k, step in enumerate(closed_loop(planner, both, 4000)):
        assert k < 1500 or np.linalg.norm(step.tasks["look"].error) < 2e-3
    T, other = BOTH.pose(step.q), BOTH.pose(step.q, "right_hand")[:3, 3]
    sight = (other - T[:3, 3]) / np.linalg.norm(other - T[:3, 3])
    assert T[:3, :3] @ axis / np.linalg.norm(axis) @ sight > 1.0 - 1e-5
    end = circle.sample(2999 * DT).pose[0, :3, 3]
    assert np.linalg.norm(other - end) < 1e-4 > np.linalg.norm(T[:3, 3] - left[:3, 3])


def test_rows_of_ones_own_are_kept_before_the_task():
    """The left shoulder turns no faster than a tenth of the right one."""

    def fill(state, C, l, u):
        C[0, 0], C[0, 7], u[0] = 1.0, -0.1, 0.0

    planner = ftqp.Planner(
        BOTH, DT, level="velocity", constraints=[ftqp.Rows(1, fill, name="ratio")],
        tasks=[ftqp.Task("pose"), GRIP], emergency=None,
    )  # fmt: skip
    pressed = 0
    for step in closed_loop(planner, leaving((0.0, 0.1, 0.0)), 400):
        assert step.v[0] - 0.1 * step.v[7] <= 1e-9
        pressed += "ratio 0 its row" in step.limits_active
    assert pressed > 100 and planner.constraints["ratio"].failed == ""


def raises(state, C, l, u):
    raise KeyError("no cable length")


def writes_nan(state, C, l, u):
    C[0, 0] = np.nan


def crosses(state, C, l, u):
    l[0], u[0] = 1.0, 0.0


def writes_another_shape(state, C, l, u):
    C[:] = np.zeros(3)


@pytest.mark.parametrize(("fill", "why"), [
    (raises, "fill raised KeyError: 'no cable length', so that the arm was stopped"),
    (writes_nan, "not finite"), (crosses, "l > u"),
    (writes_another_shape, "ValueError"),
])  # fmt: skip
def test_rows_that_fail_while_running_stop_the_arm_and_say_why(level, fill, why):
    told = []

    def good_at_first(state, C, l, u):
        told.append(state.q.copy())
        if len(told) > 101:  # it is tried once when the planner is made
            fill(state, C, l, u)

    planner = ftqp.Planner(
        BOTH, DT, level=level, constraints=[ftqp.Rows(1, good_at_first)], tasks=[ftqp.Task("pose")]
    )
    for k, step in enumerate(closed_loop(planner, leaving((0.0, 0.1, 0.0)), 600)):
        assert step.status is ftqp.StepStatus.OK or k >= 100
    assert step.status is ftqp.StepStatus.STOPPED and np.abs(step.v).max() < 1e-9
    assert why in planner.constraints["rows"].failed
