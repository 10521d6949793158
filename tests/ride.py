"""A planner leads an arm round a circle in physics that is not its own."""

import numpy as np
import pinocchio
from scipy.spatial import cKDTree

import ftqp
from tests.servo_arm import ServoArm, TorqueArm

HZ = 2 * np.pi
DT = 1e-3
START = np.array([0.0, -0.6, 0.0, -2.2, 0.0, 1.7, 0.8])


def circle(robot, q, radius=0.1, duration=6.0):
    return ftqp.paths.Circle(robot.pose(q), radius, duration=duration, axes=("x", "y"))


def target_at(path, t):
    sample = path.sample([min(t, path.duration)])
    return ftqp.Target(pose=sample.pose[0], twist=sample.twist[0], acceleration=sample.acceleration[0])


class Ride:
    """A planner leads an arm round a circle; errors are of the true tip to the target of the same time."""

    def __init__(self, robot, planner, arm, path, seconds, events=None, sensor=lambda k, q: q):
        planner.reset(arm.q.copy())
        self.status, sent, true = [], [], []
        data, tip = robot.model.createData(), robot.model.getFrameId(robot.tip)
        led = path.sample(np.minimum(DT * np.arange(round(seconds / DT)), path.duration))
        target = ftqp.Target(pose=path.start)
        for k, pose in enumerate(led.pose):
            for act in (events or {}).get(k, ()):
                act(planner, arm)
            target.at(pose, led.twist[k], led.acceleration[k])
            pinocchio.framesForwardKinematics(robot.model, data, arm.q)
            true.append(data.oMf[tip].homogeneous)
            step = planner.step(sensor(k, arm.measured()), None, target)
            self.status.append(step.status.name)
            sent.append(step.q.copy())
            arm.command(step)
        true, self.sent = np.array(true), np.array(sent)
        tips, places = true[:, :3, 3], path.sample(np.linspace(0.0, path.duration, 4000)).pose[:, :3, 3]
        self.error = np.linalg.norm(tips - led.pose[:, :3, 3], axis=1)
        cosine = (np.einsum("kij,kij->k", true[:, :3, :3], led.pose[:, :3, :3]) - 1.0) / 2.0
        self.turn = np.arccos(np.clip(cosine, -1.0, 1.0))
        self.off_path, _ = cKDTree(places).query(tips)
        self.rest = float(np.abs(arm.v).max())

    def after(self, seconds):
        return self.error[round(seconds / DT) :].max()


def lock(joint, at, told=0.0):
    events = {round(at / DT): [lambda planner, arm: arm.braked.__setitem__(joint, True)]}
    if told is not None:
        events.setdefault(round((at + told) / DT), []).append(
            lambda planner, arm: planner.report(ftqp.Locked(joint))
        )
    return events


DRIVES = {
    "position": (ftqp.Drive(bandwidth=15 * HZ), "position", 15 * HZ),
    "position 60": (ftqp.Drive(bandwidth=60 * HZ), "position", 60 * HZ),
    "position only": (ftqp.Drive(bandwidth=15 * HZ, takes_velocity=False), "position only", 15 * HZ),
    "position unknown": (ftqp.Drive(), "position", 15 * HZ),
    "velocity": (ftqp.Drive(kind="velocity", bandwidth=15 * HZ), "velocity", 15 * HZ),
    "torque": (ftqp.Drive(kind="torque"), None, None),
}


def wired(robot, drive, latency=0, sigma=0.0, mass=0.0, friction=0.0, level="acceleration", seed=0, **more):
    stiffness = more.pop("stiffness", None)
    stated, takes, wn = DRIVES[drive]
    stated = ftqp.Drive(
        kind=stated.kind, bandwidth=stated.bandwidth, takes_velocity=stated.takes_velocity,
        latency=latency * DT, stiffness=stiffness,
    )  # fmt: skip
    planner = ftqp.Planner(robot, DT, drive=stated, level=level, noise=ftqp.Noise(q=sigma), **more)
    options = {"latency": latency, "sigma": sigma, "seed": seed}
    if takes is None:
        return planner, TorqueArm(robot, START, DT, mass=mass, friction=friction, **options)
    return planner, ServoArm(START, DT, takes, wn, **options)
