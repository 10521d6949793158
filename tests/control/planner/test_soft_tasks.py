"""Soft tasks: their terms against pinocchio, what they reach, and what is said of wrong ones."""

import pickle
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tests.going import closed_loop

import ftqp
from ftqp.core.errors import InputError

PANDA = ftqp.robots.load("panda")
LIGHT = ftqp.Robot.from_dh(
    [[0.3, 0.0, 0.0, 0.0], [0.0, 0.2, 0.5, 0.0], [0.25, 0.1, -0.7, 0.4], [0.3, 0.0, 1.2, 0.0]],
    limits=dict(q_min=-2.0, q_max=2.0, v_max=2.0, a_max=20.0),
)  # fmt: skip
DT = 1e-3
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
ELBOW = "panda_joint4"


def still(robot, q):
    return ftqp.Target(pose=robot.pose(q))


def objective(tasks, level, q=Q, v=V, **settings):
    """H and g of the first tick on level 3, beside those of a planner without the tasks, and its state."""
    made = []
    for soft in ([replace(one, level=3) for one in tasks], []):
        planner = ftqp.Planner(PANDA, DT, level=level, torque_limits=False, tasks=soft, **settings)
        planner.reset(q, v)
        planner.step(q, v, still(PANDA, q))
        K = planner.session().K
        H = K.qp.H[:7, :7].copy() if K.qp.dense else np.diag(K.qp.H_diagonal[:7])
        made.append((H, K.qp.g[:7].copy()))
    (H, g), (H0, g0) = made
    return H - H0, g - g0, K.state.q[:7].copy(), K.state.v[:7].copy()


def frame(q, v, name, point=(0.0, 0.0, 0.0)):
    """Place, axes, Jacobian and Jdot v of a point of a frame, by pinocchio."""
    model = PANDA.model.copy()
    at = model.frames[model.getFrameId(name)]
    place = pin.Frame(
        "point", at.parentJoint, at.placement * pin.SE3(np.eye(3), np.array(point)), pin.OP_FRAME
    )
    number, data = model.addFrame(place), model.createData()
    data = model.createData()
    pin.forwardKinematics(model, data, q, v, np.zeros(7))
    pin.updateFramePlacements(model, data)
    J = pin.computeFrameJacobian(model, data, q, number, pin.LOCAL_WORLD_ALIGNED)
    drift = pin.getFrameClassicalAcceleration(model, data, number, pin.LOCAL_WORLD_ALIGNED).vector
    return data.oMf[number], J, drift


def term(J, b, weight):
    return weight * J.T @ J, -weight * J.T @ b


def close(found, expected):
    for a, b in zip(found, expected, strict=True):
        assert np.abs(a - b).max() <= 1e-11 * max(1.0, np.abs(b).max())


def asked(level, J, v, error, drift, kp, kv):
    return kp * error + (-kv * J @ v - drift if level == "acceleration" else 0.0)


@pytest.mark.parametrize(("name", "point", "rows"), [
    (ELBOW, (0.1, -0.2, 0.05), "xyz"), ("panda_joint2", (0.0, 0.3, 0.0), "z"),
    ("panda_hand_tcp", (0, 0, 0.1), "yx"),
])  # fmt: skip
def test_a_point_is_the_term_that_pinocchio_says(level, name, point, rows):
    goal = np.array([0.3, 0.2, 0.5])
    task = ftqp.PositionTask(name, point=point, rows=rows, target=goal, weight=3.0, kp=7.0, kv=4.0, name="p")
    H, g, q, v = objective([task], level)
    T, J, drift = frame(q, v, name, point)
    b = asked(level, J[:3], v, goal - T.translation, drift[:3], 7.0, 4.0)
    keep = ["xyz".index(row) for row in rows]
    close((H, g), term(J[:3][keep], b[keep], 3.0))


def test_an_axis_is_the_term_that_pinocchio_says(level):
    along = np.array([0.3, -0.5, -0.8]) / np.linalg.norm([0.3, -0.5, -0.8])
    task = ftqp.AxisTask("panda_joint6", axis=(0, 2.0, 1.0), along=3.0 * along, weight=2.0, kp=9.0, kv=5.0)
    H, g, q, v = objective([task], level)
    T, J, drift = frame(q, v, "panda_joint6")
    a = T.rotation @ np.array([0, 2.0, 1.0]) / np.sqrt(5.0)
    error = np.cross(a, along)
    error = error if a @ along >= 0 else error / np.linalg.norm(error)
    across = np.eye(3) - np.outer(a, a)
    w = J[3:] @ v
    rows = across @ J[3:]
    b = asked(level, rows, v, error, across @ drift[3:] - (a @ w) * np.cross(w, a), 9.0, 5.0)
    close((H, g), term(rows, b, 2.0))


def test_an_axis_that_looks_at_a_place_turns_as_its_derivative_says():
    place = np.array([0.9, 0.3, 0.2])
    H, g, q, v = objective([ftqp.AxisTask("panda_joint6", towards=place, weight=1.0, kp=1.0)], "velocity")
    T, J, _ = frame(q, v, "panda_joint6")
    sight = place - T.translation
    d = sight / np.linalg.norm(sight)
    a = T.rotation[:, 2]
    turn = np.array([np.cross(d, J[:3, j]) for j in range(7)]).T / np.linalg.norm(sight)
    rows = (np.eye(3) - np.outer(a, a)) @ J[3:] + turn
    error = np.cross(a, d) if a @ d >= 0 else np.cross(a, d) / np.linalg.norm(np.cross(a, d))
    close((H, g), term(rows, error, 1.0))


def test_the_centre_of_mass_is_the_term_that_pinocchio_says(level):
    goal = np.array([0.1, 0.05, 0.4])
    H, g, q, v = objective([ftqp.CentreOfMass("xy", target=goal, weight=5.0, kp=6.0, kv=3.0)], level)
    model, data = PANDA.model, PANDA.model.createData()
    J = pin.jacobianCenterOfMass(model, data, q)
    pin.centerOfMass(model, data, q, v, np.zeros(7))
    b = asked(level, J, v, goal - data.com[0], data.acom[0], 6.0, 3.0)
    close((H, g), term(J[:2], b[:2], 5.0))


def test_joints_and_ones_own_rows_are_the_same_term(level):
    where = {"panda_joint2": 0.4, 4: -0.3}
    J = np.zeros((2, 7))
    J[0, 1] = J[1, 4] = 1.0

    def fill(state, rows, b):
        rows[:] = J
        b[:] = asked(level, J, state.v, np.array([0.4, -0.3]) - J @ state.q, 0.0, 8.0, 2.0)

    one = objective([ftqp.JointTask(where, weight=4.0, kp=8.0, kv=2.0)], level)
    close(one[:2], objective([ftqp.LeastSquares(2, fill, weight=4.0)], level)[:2])
    assert np.count_nonzero(one[0]) == 2


def run(planner, target, ticks=2500, fault=None):
    fails = {} if fault is None else {ticks // 3: lambda planner: planner.report(fault)}
    *_, step = closed_loop(planner, target, ticks, events=fails)
    return step, step.q


@pytest.mark.parametrize("fault", [None, ftqp.Locked(1)])
def test_an_arm_whose_tip_has_a_position_looks_where_it_is_told_beside_it(level, fault):
    look = ftqp.AxisTask("panda_hand_tcp", towards=[0.6, 0.25, 0.0], weight=20.0, kp=25.0, name="look")
    planner = ftqp.Planner(PANDA, DT, level=level, tasks=[ftqp.Task(rows="position"), look])
    step, q = run(planner, still(PANDA, PANDA.neutral), fault=fault)
    T = PANDA.pose(q)
    sight = np.array([0.6, 0.25, 0.0]) - T[:3, 3]
    assert step.status is ftqp.StepStatus.OK and step.position_error < 1e-6
    assert np.linalg.norm(np.cross(T[:3, 2], sight)) < 0.02 * np.linalg.norm(sight) and T[:3, 2] @ sight > 0
    assert np.linalg.norm(step.tasks["look"].error) < 0.02


def test_a_larger_weight_comes_nearer_and_none_leaves_the_task_out():
    target, found = still(PANDA, PANDA.neutral), []
    for weight in (0.0, 1.0, 1e4):
        elbow = ftqp.PositionTask(
            ELBOW, rows="y", target=[0.0, 0.05, 0.0], weight=weight, kp=25.0, name="elbow"
        )
        planner = ftqp.Planner(PANDA, DT, tasks=[elbow, ftqp.PostureTask(weight=1.0, kp=25.0)])
        step, _ = run(planner, target)
        found.append(abs(step.tasks["elbow"].error[1]))
    assert found[0] == pytest.approx(0.05, abs=1e-6) and found[0] > found[1] > found[2]
    assert found[2] < 5e-3


def test_a_batch_of_a_planner_whose_task_has_no_place_yet_is_refused():
    planner = ftqp.Planner(PANDA, DT, tasks=[ftqp.PositionTask(ELBOW, name="elbow")])
    targets = ftqp.Targets(PANDA.pose(PANDA.neutral)[None])
    with pytest.raises(InputError, match=r"the task 'elbow' has no target yet"):
        ftqp.batch.rollout(planner, PANDA.neutral, targets=targets)
    planner.reset(PANDA.neutral)
    assert ftqp.batch.rollout(planner, PANDA.neutral, targets=targets).q.shape == (1, 7)


def test_an_arm_comes_to_rest_whose_soft_tasks_cannot_be_reached(level):
    soft = [ftqp.PositionTask(ELBOW, target=[2.0, -3.0, 1.0], weight=3.0),
            ftqp.AxisTask("panda_joint6", along=[1.0, 1.0, 0.2], weight=10.0)]  # fmt: skip
    planner = ftqp.Planner(PANDA, 2e-3, level=level, tasks=[ftqp.Task(rows="position"), *soft])
    step, _ = run(planner, still(PANDA, PANDA.neutral), 15_000, ftqp.Locked(2))
    assert step.position_error < 1e-6 and np.abs(step.v).max() < 1e-4


def test_targets_come_by_task_and_those_left_out_stay():
    elbow = ftqp.PositionTask(ELBOW, name="elbow")
    planner = ftqp.Planner(PANDA, DT, tasks=[elbow])
    q, tip = PANDA.neutral, still(PANDA, PANDA.neutral)
    planner.reset(q)
    with pytest.raises(InputError, match=r"target of the end effector is no target so far"):
        planner.step(q, None, {"elbow": [0, 0, 0.5]})
    assert planner.tasks["elbow"].target == pytest.approx(frame(q, V, ELBOW)[0].translation)
    planner.step(q, None, {"tip": tip, "elbow": [0.0, 0.1, 0.5]})
    planner.step(q, None, {"elbow": [0.0, 0.2, 0.5]}, tau=np.zeros(7))
    assert planner.tasks["elbow"].target == pytest.approx([0.0, 0.2, 0.5])
    planner.step(q, None, {PANDA.tip: tip})
    planner.tasks["elbow"].weight, planner.tasks["elbow"].velocity = 0.0, [0.0, 0.1, 0.0]
    step = planner.step(q, None, tip)
    for kept in (step.copy(), pickle.loads(pickle.dumps(step))):
        np.testing.assert_array_equal(kept.tasks["elbow"].error, step.tasks["elbow"].error)
    with pytest.raises(ValueError, match="read-only"):
        step.tasks["elbow"].error[0] = 1.0


def test_a_function_that_fails_leaves_its_task_out_of_the_tick_and_says_so(caplog):
    what = [None]

    def fill(state, J, b):
        J[0, 2] = 1.0
        b[0] = 50.0
        if what[0] == "raise":
            raise RuntimeError("mine")
        if what[0] == "nan":
            J[0, 3] = np.nan
        if what[0] == "shape":
            J[:] = np.zeros((2, 7))
        if what[0] == "Ctrl-C":
            raise KeyboardInterrupt
        return 3 if what[0] == "returns" else None

    tasks = [ftqp.LeastSquares(1, fill, weight=10.0, name="own"), ftqp.PostureTask(name="posture")]
    planner = ftqp.Planner(PANDA, DT, tasks=tasks)
    q, target = PANDA.neutral, still(PANDA, PANDA.neutral)
    planner.reset(q)
    said = {"raise": "raised RuntimeError: mine", "nan": "gave numbers that are not finite",
            "shape": "raised ValueError: could not broadcast", "returns": "returned int"}  # fmt: skip
    kept = {}
    for how in said:
        what[0] = how
        step = planner.step(q, None, target)
        assert step.status is ftqp.StepStatus.OK and np.abs(step.a).max() < 1e-6
        assert said[how] in step.tasks["own"].failed and "left out of the tick" in step.tasks["own"].failed
        assert step.tasks["posture"].failed is None
        kept[how] = step.copy()
    assert [record.message for record in caplog.records] == [
        "fill raised RuntimeError: mine, so that 'own' was left out of the tick; this is said once"
    ]
    what[0] = "Ctrl-C"
    with pytest.raises(KeyboardInterrupt):
        planner.step(q, None, target)
    what[0] = None
    step = planner.step(q, None, target)
    assert np.abs(step.a).max() > 0.1 and step.tasks["own"].failed is None
    for how, one in kept.items():
        assert said[how] in one.tasks["own"].failed
        assert said[how] in pickle.loads(pickle.dumps(one)).tasks["own"].failed
    assert pickle.loads(pickle.dumps(step)).tasks["own"].failed is None
    with pytest.raises(InputError, match="a batch does not"):
        ftqp.batch.rollout(planner, q[None], targets=ftqp.Targets(np.eye(4)[None]))


def test_what_a_running_task_refuses():
    tasks = [
        ftqp.PositionTask(ELBOW, name="elbow"),
        ftqp.AxisTask("panda_hand_tcp", along=[0, 0, -1], name="axis"),
    ]
    planner = ftqp.Planner(PANDA, DT, tasks=tasks)
    with pytest.raises(InputError, match=r"no task 'elbo' \(did you mean 'elbow'\?\)"):
        planner.tasks["elbo"]
    with pytest.raises(InputError, match="weight of elbow is -1"):
        planner.tasks["elbow"].weight = -1.0
    with pytest.raises(InputError, match="target of elbow"):
        planner.tasks["elbow"].target = [0.0, 0.0]
    with pytest.raises(InputError, match="axis has no velocity"):
        planner.tasks["axis"].velocity = [0.0, 0.0, 0.0]
    with pytest.raises(AttributeError, match=r"elbow\.kp cannot be set"):
        planner.tasks["elbow"].kp = 3.0
    with pytest.raises(AttributeError, match=r"planner\.tasks cannot be set"):
        planner.tasks = []
    assert "elbow" in planner.tasks and "elbo" not in planner.tasks
    assert list(planner.tasks) == ["elbow", "axis"] and len(planner.tasks) == 2
    with pytest.raises(InputError, match="solves no QP"):
        ftqp.Planner(PANDA, DT, level="velocity", scheme="pseudoinverse", tasks=tasks)
    with pytest.raises(InputError, match="has no masses, so no centre of mass"):
        ftqp.Planner(LIGHT, DT, tasks=[ftqp.CentreOfMass()])
