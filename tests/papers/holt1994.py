"""The experiments of Holt and Desrochers, NASA N94-26281, recomputed."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

import ftqp
from ftqp.control.task.bounds import Jin
from ftqp.sim.base.disturbances import Recorded, Sinusoid, Step
from ftqp.sim.base.moving_world import BaseMotion, Platform
from ftqp.sim.plants.plant import Arm
from ftqp.sim.plants.servo_plant import ServoPlant

DEG = np.pi / 180.0
FAST = {"v_max": 1e3, "a_max": 1e9}
"""The ideal loop has no limits."""
SERVO = 0.115
"""Time constant of the joint servos, as studies/holt1994.py fits it to the published step of 10 deg [s]."""


def puma(**limits):
    """The PUMA of the catalog with the rate limit alone, or as given."""
    limits = {"q_min": -10.0, "q_max": 10.0, "a_max": 1e9, **limits}
    return ftqp.robots.load("puma560").with_limits(**limits)


def arm7(**limits):
    """The seven-joint arm with rate and position limits."""
    return ftqp.robots.load("srs7").with_limits(**{"a_max": 1e9, **limits})


def planner(robot, dt, *, rows=None, priority="weighted", scheme=None, slack=None, bounds=None, branch=None):
    """A velocity-level planner bounded by the rate limit and by half the way to a position limit."""
    given = {} if slack is None else {"slack": slack}
    task = ftqp.Task(rows=rows, priority=priority, calm=False, **given)  # the paper has none
    return ftqp.Planner(
        robot,
        dt,
        level="velocity",
        scheme=scheme,
        task=task,
        bounds=Jin(upsilon=0.5 / dt) if bounds is None else bounds,
        emergency=None,
        branch_limits=branch,
    )


@dataclass
class Run:
    """What happened: error along I before each step, (K, 6) [m, rad]; joints (K, n); commands; statuses."""

    e: np.ndarray
    q: np.ndarray
    v: np.ndarray
    status: list
    steps: list

    def rms(self, since=0):
        """Root mean square of the distance [m] and of the angle [rad]."""
        p, r = np.linalg.norm(self.e[since:, :3], axis=1), np.linalg.norm(self.e[since:, 3:], axis=1)
        return np.sqrt(np.mean(p**2)), np.sqrt(np.mean(r**2))

    def peak(self, since=0):
        """Largest distance [m]."""
        return np.linalg.norm(self.e[since:, :3], axis=1).max()


def errors(target, tips):
    """(p_d - p; log R_d R') along I of tips, (K, 4, 4): (K, 6)."""
    turns = Rotation.from_matrix(target[:3, :3] @ np.swapaxes(tips[:, :3, :3], 1, 2)).as_rotvec()
    return np.hstack([target[:3, 3] - tips[:, :3, 3], turns])


def run(
    follower,
    motion,
    q0,
    *,
    twist=None,
    noise=None,
    servo=None,
    locked=(),
    at=0,
    base_only=False,
    late=0,
    target=None,
):
    """Hold the start pose, or ``target``, in I while the base moves; ``servo`` is the real arm."""
    plan, dt = follower.planner, follower.planner.dt
    arm, q, v = Arm(plan.robot), np.array(q0, dtype=float), np.zeros(plan.robot.nv)
    goal = motion.pose[0] @ arm.tip(q) if target is None else target
    plant = None if servo is None else ServoPlant(servo, dt, time_constant=SERVO)
    if plant is not None:
        plant.reset(q, v)
    follower.reset(q)
    wanted = ftqp.Target(pose=goal)
    joints, speeds, statuses, codes, tips, seen = [], [], [], [], [], []
    for k in range(len(motion.pose)):
        if k == at:
            for joint in locked:
                plan.report(ftqp.Locked(joint, mode="instant"))
        tip = motion.pose[k] @ arm.tip(q)
        tips.append(tip)
        joints.append(q.copy())
        if noise is not None:
            tip = tip.copy()
            tip[:3, 3] += noise[0] * noise[2].standard_normal(3)
            tip[:3, :3] = (
                Rotation.from_rotvec(noise[1] * noise[2].standard_normal(3)).as_matrix() @ tip[:3, :3]
            )
        seen.append(tip)
        when = max(0, k - late)
        step = follower.step(
            q,
            v,
            wanted,
            tip=None if base_only else seen[when],
            base=motion.pose[when] if base_only else None,
            base_twist=None if twist is None else twist[k],
        )
        statuses.append(follower.status)
        codes.append(step.status)
        speeds.append(step.v.copy())
        if plant is None:
            q, v = step.q.copy(), step.v.copy()
        else:
            plant.advance(step)
            q, v = plant.q.copy(), plant.v.copy()
    return Run(errors(goal, np.array(tips)), np.array(joints), np.array(speeds), statuses, codes)


def step_motion(angle, dt, ticks, rate=None):
    """The platform turns by ``angle`` [rad] at time 0; a jump has happened before the second sample."""
    at = 0.0 if rate else dt
    return BaseMotion(Platform(), [Step("rotation", angle, at=at, rate=rate)], dt, ticks)


def sway(dt=0.01, time=20.0):
    """The base motion of experiment H6."""
    moves = [
        Sinusoid("track", 0.08, frequency=0.15),
        Sinusoid("rotation", 8.0 * DEG, frequency=0.2),
        Sinusoid("tilt", 4.0 * DEG, frequency=0.25, phase=0.7),
    ]
    return BaseMotion(Platform(), moves, dt, round(time / dt))


START = np.array([0.0, 45.0, -180.0, 0.0, 45.0, 0.0]) * DEG
"""Start of the PUMA; joint 3 is written as 180 deg in the paper."""
START7 = np.array([-15.0, 40.0, 35.0, -95.0, -40.0, 55.0, 0.0]) * DEG

SINGULAR_ELBOW = -87.3084 * DEG
"""Angle of joint 3 of the PUMA at which the arm is stretched."""
BENT = np.array([0.0, 20.0, -37.308, 0.0, 60.0, 0.0]) * DEG
"""Start of experiment H5, 50 deg from there."""


def pulled_away(dt=0.02, time=8.0):
    """The base motion of experiment H5: 0.10 m/s along the track for 2 s, 2 s of rest, and back."""
    track = Recorded([0.0, 2.0, 4.0, 6.0], {"track": [0.0, -0.2, -0.2, 0.0]})
    return BaseMotion(Platform(), [track], dt, round(time / dt))


def overshoot(e, dt):
    """Largest value after the peak and against it, and the time after which 4 % of the peak is not left."""
    k = int(np.argmax(np.abs(e)))
    e = e * np.sign(e[k])
    return max(0.0, -e[k:].min()), (np.flatnonzero(np.abs(e) > 0.04 * e[k])[-1] + 1) * dt
