"""Several tasks on levels 1 to 3: which goes before which, how they are weighed, and what the status says."""

import numpy as np
import pytest
from tests.going import closed_loop, started

import ftqp

DUAL = ftqp.robots.load("dual_panda")
LEFT, RIGHT = DUAL.tips
PANDA = ftqp.robots.load("panda")
HAND = "panda_hand_tcp"


def moved(T, *by):
    T = np.array(T)
    T[:3, 3] += by
    return T


def run(planner, q, targets, ticks=3000):
    statuses = set()
    for step in closed_loop(planner, targets, ticks, q):
        statuses.add(step.status.name)
    return step, statuses


def position(robot, q, frame=None):
    return robot.pose(q, frame)[:3, 3]


@pytest.mark.parametrize(
    ("level", "mode", "backend"),
    [
        ("acceleration", "slack", "active_set"),
        ("velocity", "hard", "active_set"),
        ("acceleration", "scaled", "active_set"),
        ("velocity", "lexicographic", "active_set"),
        ("acceleration", "hard", "dtrnn"),
        pytest.param("velocity", "slack", "quadprog", marks=pytest.mark.solvers),
    ],
)
def test_both_hands_arrive(level, mode, backend):
    planner = ftqp.Planner(
        DUAL, level=level, backend=backend, tasks=[ftqp.Task(mode=mode), ftqp.PoseTask(RIGHT, level=1)]
    )
    q = DUAL.neutral
    goal = {
        LEFT: moved(DUAL.pose(q, LEFT), 0.05, 0.02, 0.06),
        RIGHT: moved(DUAL.pose(q, RIGHT), 0.03, 0, 0.05),
    }
    step, _ = run(planner, q, goal, ticks=2500 if backend == "active_set" else 1500)
    assert step.status is ftqp.StepStatus.OK
    for hand, T in goal.items():
        assert np.abs(DUAL.pose(step.q, hand) - T).max() < 1e-3 and step.tasks[hand].kept


@pytest.mark.parametrize(
    ("mode", "level", "weight"),
    [("slack", "acceleration", 0.25), ("lexicographic", "velocity", 3.0), ("slack", "velocity", 1.0)],
)
def test_where_two_pull_at_one_point_it_rests_at_their_weighted_mean(level, mode, weight):
    second = ftqp.PositionTask(HAND, level=1, weight=weight, name="second")
    planner = ftqp.Planner(PANDA, level=level, tasks=[ftqp.Task("position", mode=mode), second])
    q = PANDA.neutral
    one, two = (
        position(PANDA, q) + np.array((0.02, 0.01, 0.0)),
        position(PANDA, q) + np.array((-0.02, 0.0, 0.01)),
    )
    step, _ = run(planner, q, {HAND: one, "second": two}, ticks=6000)
    assert position(PANDA, step.q) == pytest.approx((one + weight * two) / (1.0 + weight), abs=1e-5)
    assert np.abs(step.v).max() < 1e-6, "it is at rest"


def test_the_command_is_the_minimum_of_both_prices():
    """1/2 |x|^2 + |A x - b|^2/(2 soft) + weight/(2 soft) (|J x - c|^2 + x'D x), velocity level, by numpy."""
    slack, weight, q = 1e-3, 2.0, PANDA.neutral
    tasks = [
        ftqp.Task("position", slack=slack),
        ftqp.PositionTask("panda_joint4", level=1, weight=weight, kp=3.0),
    ]
    planner = started(PANDA, level="velocity", tasks=tasks, at=q)
    e, f = np.array([1e-5, 2e-5, -1e-5]), np.array([2e-5, 0.0, 1e-5])
    step = planner.step(
        q, None, {HAND: position(PANDA, q) + e, "panda_joint4": position(PANDA, q, "panda_joint4") + f}
    )
    A, J = PANDA.jacobian(q)[:3], PANDA.jacobian(q, "panda_joint4")[:3]
    b, c = planner.task.kp * e if planner.task.kp else 10.0 * e, 3.0 * f
    soft = slack * (A**2).sum() / (3 * 7)
    columns = np.linalg.norm(J, axis=0)
    outer = columns[np.maximum.outer(np.arange(7), np.arange(7))] * np.outer(columns > 0, columns > 0)
    D = 0.1 * np.linalg.norm(f) * np.diag(outer.sum(axis=1))
    H = np.eye(7) + A.T @ A / soft + weight * (J.T @ J + D) / soft
    x = np.linalg.solve(H, A.T @ b / soft + weight * J.T @ c / soft)
    assert step.v == pytest.approx(x, abs=1e-9)
    assert step.tasks["panda_joint4"].slack == pytest.approx(J @ x - c, abs=1e-9)
    assert step.tasks[HAND].slack == pytest.approx(A @ x - b, abs=1e-9)


@pytest.mark.parametrize("later", [2, 3])
def test_later_levels_move_none_of_level_1(level, later):
    """A heavy task on level 2 or 3 that wants both hands elsewhere leaves micrometres of them."""
    q = DUAL.neutral
    tasks = [
        ftqp.Task(),
        ftqp.PoseTask(RIGHT, level=1),
        ftqp.PositionTask("right_joint4", target=(2.0, 0, 0), weight=10.0, level=later, name="elbow"),
    ]
    step, _ = run(ftqp.Planner(DUAL, level=level, tasks=tasks), q, {LEFT: DUAL.pose(q, LEFT)}, ticks=1500)
    elbow = position(DUAL, step.q, "right_joint4") - position(DUAL, q, "right_joint4")
    assert np.abs(elbow).max() > 0.01, "it does what it can"
    for hand in (LEFT, RIGHT):
        assert np.abs(DUAL.pose(step.q, hand) - DUAL.pose(q, hand)).max() < 5e-5


def test_level_0_goes_before_level_1():
    q = PANDA.neutral
    tasks = [
        ftqp.Task("position"),
        ftqp.PositionTask(HAND, rows="z", level=0, name="height"),
        ftqp.PositionTask(HAND, level=1, weight=1.0, name="second"),
    ]
    start = position(PANDA, q)
    goal = {HAND: start + np.array((0.02, 0, 0.02)), "second": start + np.array((-0.01, 0, 0.02))}
    step, statuses = run(ftqp.Planner(PANDA, tasks=tasks), q, goal, ticks=5000)
    assert position(PANDA, step.q) == pytest.approx(start + np.array((0.005, 0, 0.0)), abs=1e-4)
    assert "RELAXED" in statuses | {step.status.name}


def test_the_status_speaks_of_what_is_required():
    q = DUAL.neutral
    goal = {LEFT: DUAL.pose(q, LEFT), RIGHT: moved(DUAL.pose(q, RIGHT), 0, 0, 0.04)}
    for level in (0, 1):
        for required, name in ((None, "LAGGING"), (False, "OK")):
            planner = started(
                DUAL, tasks=[ftqp.Task(), ftqp.PoseTask(RIGHT, level=level, required=required)], at=q
            )
            step = planner.step(q, None, goal)
            assert step.status.name == name and step.tasks[RIGHT].kept is False


@pytest.mark.parametrize("level", [0, 1])
def test_a_hand_out_of_reach_is_never_ok(level):
    q = DUAL.neutral
    task = ftqp.PositionTask(RIGHT, level=level, target=(3.0, 0.0, 0.5), kp=2.0)
    planner = ftqp.Planner(DUAL, tasks=[ftqp.Task(), task], emergency=None)
    step, statuses = run(planner, q, {LEFT: DUAL.pose(q, LEFT)}, ticks=4000)
    assert "OK" not in statuses and step.tasks[RIGHT].kept is False
    if step.status is ftqp.StepStatus.RELAXED:
        assert RIGHT in str(step.certificate)
    assert np.abs(DUAL.pose(step.q, LEFT)[:3, 3] - DUAL.pose(q, LEFT)[:3, 3]).max() < 2e-3


def test_every_task_has_a_status_of_its_own():
    """The first hand is there, the second has some way to go, the third cannot do both, joints have none."""
    q, S = DUAL.neutral, ftqp.StepStatus
    far = {LEFT: DUAL.pose(q, LEFT), RIGHT: moved(DUAL.pose(q, RIGHT), 0, 0, 0.006)}
    tasks = [
        ftqp.Task(tolerance=0.005),
        ftqp.PoseTask(RIGHT, level=1, required=False),
        ftqp.PositionTask(
            LEFT, target=position(DUAL, q, LEFT) + np.array([0, 0, 0.05]), level=3, name="away"
        ),
        ftqp.PostureTask(),
    ]
    planner = started(DUAL, tasks=tasks, at=q)
    step = planner.step(q, None, far)
    statuses = {name: one.status for name, one in step.tasks.items()}
    assert statuses == {LEFT: S.OK, RIGHT: S.LAGGING, "away": S.RELAXED, "PostureTask": None}
    assert step.status is S.OK, "neither of those is required"
    step, _ = run(planner, q, far)
    assert step.tasks[RIGHT].status is S.OK and step.copy().tasks["away"].status is S.RELAXED


def test_a_copy_of_a_step_keeps_what_is_left_of_each_task():
    q = DUAL.neutral
    planner = started(DUAL, tasks=[ftqp.Task(), ftqp.PoseTask(RIGHT, level=1, rows=("x", "rz"))], at=q)
    goal = {LEFT: DUAL.pose(q, LEFT), RIGHT: moved(DUAL.pose(q, RIGHT), 5.0, 0, 0)}
    kept = planner.step(q, None, goal).copy()
    slack = kept.tasks[RIGHT].slack.copy()
    planner.step(q, None, {RIGHT: DUAL.pose(q, RIGHT)})
    assert slack.shape == (2,) and np.abs(slack).max() > 1.0
    assert (kept.tasks[RIGHT].slack == slack).all()


@pytest.mark.parametrize("target", [(3.0, 0.0, 0.5), (0.5, -1.5, 0.9)])
def test_a_hand_stretched_towards_what_it_cannot_reach_does_not_swing(level, target):
    """Its second derivative takes part: without, it accelerates at its limits for ever."""
    q = DUAL.neutral
    tasks = [ftqp.Task(), ftqp.PositionTask(RIGHT, level=1)]
    planner = ftqp.Planner(DUAL, level=level, tasks=tasks, emergency=None)
    last, _ = run(planner, q, {LEFT: DUAL.pose(q, LEFT), RIGHT: np.array(target)}, ticks=3500)
    for step in closed_loop(planner, {}, 500, last.q, last.v, reset=False):
        assert np.abs(step.a / DUAL.limits.a_max).max() < 0.05
    assert step.position_error < 1e-4


BOUNDLESS = ftqp.robots.load("panda").with_limits(v_max=1e3, a_max=1e6)
ELBOW = "panda_joint4"


def first_command(level, scheme, mode, seed, tasks):
    """x of the first tick and the planner, of a posture near whose place the targets are."""
    rng = np.random.default_rng(seed)
    limits = ftqp.robots.load("panda").limits
    q = limits.q_min + (limits.q_max - limits.q_min) * rng.uniform(0.3, 0.7, 7)
    v = 0.05 * rng.normal(size=7) if level == "acceleration" else np.zeros(7)
    place = BOUNDLESS.pose(q, ELBOW)[:3, 3] + (0, 0, 1e-7 * rng.normal())
    made = [ftqp.PositionTask(ELBOW, rows="z", level=one, target=place, name=f"{one}") for one in tasks]
    planner = ftqp.Planner(
        BOUNDLESS, 1e-3, level=level, scheme=scheme, torque_limits=False,
        tasks=[ftqp.Task("position", mode=mode), *made],
    )  # fmt: skip
    planner.reset(q, v)
    T = BOUNDLESS.pose(q)
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
    step, _ = run(planner, q, ftqp.Target(pose=robot.pose(q)), ticks=2000)
    assert abs(robot.pose(step.q, elbow)[1, 3] - up[1]) < 1e-3
    for hand in robot.tips:
        assert np.abs(robot.pose(step.q, hand) - robot.pose(robot.neutral, hand))[:3, 3].max() < 2e-5


@pytest.mark.parametrize("task", [
    ftqp.PositionTask(ELBOW, target=(0, 0, 3.0), level=2, name="far"),
    ftqp.CentreOfMass(target=(1.0, 0, 1.0), level=2, name="far"),
    ftqp.PostureTask(BOUNDLESS.neutral + 0.4, level=2, name="far"),
])  # fmt: skip
def test_an_arm_rests_where_level_2_cannot_be_reached(level, task):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, 2e-3, level=level, tasks=[ftqp.Task("position"), task])
    for k, step in enumerate(closed_loop(planner, ftqp.Target(pose=robot.pose(robot.neutral)), 2250)):
        assert k < 2000 or np.abs(step.a / robot.limits.a_max).max() < 0.06
    assert step.position_error < 1e-5 and step.status is ftqp.StepStatus.OK


def test_level_2_arrives_where_level_3_is_outweighed_by_the_scheme():
    """A hand turns upside down only where the scheme, which would rather rest, has what is left."""
    robot, left = ftqp.robots.load("panda"), {}
    for level in (2, 3):
        look = ftqp.AxisTask(HAND, towards=(0, 0, 3.0), level=level, name="look")
        planner = ftqp.Planner(robot, 2e-3, tasks=[ftqp.Task("position"), look])
        *_, step = closed_loop(planner, ftqp.Target(pose=robot.pose(robot.neutral)), 4500)
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
    for step in closed_loop(planner, ftqp.Target(pose=robot.pose(robot.neutral)), 300):
        assert step.status is ftqp.StepStatus.OK


@pytest.mark.parametrize("weight", [1e-200, 1e300])
def test_only_the_ratio_of_weights_counts_on_level_2(weight):
    commands = []
    for one in (1.0, weight):
        tasks = [
            ftqp.Task("position"),
            ftqp.PositionTask(ELBOW, target=(0.3, 0.1, 0.6), level=2, weight=one),
            ftqp.PostureTask(BOUNDLESS.neutral + 0.1, level=2, weight=one),
        ]
        planner = ftqp.Planner(BOUNDLESS, 1e-3, tasks=tasks)
        planner.reset(BOUNDLESS.neutral)
        step = planner.step(BOUNDLESS.neutral, None, ftqp.Target(pose=BOUNDLESS.pose(BOUNDLESS.neutral)))
        assert step.status is ftqp.StepStatus.OK
        commands.append(step.a.copy())
    assert commands[0] == pytest.approx(commands[1], rel=1e-9)
