"""External solvers give the command of the active set, and none of their failures reaches the arm."""

import numpy as np
import pytest
from tests.going import closed_loop, started, targets_along
from tests.puppet import Puppet, writes

import ftqp
from ftqp.qp.adapters.backend import Claim

DT = 2e-3
TOLERANCE = {
    "dtrnn": 1e-9,
    "daqp": 1e-9,
    "quadprog": 1e-9,
    "qpsolvers:daqp": 1e-9,
    "proxqp": 1e-6,
    "osqp": 1e-6,
}


def side_by_side(robot, path, backend, ticks, **options):
    """Steps of an external and of the in-kernel planner at the same states, through a lock of joint 3."""
    options = {"task": ftqp.Task(degrade=())} | options  # only the active set can give up rows
    planner = started(robot, DT, backend=backend, **options)
    reference = started(robot, DT, **options)
    assert planner.backend == backend
    q, v, targets = robot.neutral.copy(), np.zeros(robot.nv), targets_along(path, ticks, DT)
    for k in range(ticks):
        if k == ticks // 2:
            planner.report(ftqp.Locked(2))
            reference.report(ftqp.Locked(2))
        a, b = (one.step(q, v, targets.at(k)) for one in (planner, reference))
        yield a, b
        q, v = b.q.copy(), b.v.copy()


@pytest.mark.parametrize("backend", ["daqp", pytest.param("quadprog", marks=pytest.mark.solvers)])
def test_active_set_methods_agree_where_limits_bind(panda, home, level, backend):
    path = ftqp.paths.Circle(home, 0.1, duration=1.0, axes=("y", "z"))
    bound = 0
    for a, b in side_by_side(panda, path, backend, 500, level=level, emergency=None):
        assert a.status is b.status
        x, y = (a.a, b.a) if level == "acceleration" else (a.v, b.v)
        np.testing.assert_allclose(x, y, rtol=0.0, atol=TOLERANCE[backend])
        bound += bool(b.limits_active)
    assert bound > 50


@pytest.mark.parametrize("backend", ["active_set", {"name": "active_set"}, ftqp.qp.backend("active_set")])
def test_active_set_leaves_torque_rows_out_however_it_is_asked_for(panda, backend):
    """A scenario hands over an object; torques that no limit needs are then worked out by who reads them."""
    planner = ftqp.Planner(panda, backend=backend)
    planner.reset(panda.neutral)
    planner.step(panda.neutral, None, ftqp.Target(pose=panda.pose(panda.neutral)))
    assert planner.session().K.limits.on_demand == 1
    assert planner.session().K.kinematics.has_dynamics == 0


@pytest.mark.parametrize("backend", ["proxqp", "osqp"])
def test_first_order_method_that_gives_up_where_limits_bind_is_replaced_by_the_same_command(
    panda, home, level, backend
):
    """On a circle that is too fast; the substitute solves the very QP, so the command does not jump."""
    allowed = {ftqp.StepStatus.FALLBACK, ftqp.StepStatus.RELAXED, ftqp.StepStatus.OK}
    path = ftqp.paths.Circle(home, 0.1, duration=1.0, axes=("y", "z"))
    gave_up = 0
    for a, b in side_by_side(panda, path, backend, 300, level=level, emergency=None):
        assert a.status in allowed
        x, y = (a.a, b.a) if level == "acceleration" else (a.v, b.v)
        np.testing.assert_allclose(x, y, rtol=0.0, atol=1e-6)
        gave_up += a.status is ftqp.StepStatus.FALLBACK
    assert gave_up > 0


@pytest.mark.parametrize(("mode", "scheme"), [("hard", "dlsm"), ("scaled", "mvn"), ("lexicographic", "dlsm")])
def test_other_modes_and_dense_objectives_agree_too(panda, home, level, mode, scheme):
    path = ftqp.paths.Circle(home, 0.04, duration=1.4, axes=("y", "z"))
    options = {"level": level, "scheme": scheme, "task": ftqp.Task(mode=mode)}
    for a, b in side_by_side(panda, path, "daqp", 400, **options):
        assert a.status is b.status
        x, y = (a.a, b.a) if level == "acceleration" else (a.v, b.v)
        np.testing.assert_allclose(x, y, rtol=0.0, atol=1e-6)


def noise(qp):
    qp.solution[:] = np.random.default_rng(0).normal(size=len(qp.solution)) * 1e3
    return Claim.SOLVED


def raises(qp):
    raise RuntimeError("the solver broke")


def spoils(part, value):
    """A solver that writes where it may not, or what is no answer."""

    def answer(qp):
        qp.solution[:] = 0.0
        getattr(qp, part)[:] = value(qp)
        return Claim.SOLVED

    return answer


def exchanges_the_bounds(qp):
    qp.lower[:], qp.upper[:] = qp.upper.copy(), qp.lower.copy()
    return writes(1e3)(qp)


zero_motion = writes(0.0)
ANSWERS = {
    "raises": raises,
    "None": writes(0.0, None),
    "a word": writes(0.0, "SOLVED"),
    "a claim that there is none": writes(0.0, 17),
    "a float": writes(0.0, 0.5),
    "an array": writes(0.0, np.zeros(3)),
    "spoils the problem": spoils("flat", lambda qp: np.nan),
    "exchanges the bounds": exchanges_the_bounds,
    "another shape": spoils("x", lambda qp: np.zeros(99)),
    "complex numbers": spoils("x", lambda qp: np.full(qp.n, 1j)),
    "outside the box": spoils("x", lambda qp: 1e6),
    "NaN": writes(np.nan),
    "infinity": writes(np.inf),
    "huge": writes(1e308),
    "noise": noise,
    "zero": zero_motion,
    **{claim.name: lambda qp, claim=claim: claim for claim in Claim if claim is not Claim.SOLVED},
}


@pytest.mark.filterwarnings("ignore::numpy.exceptions.ComplexWarning")
@pytest.mark.parametrize("mode", ["slack", pytest.param("hard", marks=pytest.mark.slow)])
@pytest.mark.parametrize("answer", ANSWERS.values(), ids=ANSWERS)
def test_no_answer_of_a_solver_leads_to_an_unsafe_command(panda, home, level, answer, mode):
    target = ftqp.Target(pose=home, twist=[0.1, 0.1, 0.0, 0.0, 0.0, 0.0])
    task = ftqp.Task(mode=mode, calm=False)  # in calm the solver would not be asked
    planner = ftqp.Planner(panda, DT, level=level, backend=Puppet(answer), task=task, emergency=None)
    limits = panda.limits
    for step in closed_loop(planner, target, 30, events={10: lambda p: p.report(ftqp.Locked(3))}):
        assert step.status in (ftqp.StepStatus.FALLBACK, ftqp.StepStatus.RELAXED)
        assert np.isfinite(step.q).all()
        assert np.all(np.abs(step.a) <= limits.a_max * (1.0 + 1e-9))
        assert np.all(np.abs(step.v) <= limits.v_max)
        assert np.all(np.abs(step.tau) <= limits.tau_max + 1e-6)
    assert step.v[3] == 0.0
    assert step.qp.status is not ftqp.qp.SolveStatus.SOLVED


def test_backend_that_raises_is_a_failed_solver_and_the_planner_goes_on(panda, home, caplog):
    answers = [raises, raises, zero_motion, zero_motion]
    planner = ftqp.Planner(panda, DT, backend=Puppet(lambda qp: answers.pop(0)(qp)))
    planner.reset(panda.neutral)
    target = ftqp.Target(pose=home, twist=[0.1, 0, 0, 0, 0, 0])
    step = planner.step(panda.neutral, np.zeros(7), target)
    assert step.status is ftqp.StepStatus.FALLBACK and "raised" in caplog.text
    step = planner.step(panda.neutral, np.zeros(7), target)
    assert (
        step.position_error < 1e-12 and step.status is ftqp.StepStatus.FALLBACK and np.isfinite(step.a).all()
    )


@pytest.mark.parametrize("backend", ["osqp", "daqp"])
def test_a_solver_out_of_time_is_no_answer_and_says_so(panda, home, backend):
    planner = ftqp.Planner(panda, DT, backend={"name": backend, "time_limit": 1e-9}, emergency=None)
    planner.reset(panda.neutral)
    q = panda.neutral
    found = set()
    for speed in (0.1, 30.0):  # DAQP looks at the clock after some changes of the set only
        step = planner.step(q, np.zeros(7), ftqp.Target(pose=home, twist=[speed, speed, 0, 0, 0, 0]))
        assert np.isfinite(step.q).all()
        found.add((step.status, step.qp.status))
    if backend == "osqp":
        assert found == {(ftqp.StepStatus.FALLBACK, ftqp.qp.SolveStatus.OUT_OF_TIME)}


MILLISECOND = 1e-3


def follow(planner, path, ticks, fault):
    """Closed loop with a fault at tick 1000: configurations, statuses, iterations."""
    targets, fails = targets_along(path, ticks, planner.dt), {1000: lambda planner: planner.report(fault)}
    steps = closed_loop(planner, targets.at, ticks, events=fails)
    rows, status, iterations = zip(
        *((step.q.copy(), step.status, step.qp.iterations) for step in steps), strict=True
    )
    return np.array(rows), status, np.array(iterations)


def test_a_lost_joint_on_a_circle_makes_the_motion_of_the_active_set(panda, home, level):
    path = ftqp.paths.Circle(home, 0.1, duration=2.0, axes=("x", "y"))
    fault = ftqp.Locked("panda_joint3")
    task = ftqp.Task(degrade=())  # only the active set can give up rows
    planners = (
        ftqp.Planner(panda, MILLISECOND, level=level, backend=name, task=task)
        for name in ("active_set", "dtrnn")
    )
    runs = [follow(planner, path, 2000, fault) for planner in planners]
    assert runs[0][1] == runs[1][1]
    assert np.abs(runs[0][0] - runs[1][0]).max() <= 1e-6
    assert np.median(runs[1][2]) <= 1


@pytest.mark.parametrize("mode", ["slack", "hard", "scaled", "lexicographic"])
def test_a_task_out_of_reach_ends_in_the_same_status_in_every_mode(panda, home, mode):
    path = ftqp.paths.Circle(home, 0.1, duration=2.0, axes=("x", "y"))
    fault = ftqp.Locked("panda_joint4")
    settings = dict(emergency=None, task=ftqp.Task(mode=mode))
    runs = [
        follow(ftqp.Planner(panda, MILLISECOND, backend=name, **settings), path, 1200, fault)
        for name in ("active_set", "dtrnn")
    ]
    assert ftqp.StepStatus.RELAXED in runs[0][1]
    assert runs[0][1] == runs[1][1]
    assert np.abs(runs[0][0] - runs[1][0]).max() <= 1e-5
