"""What is sent goes on from what was sent last, whatever is told and measured; STOPPED, it stands."""

import numpy as np
import pytest

import ftqp
from ftqp.model.serial import Inertial

DT = 1e-3
STANDS = 1e-3
"""A joint that is sent to move more slowly than this share of its limit stands, as ``AT_REST`` has it."""
HOLDS = 0.05
"""What a velocity loop sends to hold a joint that stands, against noise, is below this, as ``GOES_ON``."""
DRIVES = ("position", "velocity", "torque")


def bent_arm():
    """An arm of six joints that no catalog has, with narrow ranges."""
    table = [
        [0.0, 0.3, 0.0, 0.5 * np.pi],
        [0.0, 0.0, 0.35, 0.0],
        [0.0, 0.05, 0.05, 0.5 * np.pi],
        [0.0, 0.3, 0.0, -0.5 * np.pi],
        [0.0, 0.0, 0.0, 0.5 * np.pi],
        [0.0, 0.1, 0.0, 0.0],
    ]
    n = len(table)
    limits = {
        "q_min": np.full(n, -1.6), "q_max": np.array([1.9, 1.4, 1.7, 2.0, 1.5, 2.5]), "tau_max": 90.0,
        "v_max": np.linspace(1.0, 3.0, n), "a_max": np.linspace(4.0, 20.0, n),
    }  # fmt: skip
    bodies = [
        Inertial(mass=m, com=np.array([0.0, 0.02, -0.05]), inertia=0.02 * m * np.eye(3))
        for m in np.linspace(4.0, 0.5, n)
    ]
    return ftqp.Robot.from_dh(table, limits=limits, inertials=bodies)


class World:
    """An arm that goes where it is told, joints that do as their failures let them, and its encoders."""

    def __init__(self, robot, drive, sigma=0.0, drift=0.0, seed=0, level="acceleration", told=True):
        self.robot, self.drive, self.sigma, self.drift = robot, drive, sigma, drift
        self.rng = np.random.default_rng(seed)
        noise = ftqp.Noise(q=sigma) if sigma and told else None
        # No torque moves anything here, which a detector would take for joints that have failed.
        detector = False if drive == "torque" else None
        self.planner = ftqp.Planner(robot, DT, drive=drive, noise=noise, level=level, detector=detector)
        self.q = robot.neutral.copy()
        self.planner.reset(self.q)
        self.target = ftqp.Target(pose=robot.pose(self.q))
        self.off = np.zeros(robot.nv)
        self.hangs = {}
        self.step = None
        self.worked = np.ones(robot.nv, bool)
        self.tick()

    def failed(self, *kinds):
        """Which joints are believed to have failed so, (nv,)."""
        faults = self.planner.faults
        return np.array([isinstance(faults.get(joint), kinds) for joint in self.robot.joints])

    def tick(self):
        """One step, and whether what is sent is what may be."""
        before = None if self.step is None else self.step.copy()
        sample = self.q + self.off + self.sigma * self.rng.normal(size=self.robot.nv)
        self.step = step = self.planner.step(sample, None, self.target)
        limits, sent = self.robot.limits, ~self.failed(ftqp.FreeSwinging)
        works = sent & ~self.failed(ftqp.Locked)
        if before is not None:
            if self.drive == "position":
                way = abs(step.q - before.q)[sent]
            elif self.drive == "velocity":
                way = DT * abs(step.v)[sent]
            else:
                way = DT * abs(step.reference.v)[sent]
            top = DT * limits.v_max[sent]
            assert (way <= top * (1.0 + 1e-9) + 1e-12).all(), way / top
            change, most = abs(step.reference.v - before.reference.v), DT * limits.a_max
            assert (change <= most * (1.0 + 1e-9) + 1e-9)[works & self.worked].all(), change / most
            if step.status is ftqp.StepStatus.STOPPED:
                share = HOLDS if self.drive == "velocity" else STANDS  # by feedback, against noise
                assert (way <= share * top + 1e-12).all(), way / top
        self.worked, held = works, ~works
        self.off[held] += self.drift * DT
        q = step.reference.q.copy()
        q[held] = self.q[held]
        for i, (end, speed) in self.hangs.items():
            q[i] = self.q[i] + np.clip(end - self.q[i], -speed * DT, speed * DT)
        self.q = q
        return step


def loosen(world, joint, beyond, side):
    """Joint ``joint`` swings freely and comes to rest on its stop beyond its range."""
    limits = world.robot.limits
    end = limits.q_max[joint] + beyond if side > 0 else limits.q_min[joint] - beyond
    world.planner.report(ftqp.FreeSwinging(joint, damping=1.0))
    world.hangs[joint] = end, 2.0
    for _ in range(int(abs(end - world.q[joint]) / (2.0 * DT)) + 300):
        world.tick()


@pytest.mark.long
@pytest.mark.parametrize("beyond", [0.01, pytest.param(0.1, marks=pytest.mark.slow), 0.5])
@pytest.mark.parametrize("after", ["withdraw", "degraded", "locked", "locked, then withdraw"])
def test_a_joint_that_swung_free_returns_from_where_it_stands(drive, beyond, after):
    world = World(ftqp.robots.load("panda"), drive)
    loosen(world, 3, beyond, 1)
    del world.hangs[3]
    planner, place = world.planner, world.q[3]
    {
        "withdraw": lambda: planner.withdraw(3),
        "degraded": lambda: planner.report(ftqp.Degraded(3, velocity=0.5)),
        "locked": lambda: planner.report(ftqp.Locked(3)),
        "locked, then withdraw": lambda: planner.report(ftqp.Locked(3)),
    }[after]()
    assert world.tick().q[3] == pytest.approx(place, abs=1e-3)
    for _ in range(100):
        world.tick()
    if after.endswith("then withdraw"):
        planner.withdraw(3)
        assert world.tick().q[3] == pytest.approx(place, abs=1e-3)
    if after != "locked":
        planner.resume()
        for _ in range(4000):
            world.tick()
        assert world.q[3] < place - 0.005, "it is led back"


@pytest.mark.long
@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("arm", ["panda", "bent"])
def test_the_report_of_a_lock_puts_no_noise_into_what_is_sent(drive, told, arm):
    robot = bent_arm() if arm == "bent" else ftqp.robots.load(arm)
    world = World(robot, drive, sigma=1e-3, told=told)
    for _ in range(100):
        world.tick()
    world.planner.report(ftqp.Locked(2))
    places = np.array([world.tick().q[2] for _ in range(300)])
    speeds = np.diff(places) / DT
    assert abs(np.diff(speeds)).max() <= DT * robot.limits.a_max[2] * (1.0 + 1e-6)
    assert np.ptp(places) < 1e-4 and np.ptp(places[100:]) == 0.0


@pytest.mark.long
@pytest.mark.parametrize("speed", [0.005, 0.1])
def test_what_is_sent_to_a_locked_joint_does_not_follow_a_drifting_encoder(drive, speed):
    world = World(ftqp.robots.load("panda"), drive, sigma=1e-4, drift=speed)
    for _ in range(100):
        world.tick()
    world.planner.report(ftqp.Locked(3))
    places = np.array([world.tick().q[3] for _ in range(3000)])
    assert np.ptp(places) < 1e-5 and np.ptp(places[100:]) == 0.0


@pytest.mark.long
def test_a_lock_on_the_way_is_sent_its_braking_distance_and_no_farther(drive, level):
    robot = ftqp.robots.load("panda")
    world = World(robot, drive, sigma=1e-4, level=level)
    world.target.position[1] += 0.15
    for _ in range(250):
        world.tick()
    v, at = world.step.reference.v[0], world.step.q[0]
    assert abs(v) > 0.1
    world.planner.report(ftqp.Locked(0))
    places = np.array([world.tick().q[0] for _ in range(1500)])
    braking = v * v / (2.0 * 0.25 * robot.limits.a_max[0])
    assert (np.sign(v) * (places - at)).min() >= -1e-9
    assert (np.sign(v) * (places - at)).max() <= 1.05 * braking + abs(v) * DT
    assert np.ptp(places[-500:]) == 0.0


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2, 3))])
@pytest.mark.parametrize("arm", ["panda", "bent"])
def test_no_sequence_of_reports_makes_what_is_sent_jump(drive, seed, arm):
    rng = np.random.default_rng(seed)
    robot = bent_arm() if arm == "bent" else ftqp.robots.load(arm)
    sigma, drift = [(0.0, 0.0), (1e-4, 0.0), (1e-3, 0.0), (1e-4, 0.05)][seed % 4]
    world = World(
        robot, drive, sigma=sigma, drift=drift, seed=seed, level=["acceleration", "velocity"][seed % 2]
    )
    kinds = ["ramp", "instant", "degraded", "withdraw"] + (["free"] if robot.has_inertia else [])
    for _ in range(12):
        kind, joint = rng.choice(kinds), int(rng.integers(robot.nv))
        if kind == "free":
            loosen(world, joint, rng.choice([0.01, 0.1, 0.3]), rng.choice([-1, 1]))
        elif kind == "withdraw":
            world.planner.withdraw(joint)
        elif kind == "degraded":
            world.planner.report(ftqp.Degraded(joint, velocity=rng.uniform(0.3, 1.0)))
        else:
            world.planner.report(ftqp.Locked(joint, mode=kind, reset="kinematic"))
        if kind != "free":
            world.hangs.pop(joint, None)
        if rng.random() < 0.4:
            world.planner.resume()
        world.target.position[:] = robot.pose(robot.neutral)[:3, 3] + rng.uniform(-0.05, 0.05, 3)
        for _ in range(int(rng.integers(20, 300))):
            world.tick()
