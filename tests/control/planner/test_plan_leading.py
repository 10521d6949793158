"""A plan leads the null space from where the tip is, at both levels, whoever leads the tip."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from tests.going import closed_loop, started, targets_along

import ftqp
from ftqp.core.errors import InputError

DT, DURATION, ROWS = 2e-3, 2.0, 100
TICKS = round(DURATION / DT)
Q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])


@dataclass
class MadePlan:
    """A plan of rows that a test has made."""

    q: np.ndarray
    t: np.ndarray
    asked: list = field(default_factory=list)
    after: tuple | None = None
    failed: list = field(default_factory=list)

    def of(self, robot):
        if robot.name != "panda":
            raise InputError("another arm")
        return self

    def remaining(self, q, at, faults):
        self.asked.append((q, at, faults))
        return ()

    def continuation(self, q, at, faults):
        self.failed.append((at, faults))
        return self.after


def turned(robot, q, angle):
    """The arm moved along its self-motion by so much of its own direction."""
    u = np.linalg.svd(robot.jacobian(q))[2][-1]
    return q + angle * u * np.sign(np.linalg.det(np.vstack([u, robot.jacobian(q)])))


def onto(robot, q, pose):
    """Newton's method to a pose with plain numpy."""
    for _ in range(10):
        now = robot.pose(q)
        turn = 0.5 * sum(np.cross(now[:3, i], pose[:3, i]) for i in range(3))
        q = q + np.linalg.pinv(robot.jacobian(q)) @ np.r_[pose[:3, 3] - now[:3, 3], turn]
    return q


def made(robot, path, theta=0.3, t=None):
    """A plan on a path, with a self-motion of theta rad/s on the way that rests at both ends."""
    t = np.linspace(0.0, path.duration, ROWS + 1) if t is None else t
    q, rows = Q0.copy(), [Q0.copy()]
    for before, pose in zip(t, path.sample(t[1:]).pose, strict=False):
        swing = np.sin(np.pi * before / path.duration) ** 2
        q = onto(robot, turned(robot, q, theta * swing * (t[1] - t[0])), pose)
        rows.append(q)
    return MadePlan(np.array(rows), t)


def at(plan, time):
    """The plan's posture at a time, between rows by straight lines."""
    return np.array([np.interp(time, plan.t, column) for column in plan.q.T])


@pytest.mark.long
def test_the_joints_are_where_the_plan_has_them_all_the_way(panda, level):
    path = ftqp.paths.Line(panda.pose(Q0), [0, 0.15, 0], duration=DURATION)
    plan = made(panda, path)
    assert np.abs(plan.q[-1] - made(panda, path, 0.0).q[-1]).max() > 0.1  # another way than least norm
    planner = ftqp.Planner(panda, dt=DT, level=level, plan=plan)
    for k, step in enumerate(closed_loop(planner, targets_along(path, TICKS, DT).at, TICKS, Q0)):
        assert step.status is ftqp.StepStatus.OK
        assert np.abs(step.q - at(plan, (k + 1) * DT)).max() < 3e-3
    assert planner.plan_time == pytest.approx(DURATION, abs=0.05)


@pytest.mark.long
def test_after_a_lock_the_verified_continuation_leads_and_after_a_repair_the_plan(panda):
    path = ftqp.paths.Line(panda.pose(Q0), [0, 0.15, 0], duration=DURATION)
    plan, other = made(panda, path), made(panda, path, -0.3)
    planner = ftqp.Planner(panda, dt=DT, level="velocity", task=ftqp.Task(rows="position"), plan=plan)
    plan.failed.clear()  # of a rehearsal
    planner.reset(Q0)
    assert plan.failed == []
    plan.after = ROWS // 4, other.q[ROWS // 4 :]
    targets, lock = targets_along(path, TICKS, DT), ftqp.Locked("panda_joint7")
    *_, step = closed_loop(planner, targets.at, TICKS // 4, Q0, reset=False)
    planner.report(lock)
    ((time, faults),) = plan.failed
    assert time == pytest.approx(planner.plan_time) and faults == (lock,)
    more = lambda k: targets.at(TICKS // 4 + k)  # noqa: E731
    *_, step = closed_loop(planner, more, TICKS // 4, step.q, step.v, reset=False)
    led_by_other = np.abs(step.q - other.q[round(planner.plan_time / plan.t[1])])[:6].max()
    assert led_by_other < 0.01 < 0.1 < np.abs(plan.q[-1] - other.q[-1])[:6].max()
    planner.withdraw("panda_joint7")
    more = lambda k: targets.at(TICKS // 2 + k)  # noqa: E731
    *_, step = closed_loop(planner, more, TICKS // 2, step.q, step.v, reset=False)
    assert np.abs(step.q - plan.q[-1])[:6].max() < 0.02


@pytest.mark.long
def test_a_path_that_is_slowed_down_and_stopped_takes_the_plan_with_it(panda):
    path = ftqp.paths.Line(panda.pose(Q0), [0, 0.15, 0], duration=DURATION)
    plan = made(panda, path)
    planner = ftqp.Planner(panda, dt=DT, level="velocity", plan=plan, task=ftqp.Task(mode="scaled"))
    follower = ftqp.PathFollower(planner, path)
    events = {
        201: lambda planner: setattr(planner, "speed", 0.3),
        600: lambda planner: planner.stop(),
        800: lambda planner: planner.resume(),
        1500: lambda planner: setattr(planner, "speed", 1.0),
    }
    for step in closed_loop(follower, None, 4 * TICKS, Q0, events=events):
        assert np.abs(step.q - at(plan, follower.progress)).max() < 0.01
    assert follower.status is ftqp.PathStatus.DONE
    assert planner.plan_time == pytest.approx(DURATION, abs=0.05)


@pytest.mark.long
def test_a_start_off_the_plan_is_drawn_onto_it(panda):
    path = ftqp.paths.Line(panda.pose(Q0), [0, 0.15, 0], duration=DURATION)
    plan = made(panda, path)
    away = onto(panda, turned(panda, Q0, 0.2), path.start)
    planner = ftqp.Planner(panda, dt=DT, level="velocity", plan=plan)
    places = path.sample(DT * np.arange(TICKS)).pose
    *_, step = closed_loop(planner, ftqp.Targets(places).at, TICKS, away)
    assert np.abs(away - Q0).max() > 0.08
    assert np.abs(step.q - plan.q[-1]).max() < 5e-3


def test_options_beside_constraints_are_ways_out_as_a_plan_knows_of_no_constraint(panda):
    plan = made(panda, ftqp.paths.Line(panda.pose(Q0), [0, 0.15, 0], duration=DURATION))
    kept = ftqp.Keep("panda_joint7", above=(-2.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0))
    for constraints in ((), (kept,)):
        planner = started(panda, DT, plan=plan, constraints=constraints, at=Q0)
        kinds = {option.kind for option in planner.options()}
        assert (len(plan.asked), "stop" in kinds) == (1, bool(constraints)), kinds


@pytest.mark.long
def test_what_a_plan_cannot_lead_is_refused(panda):
    path = ftqp.paths.Line(panda.pose(Q0), [0, 0.15, 0], duration=DURATION)
    plan = made(panda, path)
    with pytest.raises(InputError, match="'mvn' leads to no posture"):
        ftqp.Planner(panda, plan=plan, scheme="mvn")
    with pytest.raises(InputError, match="'pseudoinverse' leads to no posture"):
        ftqp.Planner(panda, plan=plan, scheme="pseudoinverse", level="velocity")
    with pytest.raises(InputError, match="posture and plan both say"):
        ftqp.Planner(panda, plan=plan, posture=Q0)
    with pytest.raises(InputError, match="another arm"):
        ftqp.Planner(ftqp.robots.load("iiwa14"), plan=plan)
    with pytest.raises(InputError, match=r"expected one of ftqp\.analysis\.plan"):
        ftqp.Planner(panda, plan=plan.q)
    with pytest.raises(InputError, match="uneven times"):
        ftqp.Planner(panda, plan=MadePlan(plan.q, plan.t**2))
    for times in (plan.t * np.nan, plan.t[::-1], np.where(plan.t == plan.t[5], np.nan, plan.t)):
        with pytest.raises(InputError, match="uneven times"):
            ftqp.Planner(panda, plan=MadePlan(plan.q, times))
    with pytest.raises(InputError, match=r"plan\.q"):
        ftqp.Planner(panda, plan=MadePlan(plan.q[:, :6], plan.t))
    with pytest.raises(InputError, match="follows a plan"):
        ftqp.Planner(panda, plan=plan).what_ifs()
    with pytest.raises(InputError, match="a plan of another end effector"):
        ftqp.Planner(panda, plan=plan).tool(np.eye(4))
    with pytest.raises(InputError, match=r"call planner\.reset"):
        ftqp.Planner(panda).options()
