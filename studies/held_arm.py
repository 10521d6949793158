"""All joints of an arm are held for a while, as by a protective stop, and let go: how fast is the arm then?

The arm is on its way with each leader, 1 kHz, behind a position servo of 20 to 300 rad/s (critically damped,
with and without velocity feed-forward, or of first order), a velocity servo or a torque drive; it stands for
0.1 to 9 s and follows again. Printed are the fastest joint after that, as a share of its speed limit, beside
the fastest without a hold, how many motions were finished within 2 mm, and in how many a joint was blamed;
and which holds were followed by a joint faster than 1.3 times the larger of its limit and what it did without
a hold, or by a motion that was not finished. The last columns are what ten lines of damped least squares do
that go on meanwhile, on the circle of the clock, with the same servo (finished of the holds, fastest).

    python studies/held_arm.py [--quick] [--robot NAME ...]

Full study: half an hour on one core.
"""

import functools
import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from bench import study
from bench.tables import Table

import ftqp

DT, AT, AT_GOTO, TAIL = 0.001, 0.8, 0.4, 8.0
"""Period [s], when the arm is held (a `GoTo` has nearly arrived by 0.8 s), and the longest end of a run."""
HOLDS, SERVOS = (0.1, 0.3, 1.0, 3.0, 9.0), (20.0, 50.0, 94.0, 300.0)
LEADERS = ("clock", "path", "target", "goto")
DRIVES = ("position", "position without velocity", "position, first order", "velocity", "torque")
SHARE = 1.3
"""So much faster than without a hold, or than its limit, a joint may be."""
DONE, RESTS, LOOKS = 0.002, 1e-4, 0.25
"""A motion is finished within so many metres, and is over when all joints have been slower than this [rad/s]
there on two looks at this distance [s]."""


class Outcome(NamedTuple):
    """Of a motion: fastest joint after the hold, as a share of its limit, and error at the end [m]."""

    fastest: float
    error: float
    status: str
    accused: bool


class Servo:
    """An arm behind its drive."""

    def __init__(self, robot: Any, drive: str, w: float) -> None:
        self.robot, self.drive, self.w = robot, drive, w
        self.q, self.v = robot.neutral.copy(), np.zeros(robot.nv)

    def move(self, step: Any, held: bool) -> None:
        """A tick with what a step sends."""
        q, v, w = self.q, self.v, self.w
        if held:
            self.v = np.zeros_like(v)
        elif self.drive == "torque":
            a = np.linalg.solve(self.robot.mass_matrix(q), step.tau - self.robot.bias(q, v))
            self.v = v + DT * a
            self.q = q + DT * self.v
        elif self.drive == "velocity":
            self.v = v + (step.v - v) * -np.expm1(-w * DT)
            self.q = q + DT * self.v
        elif self.drive == "position, first order":
            self.q = q + (step.q - q) * -np.expm1(-w * DT)
            self.v = (self.q - q) / DT
        else:
            fed = step.v if self.drive == "position" else 0.0
            self.v = v + DT * (w * w * (step.q - q) - 2.0 * w * (v - fed))
            self.q = q + DT * self.v


class Sent(NamedTuple):
    """What the rival sends."""

    q: Any
    v: Any


def rival(robot: Any, path: Any) -> Callable[[Any, int], Any]:
    """Damped least squares led by the clock, in ten lines."""
    sent, samples = robot.neutral.copy(), path.sample(DT * np.arange(int(path.duration / DT) + 1))

    def tick(q: Any, k: int) -> Any:
        nonlocal sent
        k = min(k, len(samples.pose) - 1)
        T, J = robot.pose(q), robot.jacobian(q)
        goal, twist = samples.pose[k], samples.twist[k]
        turn = 0.5 * sum(np.cross(T[:3, i], goal[:3, i]) for i in range(3))
        wanted = twist + 5.0 * np.r_[goal[:3, 3] - T[:3, 3], turn]
        v = J.T @ np.linalg.solve(J @ J.T + 1e-4 * np.eye(6), wanted)
        v /= max(1.0, np.abs(v / robot.limits.v_max).max())
        sent = np.clip(sent + DT * v, robot.limits.q_min, robot.limits.q_max)
        return Sent(sent, v)

    return tick


def leader(planner: Any, kind: str, path: Any, goal: Any) -> Callable[[Any, int], Any]:
    """Who makes the steps."""
    if kind == "clock":
        last = int(path.duration / DT)
        s = path.sample(DT * np.arange(last + 1))
        targets = ftqp.Targets(s.pose, s.twist, s.acceleration)
        return lambda q, k: planner.step(q, None, targets.at(min(k, last)))
    if kind == "path":
        follower = ftqp.PathFollower(planner, path)
        return lambda q, k: follower.step(q)
    if kind == "goto":
        way = ftqp.GoTo(planner, pose=goal)
        return lambda q, k: way.step(q)
    led = ftqp.TargetFollower(planner, ftqp.TipLimits(speed=0.25))
    return lambda q, k: led.step(q, None, ftqp.Target(pose=goal))


def _error(robot: Any, plant: Servo, end: Any) -> float:
    """How far the tip is from where the motion ends [m]."""
    return float(np.linalg.norm(robot.pose(plant.q)[:3, 3] - end[:3, 3]))


def run(robot: Any, kind: str, drive: str, w: float, hold: float, noise: float = 0.0) -> Outcome:
    """One motion; ``kind`` "rival" is damped least squares."""
    start = robot.pose(robot.neutral)
    path = ftqp.paths.Circle(start, radius=0.05, duration=4.0)
    goal = start.copy()
    goal[:3, 3] += [-0.1, 0.2, -0.1]
    plant, planner, at = Servo(robot, drive, w), None, AT_GOTO if kind == "goto" else AT
    if kind == "rival":
        tick = rival(robot, path)
    else:
        takes = ftqp.Drive(takes_velocity=drive == "position") if "position" in drive else drive
        task = ftqp.Task(mode="scaled") if kind == "path" else None
        planner = ftqp.Planner(robot, drive=takes, task=task, noise=ftqp.Noise(q=noise))
        planner.reset(robot.neutral)
        tick = leader(planner, kind, path, goal)
    end = path.sample([path.duration]).pose[0] if kind in ("clock", "path", "rival") else goal
    rng, fastest, accused, step, over = np.random.default_rng(0), 0.0, False, None, 0
    for k in range(int((at + hold + path.duration + TAIL) / DT)):
        step = tick(plant.q + rng.normal(0.0, noise, robot.nv) if noise else plant.q, k)
        q = plant.q
        plant.move(step, at <= k * DT < at + hold)
        if not np.isfinite(plant.q).all():
            return Outcome(np.inf, np.inf, "not finite", accused)
        if k * DT >= at + hold:
            fastest = max(fastest, float((np.abs(plant.q - q) / DT / robot.limits.v_max).max()))
        if planner is not None:
            accused = accused or bool(step.brakes.any()) or bool(planner.faults)
        if k % round(LOOKS / DT) == 0 and k * DT > at + hold:
            there = np.abs(plant.v).max() < RESTS and _error(robot, plant, end) < DONE
            over = over + 1 if there and (planner is None or step.status.name == "OK") else 0
            if over == 2:
                break
    error = _error(robot, plant, end)
    return Outcome(fastest, error, "" if planner is None else step.status.name, accused)


def measured(given: Any) -> dict[str, Any]:
    """A row for each arm, leader, drive and servo."""
    holds, servos = ((0.3, 3.0), (20.0, 300.0)) if given.quick else (HOLDS, SERVOS)
    rows = []
    for name in given.robot:
        robot = ftqp.robots.load(name)
        other = functools.cache(functools.partial(run, robot, "rival"))
        for kind, drive in itertools.product(LEADERS, DRIVES):
            for w in servos if drive != "torque" else (0.0,):
                free = run(robot, kind, drive, w, 0.0)
                found = [run(robot, kind, drive, w, hold) for hold in holds]
                within = [one.fastest <= SHARE * max(1.0, free.fastest) for one in found]
                done = [one.error < DONE and one.status == "OK" for one in found]
                ill = [f"{hold:g}" for hold, a, b in zip(holds, within, done, strict=True) if not (a and b)]
                rivals = [other(drive, w, hold) for hold in holds] if w else []
                rows.append((
                    name, kind, drive, f"{w:g}", f"{sum(within)} of {len(found)}", f"{sum(done)}",
                    f"{sum(one.accused for one in found)}", " ".join(ill) or "-",
                    f"{max(one.fastest for one in found):.2f}", f"{free.fastest:.2f}",
                    f"{sum(one.error < DONE for one in rivals)}" if rivals else "-",
                    f"{max(one.fastest for one in rivals):.2f}" if rivals else "-",
                ))  # fmt: skip
    return {"rows": rows}


def tables(found: dict[str, Any]) -> list[Table]:
    """All of them."""
    heads = (
        "arm", "leader", "drive", "servo", "within", "finished", "accused", "not", "fastest", "without",
        "rival: finished", "fastest",
    )  # fmt: skip
    return [Table(title="Arms that are held and let go", headings=heads, rows=found["rows"])]


if __name__ == "__main__":
    parser = study.options(__doc__, "held_arm", "two holds and two servos")
    parser.add_argument("--robot", nargs="+", default=["panda"], help="robots of the catalog")
    study.on_record(parser.parse_args(), "Arms that are held", measured, tables, ())
