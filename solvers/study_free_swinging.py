"""What becomes of an arm one of whose joints swings freely: robots x joints x postures x friction.

    python solvers/study_free_swinging.py --seed 3   the table of docs/free-swinging.md, about ten minutes
    python solvers/study_free_swinging.py --robots panda --joints 3 4 --dampings 0.5 --postures 5

Each run begins in a random posture with the tip in motion. The joint fails at once and is announced, the
target brakes the tip in 0.4 s and stands; 4 s at 1 kHz on the arm of the simulation, whose end stops are at
the range and plastic. Beside the planner the same arm only brakes.

kept: what the planner decided to keep was kept: no stop, no healthy joint more than 2 % too fast, the tip
within 5 mm of its place in the end. hits: the free joint met a stop.
"""

import argparse
import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import ftqp
from ftqp.sim.plants.arm_model import Arm

DT = 1e-3
BRAKING = 0.4
RESULTS = Path(__file__).parent / "results"


@dataclass
class Run:
    """One run, and the same arm that only brakes."""

    robot: str
    joint: int
    damping: float
    posture: int
    decided: str
    kept: bool
    gave_up: float | None
    hit: float
    energy: float
    hit_braking: float
    energy_braking: float
    stopped: float | None
    overspeed: float
    torque: float
    deviation: float
    tip_end: float
    step_us: float
    refused: tuple[int, ...]


def start(robot, rng):
    """A posture in the middle 80 % of the range and a speed, far from singular."""
    low, high = robot.limits.q_min, robot.limits.q_max
    arm = Arm(robot)
    while True:
        q = low + (high - low) * rng.uniform(0.1, 0.9, robot.nv)
        arm.tip(q)
        J = arm._session.K.kinematics.J[:, : robot.nv].copy()
        J[3:] *= 0.15
        if np.linalg.svd(J, compute_uv=False)[-1] / 0.15 < 0.15:
            continue
        direction = rng.normal(size=3)
        twist = np.zeros(6)
        twist[:3] = rng.uniform(0.1, 0.25) * direction / np.linalg.norm(direction)
        v = np.linalg.pinv(J) @ twist
        if (np.abs(v) <= 0.5 * robot.limits.v_max).all():
            return q, v


class Physics:
    """The arm in MuJoCo, driven by torques, its stops at the range; it tells of impacts as the other does."""

    def __init__(self, robot):
        from ftqp.sim.plants.joint_servo import JointServo
        from ftqp.sim.plants.mujoco_plant import MujocoPlant
        from ftqp.sim.plants.true_arm import TrueArm

        self.robot = robot
        self._plant = MujocoPlant(robot, DT, JointServo(robot, "torque"), TrueArm(end_stops=0.0))
        self.q, self.v, self.impacts, self._joint = self._plant.q, self._plant.v, (), None

    def reset(self, q, v):
        self._plant.reset(q, v)

    def fail(self, fault):
        self._plant.fail(fault)
        self._joint = fault.joint

    def advance(self, command):
        i, limits = self._joint, self.robot.limits
        before = float(self.v[i])
        self._plant.advance(command)
        after, room = float(self.v[i]), min(self.q[i] - limits.q_min[i], limits.q_max[i] - self.q[i])
        if room < 0.01 and abs(before) > 0.05 and abs(after) < 0.5 * abs(before):
            self.impacts = (*self.impacts, SimpleNamespace(speed=abs(before)))


PLANTS = {"kinematic": lambda robot: ftqp.KinematicPlant(robot, DT), "mujoco": Physics}


def braking(robot, joint, damping, q, v, ticks, physics):
    """Largest impact speed and its energy when the others only brake."""
    plant, arm = PLANTS[physics](robot), Arm(robot)
    plant.reset(q, v)
    plant.fail(ftqp.FreeSwinging(joint, damping=damping))
    return impact_of(plant, arm, joint, (brake(robot, plant, arm, joint, damping) for _ in range(ticks)))


def brake(robot, plant, arm, i, damping):
    """The command with which every joint brakes as hard as it can, and the torques for it."""
    a = np.clip(-plant.v / DT, -robot.limits.a_max, robot.limits.a_max)
    M, h = arm.dynamics(plant.q, plant.v)
    a[i] = 0.0
    at_stop = min(plant.q[i] - robot.limits.q_min[i], robot.limits.q_max[i] - plant.q[i]) < 1e-3
    a[i] = 0.0 if at_stop else -(h[i] + M[i] @ a + damping * plant.v[i]) / M[i, i]
    return SimpleNamespace(
        q=plant.q + DT * plant.v + 0.5 * DT**2 * a,
        v=plant.v + DT * a,
        tau=M @ a + h,
        brakes=np.zeros(len(a), bool),
    )


def impact_of(plant, arm, joint, commands):
    speed = energy = 0.0
    for command in commands:
        known = len(plant.impacts)
        q, v = plant.q.copy(), plant.v.copy()
        plant.advance(command)
        for hit in plant.impacts[known:]:
            if hit.speed > speed:
                M, _ = arm.dynamics(q, v)
                speed, energy = hit.speed, 0.5 * M[joint, joint] * hit.speed**2
    return speed, energy


def one(robot, joint, damping, posture, q0, v0, seconds, physics):
    ticks = round(seconds / DT)
    plant, arm = PLANTS[physics](robot), Arm(robot)
    planner = ftqp.Planner(robot, DT, drive="torque" if physics == "mujoco" else "position")
    fault = ftqp.FreeSwinging(joint, damping=damping)
    plant.reset(q0, v0)
    planner.reset(q0, v0)
    plant.fail(fault)
    planner.report(fault)
    pose = arm.tip(q0).copy()
    J = arm._session.K.kinematics.J[:3, : robot.nv].copy()
    tip_v = J @ v0
    goal = pose[:3, 3] + 0.5 * BRAKING * tip_v
    seen = SimpleNamespace(rows=(), gave_up=None, stopped=None, over=0.0, torque=0.0, far=0.0, slow=0.0)
    limits, healthy = robot.limits, np.arange(robot.nv) != joint

    def commands():
        for k in range(ticks):
            t = min(k * DT, BRAKING)
            now = pose.copy()
            now[:3, 3] += tip_v * (t - 0.5 * t * t / BRAKING)
            twist, acceleration = np.zeros(6), np.zeros(6)
            if k * DT < BRAKING:
                twist[:3], acceleration[:3] = tip_v * (1 - t / BRAKING), -tip_v / BRAKING
            target = ftqp.Target(pose=now, twist=twist, acceleration=acceleration)
            began = time.thread_time()
            step = planner.step(plant.q, plant.v, target)
            if k > 2:
                seen.slow = max(seen.slow, time.thread_time() - began)
            mode = planner._session.K.free.mode
            if mode in (1, 4) and not seen.rows:
                seen.rows = step.rows
            if mode in (2, 3) and seen.gave_up is None:
                seen.gave_up = k * DT
            if step.status.name == "STOPPED" and seen.stopped is None:
                seen.stopped = k * DT
            if not plant.impacts:
                seen.over = max(seen.over, (np.abs(plant.v) / limits.v_max)[healthy].max())
                seen.torque = max(seen.torque, (np.abs(step.tau) / limits.tau_max)[healthy].max())
            seen.far = max(seen.far, np.linalg.norm(arm.tip(plant.q)[:3, 3] - goal))
            yield step

    speed, energy = impact_of(plant, Arm(robot), joint, commands())
    end = float(np.linalg.norm(arm.tip(plant.q)[:3, 3] - goal))
    brakes = braking(robot, joint, damping, q0, v0, ticks, physics)
    kept = bool(seen.rows) and seen.gave_up is None and not plant.impacts
    kept = kept and seen.over <= 1.02 and end <= 0.005
    decided = {6: "pose", 5: "axis", 3: "position", 0: "none"}[len(seen.rows)]
    return Run(robot.name, joint + 1, damping, posture, decided, kept, seen.gave_up, speed, energy, *brakes,
               seen.stopped, seen.over, seen.torque, seen.far, end, 1e6 * seen.slow,
               tuple(int(r) for r in planner._free._memory.F.refused) if planner._free else ())  # fmt: skip


def table(runs):
    """The table of the docs, (lines)."""
    lines = ["| robot | free joint | d | pose / some rows kept / no stop / hits [%] "
             "| impact, braking > planner [rad/s] | energy [J] |", "|---|---|---|---|---|---|"]  # fmt: skip
    keys = sorted({(r.robot, r.damping, r.joint) for r in runs})
    groups = [(key, [r for r in runs if (r.robot, r.damping, r.joint) == key]) for key in keys]
    groups += [((robot, d, "all"), [r for r in runs if (r.robot, r.damping) == (robot, d)])
               for robot, d in sorted({(r.robot, r.damping) for r in runs})]  # fmt: skip
    for (robot, d, joint), group in groups:
        n = len(group)
        pose = sum(r.kept and r.decided == "pose" for r in group)
        kept = sum(r.kept for r in group)
        hits = sum(r.hit > 0.0 for r in group)
        share = [round(100 * x / n) for x in (pose, kept, n - kept - hits, hits)]
        mean = [np.mean([getattr(r, name) for r in group]) for name in
                ("hit_braking", "hit", "energy_braking", "energy")]  # fmt: skip
        lines.append(
            f"| {robot} | {joint} | {d:g} | {' / '.join(map(str, share))} | {mean[0]:.1f} > {mean[1]:.1f} "
            f"| {mean[2]:.0f} > {mean[3]:.0f} |"
        )
    return lines


def laws(runs):
    """What of the laws can be seen, (lines)."""
    yes = [r for r in runs if r.decided != "none"]
    wrong = [r for r in yes if not r.kept]
    worse = [r for r in runs if r.hit > r.hit_braking + 0.05]
    fast = [r for r in runs if r.overspeed > 1.02]
    strong = [r for r in runs if r.torque > 1.0 + 1e-6]
    given = [r for r in runs if r.gave_up is not None and r.damping >= 0.5]
    late = [
        r for r in given if r.stopped is None or r.stopped > 1.5 + (r.gave_up if r.gave_up > 0.1 else 0.0)
    ]
    times = [r.stopped for r in given if r.stopped is not None and r.gave_up < 0.1]
    return [
        f"{len(runs)} runs",
        f"1 healthy joint more than 2 % too fast before an impact: {len(fast)}; torque beyond its limit: "
        f"{len(strong)}, at most {max((r.torque for r in runs), default=0):.2f}",
        f"2 impact harder than braking by more than 0.05 rad/s: {len(worse)}, "
        f"at most {max((r.hit - r.hit_braking for r in runs), default=0):.2f} harder",
        f"3 given up and not STOPPED within 1.5 s, d >= 0.5: {len(late)} of {len(given)}, "
        f"latest {max(times, default=0):.2f} s",
        f"4 wrong yes: {len(wrong)} of {len(runs)} runs, {len(yes)} yes; "
        f"of these given up later {sum(r.gave_up is not None for r in wrong)}, "
        f"hits {sum(r.hit > 0 for r in wrong)}",
        f"5 slowest step {max(r.step_us for r in runs):.0f} us, median of the slowest "
        f"{np.median([r.step_us for r in runs]):.0f} us",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", nargs="+", default=["panda", "iiwa14", "xarm7"])
    parser.add_argument("--joints", nargs="+", type=int, default=list(range(1, 8)), help="from 1")
    parser.add_argument("--dampings", nargs="+", type=float, default=[0.0, 0.5, 3.0])
    parser.add_argument("--postures", type=int, default=10)
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--physics", choices=sorted(PLANTS), default="kinematic")
    parser.add_argument("--name", help="keep the runs as results/NAME.json and the table as results/NAME.md")
    given = parser.parse_args()
    runs = []
    for name in given.robots:
        robot = ftqp.robots.load(name)
        for joint in given.joints:
            rng = np.random.default_rng([given.seed, joint])
            starts = [start(robot, rng) for _ in range(given.postures)]
            for damping in given.dampings:
                for posture, (q, v) in enumerate(starts):
                    runs.append(one(robot, joint - 1, damping, posture, q, v, given.seconds, given.physics))
    lines = [*table(runs), "", *laws(runs)]
    print("\n".join(lines))
    if given.name is not None:
        (RESULTS / f"{given.name}.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
        (RESULTS / f"{given.name}.json").write_text(json.dumps([asdict(r) for r in runs]), encoding="utf-8")


if __name__ == "__main__":
    main()
