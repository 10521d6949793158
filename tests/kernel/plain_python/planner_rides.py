"""Short rides, one for each way in which a planner can be made and led."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from riding import DT, arm, led, ride, spatial, told, torque_arm

import ftqp


@ride
def torque_drive_with_an_unresponsive_joint() -> Any:
    robot = arm(3)
    planner = ftqp.Planner(robot, DT, drive="torque", task=ftqp.Task(rows=("x", "y")), emergency=None)
    return led(planner, 45, moves=torque_arm(robot, stuck=1), measures_v=False, speed=0.1)


@ride
def torque_drive_told_of_the_joint_that_failed() -> Any:
    robot = arm(4)
    planner = ftqp.Planner(robot, DT, drive=ftqp.Drive(kind="torque", latency=DT), emergency=None)
    events = {14: lambda: planner.report(ftqp.Locked(1)), 24: lambda: planner.withdraw(1)}
    return led(planner, 30, moves=torque_arm(robot, friction=0.05), events=events, measures_v=False)


@ride
def velocity_drive_that_lags() -> Any:
    robot = arm()
    drive = ftqp.Drive(kind="velocity", bandwidth=60.0, latency=2 * DT)
    planner = ftqp.Planner(robot, DT, drive=drive, noise=ftqp.Noise(q=1e-4), level="velocity", emergency=None)

    def moves(k: int, q: Any, v: Any, step: ftqp.Step) -> tuple[Any, Any]:
        v = v + 0.4 * (step.v - v)
        return q + DT * v, v

    rng = np.random.default_rng(1)
    events = {12: lambda: planner.report(ftqp.Locked(2))}
    return led(planner, 30, moves=moves, events=events, measures_v=False,
               sample=lambda k, q: q + 1e-4 * rng.standard_normal(4))  # fmt: skip


@ride
def position_drive_with_a_lead_and_a_sensor_that_drops_out() -> Any:
    robot = arm()
    drive = ftqp.Drive(kind="position", bandwidth=80.0, takes_velocity=False)
    planner = ftqp.Planner(robot, DT, drive=drive, emergency=None)

    def moves(k: int, q: Any, v: Any, step: ftqp.Step) -> tuple[Any, Any]:
        return q + 0.5 * (step.q - q), v

    gone = np.array([0.0, np.nan, 0.0, 0.0])
    return led(planner, 30, moves=moves, measures_v=False, sample=lambda k, q: q + gone * (k in (9, 10)))


@ride
def target_that_runs_away_and_stops_the_arm() -> Any:
    return led(ftqp.Planner(arm(), DT), 40, speed=3.0)


@ride
def torque_limits_that_give_way() -> Any:
    planner = ftqp.Planner(spatial(), DT, emergency=None)
    for j in range(7):
        planner.report(ftqp.Degraded(j, torque=0.15, acceleration=0.05))
    return led(planner, 4)


@ride
def directional_damping_and_manipulability() -> Any:
    task = ftqp.Task(mode="hard", damping=ftqp.DirectionalDamping())
    planner = ftqp.Planner(spatial(), DT, level="velocity", task=task, emergency=None)
    robot = arm()
    other = ftqp.Planner(robot, DT, scheme="mvn_manipulability", emergency=None)
    return [led(planner, 6), led(other, 6)]


@ride
def modes_and_instant_locks() -> Any:
    said = []
    for level in ("acceleration", "velocity"):
        for mode, reset in (("scaled", "task"), ("lexicographic", "momentum"), ("hard", "kinematic")):
            planner = ftqp.Planner(arm(), DT, level=level, task=ftqp.Task(mode=mode), emergency=None)
            lock = ftqp.Locked(1, mode="instant", reset=reset)
            said.append(led(planner, 8, events={5: lambda p=planner, f=lock: p.report(f)}))
    return said


@ride
def bounds_for_comparison() -> Any:
    said = []
    for level in ("acceleration", "velocity"):
        for bounds in ("jin", "one_step"):
            said.append(led(ftqp.Planner(arm(), DT, level=level, bounds=bounds, emergency=None), 6))
    return said


@ride
def closed_forms() -> Any:
    said = []
    schemes: tuple[Any, ...] = (
        "pseudoinverse",
        {"name": "weighted_pseudoinverse", "weights": [1.0, 2.0, 3.0, 1.0]},
        *({"name": "singularity_robust", "rule": rule} for rule in ("row", "bound")),
        "approximate_pseudoinverse",
    )
    for scheme in schemes:
        robot = spatial() if scheme == "approximate_pseudoinverse" else arm()
        planner = ftqp.Planner(robot, DT, level="velocity", scheme=scheme, emergency=None)
        said.append(led(planner, 6, events={3: lambda p=planner: p.report(ftqp.Locked(1))}))
    return said


@ride
def solvers_of_others_and_the_network() -> Any:
    said = []
    for backend in ("daqp", "dtrnn"):
        for level in ("acceleration", "velocity"):
            said.append(led(ftqp.Planner(arm(3), DT, level=level, backend=backend, emergency=None), 4))
    return said


@ride
def path_by_its_progress() -> Any:
    said = []
    for backend in ("active_set", "daqp", "dtrnn"):
        robot = arm()
        planner = ftqp.Planner(robot, DT, level="velocity", task=ftqp.Task(mode="scaled"), backend=backend)
        path = ftqp.paths.Line(robot.pose(robot.neutral), (0.0, 0.2, 0.0), duration=0.3)
        follower, q, v = ftqp.PathFollower(planner, path), robot.neutral.copy(), np.zeros(4)
        follower.reset(q)
        for k in range(16 if backend == "active_set" else 4):
            if k == 8:
                planner.report(ftqp.Locked(1))
            step = follower.step(q, v)
            said.append([*told(step), follower.progress, follower.rate])
            q, v = step.q.copy(), step.v.copy()
    return said


@ride
def path_that_leaves_the_workspace() -> Any:
    robot = arm()
    planner = ftqp.Planner(robot, DT, task=ftqp.Task(mode="scaled"), emergency=None)
    start = robot.neutral + np.array([0.0, -0.3, -0.3, -0.3])
    line = ftqp.paths.Line(robot.pose(start), (1.2 * robot.length, 0.0, 0.0), duration=1.5)
    follower, q, v, said = ftqp.PathFollower(planner, line), start.copy(), np.zeros(4), []
    follower.reset(q)
    for _ in range(60):
        step = follower.step(q, v)
        said.append([*told(step), follower.progress])
        q, v = step.q.copy(), step.v.copy()
    return said


@ride
def tool_held_above_a_base_that_moves() -> Any:
    said = []
    for backend, observer, priority in (
        ("active_set", ftqp.Observer(), "weighted"),
        ("active_set", None, "position_first"),
        ("daqp", None, "weighted"),
        ("dtrnn", None, "weighted"),
    ):
        robot = spatial()
        task = ftqp.Task(priority=priority) if priority != "weighted" else ftqp.Task()
        planner = ftqp.Planner(robot, DT, level="velocity", backend=backend, emergency=None, task=task)
        follower = ftqp.InertialTask(planner, ftqp.MovingBase(observer=observer))
        q, v = robot.neutral.copy(), np.zeros(7)
        follower.reset(q)
        home = robot.pose(q)
        for k in range(8 if backend == "active_set" else 3):
            if k == 5:
                planner.report(ftqp.Locked(2))
            base = np.eye(4)
            base[:3, 3] = 0.02 * np.sin(0.3 * k), 0.0, 0.01 * k
            step = follower.step(q, v, ftqp.Target(pose=home), tip=base @ robot.pose(q))
            said.append(told(step))
            q, v = step.q.copy(), step.v.copy()
    return said


@ride
def joint_that_swings_freely() -> Any:
    planner = ftqp.Planner(spatial(), 2e-3, task=ftqp.Task(rows="position"), emergency=None)
    return led(planner, 14, speed=0.0, events={2: lambda: planner.report(ftqp.FreeSwinging(5, damping=0.5))})


@ride
def ways_to_a_goal() -> Any:
    said = []
    for what in ("posture", "pose"):
        robot = arm()
        planner = ftqp.Planner(robot, DT)
        q, v = robot.neutral.copy(), np.zeros(4)
        planner.reset(q)
        goal = q + np.array([0.1, -0.05, 0.02, 0.0])
        way = ftqp.GoTo(planner, q=goal) if what == "posture" else ftqp.GoTo(planner, pose=robot.pose(goal))
        for k in range(12):
            if k == 8:
                planner.report(ftqp.Locked(0))
            step = way.step(q, v)
            said.append(told(step))
            q, v = step.q.copy(), step.v.copy()
    return said


@dataclass
class Led:
    """A plan of postures that leads the null space."""

    q: Any
    t: Any

    def of(self, robot: ftqp.Robot) -> "Led":
        return self

    def remaining(self, q: Any, at: float, faults: Any) -> tuple[()]:
        return ()

    def continuation(self, q: Any, at: float, faults: Any) -> tuple[int, Any]:
        return 2, np.array(self.q[2:]) + 0.05


@ride
def plan_that_leads_the_null_space() -> Any:
    said = []
    for level in ("acceleration", "velocity"):
        robot = arm()
        q = robot.neutral + np.linspace(0.0, 0.1, 9)[:, None] * np.array([1.0, -1.0, 0.5, 0.5])
        plan = Led(q, np.linspace(0.0, 0.3, 9))
        planner = ftqp.Planner(robot, DT, level=level, plan=plan, emergency=None)
        said.append(led(planner, 14, events={7: lambda p=planner: p.report(ftqp.Locked(1))}))
    return said


@ride
def detector_of_failures() -> Any:
    robot = arm(3)
    planner = ftqp.Planner(robot, DT, noise=ftqp.Noise(q=1e-4), detector=ftqp.Detector(), emergency=None)
    rng = np.random.default_rng(2)

    def moves(k: int, q: Any, v: Any, step: ftqp.Step) -> tuple[Any, Any]:
        sent = step.q.copy()
        sent[1] = q[1] if k >= 25 else sent[1]
        return sent, step.v.copy()

    return led(
        planner, 45, moves=moves, measures_v=False, sample=lambda k, q: q + 1e-4 * rng.standard_normal(3)
    )


@ride
def joints_that_swing_freely_in_other_ways() -> Any:
    said = []
    for joint, level, start in ((0, "acceleration", 0.0), (6, "velocity", 0.0), (1, "velocity", 0.3)):
        robot = spatial()
        planner = ftqp.Planner(robot, 5e-3, level=level, task=ftqp.Task(rows="position"), emergency=None)
        fault = ftqp.FreeSwinging(joint, damping=0.5, friction=0.1)
        said.append(led(planner, 6, speed=start, events={2: lambda p=planner, f=fault: p.report(f)}))
    return said
