"""Level 2: after the tasks of level 1, before the scheme's objective."""

import numpy as np
import pytest

import ftqp

PANDA = ftqp.robots.load("panda").with_limits(v_max=1e3, a_max=1e6)
DUAL = ftqp.robots.load("dual_panda")
RIGHT = DUAL.tips[1]
ELBOW, HAND = "panda_joint4", "panda_hand_tcp"


def first_command(level, scheme, mode, seed, tasks):
    """x of the first tick and the planner, of a posture near whose place the targets are."""
    rng = np.random.default_rng(seed)
    limits = ftqp.robots.load("panda").limits
    q = limits.q_min + (limits.q_max - limits.q_min) * rng.uniform(0.3, 0.7, 7)
    v = 0.05 * rng.normal(size=7) if level == "acceleration" else np.zeros(7)
    place = PANDA.pose(q, ELBOW)[:3, 3] + (0, 0, 1e-7 * rng.normal())
    made = [ftqp.PositionTask(ELBOW, rows="z", level=one, target=place, name=f"{one}") for one in tasks]
    planner = ftqp.Planner(
        PANDA, 1e-3, level=level, scheme=scheme, torque_limits=False,
        tasks=[ftqp.Task("position", mode=mode), *made],
    )  # fmt: skip
    planner.reset(q, v)
    T = PANDA.pose(q)
    T[:3, 3] += 1e-7 * rng.normal(size=3)
    step = planner.step(q, v, ftqp.Target(pose=T))
    return (step.v if level == "velocity" else step.a).copy(), planner.session().K


@pytest.mark.parametrize(("mode", "scheme"), [("slack", "mvn"), ("lexicographic", "mke"), ("slack", "dlsm")])
def test_the_command_is_that_of_one_qp_after_the_other(level, scheme, mode):
    """First A x = b, then the elbow's row, then the least of the scheme's objective over what is left."""
    for seed in range(3):
        _, K = first_command(level, scheme, "slack", seed, ())
        H = K.qp.H[:7, :7].copy() if K.qp.dense else np.diag(K.qp.H_diagonal[:7])
        g, A, b = K.qp.g[:7].copy(), K.qp.A[:3, :7].copy(), K.qp.b[:3].copy()
        x, K = first_command(level, scheme, mode, seed, (2,))
        J, c = K.terms.J[0, 2, :7].copy(), float(K.terms.asked[0, 2])

        def least(rows, right, H=H, g=g):
            m = len(right)
            kkt = np.block([[H, rows.T], [rows, np.zeros((m, m))]])
            return np.linalg.solve(kkt, np.concatenate([-g, right]))[:7]

        alone, wanted = least(A, b), least(np.vstack([A, J]), np.append(b, c))
        assert np.abs(A @ x - b).max() < 1e-8 * np.abs(x).max(), "level 2 costs level 1 nothing"
        assert abs(J @ x - c) < 2e-3 * abs(J @ alone - c), "nor the scheme level 2"
        assert np.abs(x - wanted).max() < 0.02 * np.abs(x).max(), "which has what is left"


def test_level_2_goes_before_level_3_whatever_their_weights(level):
    q, robot = DUAL.neutral, DUAL
    elbow, up = "right_joint4", robot.pose(DUAL.neutral, "right_joint4")[:3, 3] + (0.0, 0.03, 0.0)
    tasks = [
        ftqp.Task(),
        ftqp.PositionTask(RIGHT, level=1),
        ftqp.PositionTask(elbow, rows="y", target=up, level=2, weight=1e-3, name="first"),
        ftqp.PositionTask(elbow, rows="y", target=up - (0, 0.06, 0), level=3, name="second"),
    ]
    planner = ftqp.Planner(robot, 2e-3, level=level, tasks=tasks)
    planner.reset(q)
    target = ftqp.Target(pose=robot.pose(q))
    for _ in range(2000):
        step = planner.step(q, None, target)
        q = step.q.copy()
    assert abs(robot.pose(q, elbow)[1, 3] - up[1]) < 1e-3
    for hand in robot.tips:
        assert np.abs(robot.pose(q, hand) - robot.pose(robot.neutral, hand))[:3, 3].max() < 2e-5


@pytest.mark.parametrize("task", [
    ftqp.PositionTask(ELBOW, target=(0, 0, 3.0), level=2, name="far"),
    ftqp.CentreOfMass(target=(1.0, 0, 1.0), level=2, name="far"),
    ftqp.PostureTask(PANDA.neutral + 0.4, level=2, name="far"),
])  # fmt: skip
def test_an_arm_rests_where_level_2_cannot_be_reached(level, task):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, 2e-3, level=level, tasks=[ftqp.Task("position"), task])
    q = robot.neutral.copy()
    planner.reset(q)
    target, most = ftqp.Target(pose=robot.pose(q)), 0.0
    for k in range(2250):
        step = planner.step(q, None, target)
        q = step.q.copy()
        most = max(most, float(np.abs(step.a / robot.limits.a_max).max())) if k >= 2000 else 0.0
    assert most < 0.06 and step.position_error < 1e-5 and step.status is ftqp.StepStatus.OK


def test_level_2_arrives_where_level_3_is_outweighed_by_the_scheme():
    """A hand turns upside down only where the scheme, which would rather rest, has what is left."""
    robot, left = ftqp.robots.load("panda"), {}
    for level in (2, 3):
        look = ftqp.AxisTask(HAND, towards=(0, 0, 3.0), level=level, name="look")
        planner = ftqp.Planner(robot, 2e-3, tasks=[ftqp.Task("position"), look])
        q = robot.neutral.copy()
        planner.reset(q)
        target = ftqp.Target(pose=robot.pose(q))
        for _ in range(4500):
            step = planner.step(q, None, target)
            q = step.q.copy()
        left[level] = float(np.linalg.norm(step.tasks["look"].error))
        assert step.position_error < 1e-5
    assert left[2] < 1e-3 and left[3] > 0.5


@pytest.mark.parametrize("later", [2, 3])
@pytest.mark.parametrize("backend", ["daqp", "osqp", "proxqp", "quadprog", "dtrnn"])
def test_every_backend_sees_how_rows_change_as_the_arm_moves(backend, later):
    """A solver that keeps H from tick to tick answers with an old one, and the planner falls back in time."""
    if backend != "dtrnn":
        pytest.importorskip("proxsuite" if backend == "proxqp" else backend)
    robot = ftqp.robots.load("panda")
    down = robot.pose(robot.neutral, ELBOW)[:3, 3] - (0, 0, 0.05)
    tasks = [ftqp.Task("position"), ftqp.PositionTask(ELBOW, rows="z", target=down, level=later)]
    planner = ftqp.Planner(robot, 2e-3, level="velocity", backend=backend, tasks=tasks)
    q = robot.neutral.copy()
    planner.reset(q)
    target = ftqp.Target(pose=robot.pose(q))
    for _ in range(300):
        step = planner.step(q, None, target)
        q = step.q.copy()
        assert step.status is ftqp.StepStatus.OK


@pytest.mark.parametrize("weight", [1e-200, 1e300])
def test_only_the_ratio_of_weights_counts_on_level_2(weight):
    commands = []
    for one in (1.0, weight):
        tasks = [
            ftqp.Task("position"),
            ftqp.PositionTask(ELBOW, target=(0.3, 0.1, 0.6), level=2, weight=one),
            ftqp.PostureTask(PANDA.neutral + 0.1, level=2, weight=one),
        ]
        planner = ftqp.Planner(PANDA, 1e-3, tasks=tasks)
        planner.reset(PANDA.neutral)
        step = planner.step(PANDA.neutral, None, ftqp.Target(pose=PANDA.pose(PANDA.neutral)))
        assert step.status is ftqp.StepStatus.OK
        commands.append(step.a.copy())
    assert commands[0] == pytest.approx(commands[1], rel=1e-9)
