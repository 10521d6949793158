"""What a planner does about faults that it finds, also by probing and active verification."""

import logging
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import ftqp
from ftqp.control.planner.response.active_verification import ActiveVerification
from ftqp.control.planner.response.fault_response import (
    SLOWEST,
    UNKNOWN_SHARE,
    fault_of,
    is_doubtful,
    is_harmless,
)
from ftqp.control.planner.response.probing import FARTHEST, LEAST_SHARE
from ftqp.core.errors import InputError
from ftqp.faults.detection.diagnosis import Finding
from ftqp.kernel.layout.enums import LOCKED

DT = 1e-3
SIGMA = 1e-4
KNOWN = ftqp.Drive(kind="torque", inertia_error=0.0)


def planner_of(detector: ftqp.Detector | None, **settings: Any) -> ftqp.Planner:
    """Of a drive whose failures the older detector finds."""
    robot = ftqp.robots.load("panda")
    return ftqp.Planner(robot, DT, drive=KNOWN, noise=ftqp.Noise(q=SIGMA), detector=detector, **settings)


def circle(planner: ftqp.Planner) -> ftqp.paths.Circle:
    return ftqp.paths.Circle(planner.robot.pose(planner.robot.neutral), 0.1, duration=4.0, axes=("y", "z"))


def drive(
    planner: ftqp.Planner,
    seconds: float,
    *,
    truth: Callable[[int, np.ndarray, np.ndarray], np.ndarray] = lambda k, q, sent: sent,
    seen: Callable[[int, np.ndarray], np.ndarray] = lambda k, q: q,
) -> list[ftqp.Step]:
    """Lead the tip round a circle by the clock; ``truth`` moves the arm, ``seen`` makes the samples."""
    path, generator = circle(planner), np.random.default_rng(5)
    sample = path.sample(np.arange(0.0, seconds, DT))
    q = planner.robot.neutral.copy()
    planner.reset(q)
    steps = []
    for k in range(len(sample.pose)):
        noisy = seen(k, q + SIGMA * generator.standard_normal(7))
        target = ftqp.Target(pose=sample.pose[k], twist=sample.twist[k], acceleration=sample.acceleration[k])
        step = planner.step(noisy, None, target)
        steps.append(step.copy())
        q = truth(k, q, step.q.copy())
    return steps


def lock(joint: int, at: float) -> Callable[[int, np.ndarray, np.ndarray], np.ndarray]:
    """A joint stands still from a time on."""

    def truth(k: int, q: np.ndarray, sent: np.ndarray) -> np.ndarray:
        if k * DT >= at:
            sent[joint] = q[joint]
        return sent

    return truth


@pytest.mark.parametrize("joint", [4, 5])
def test_a_lock_that_nobody_announces_is_found_and_the_task_goes_on(joint: int) -> None:
    planner = planner_of(ftqp.Detector())
    steps = drive(planner, 4.0, truth=lock(joint, 1.7))
    name = planner.robot.joints[joint]
    assert [(finding.joint, finding.kind) for finding in planner.findings] == [(name, "locked")]
    assert 1.69 < planner.findings[0].onset < planner.findings[0].detected_at < 1.75
    assert planner.faults == {name: ftqp.Locked(name)}
    assert steps[-1].status is ftqp.StepStatus.OK
    assert max(step.position_error for step in steps[-500:]) < 2e-3


@pytest.mark.long
def test_without_a_detector_the_same_arm_falls_behind() -> None:
    planner = planner_of(None)
    steps = drive(planner, 4.0, truth=lock(2, 1.7))
    assert planner.diagnosis is None and planner.findings == ()
    assert steps[-1].status is not ftqp.StepStatus.OK


@pytest.mark.long
def test_a_healthy_arm_moves_bit_for_bit_as_without_a_detector() -> None:
    watched, alone = planner_of(ftqp.Detector()), planner_of(None)
    for with_one, without in zip(drive(watched, 2.0), drive(alone, 2.0), strict=True):
        assert (with_one.q == without.q).all() and (with_one.a == without.a).all()
    assert watched.findings == () and watched.faults == {}
    assert watched.diagnosis is not None and watched.diagnosis.suspicion < 1.0


@pytest.mark.parametrize(
    ("kind", "seen"),
    [
        ("sensor_dropped", lambda k, q: np.where(np.arange(7) == 3, np.nan, q) if k >= 1500 else q),
        ("sensor_biased", lambda k, q: q + 0.02 * (np.arange(7) == 3) if k >= 1500 else q),
    ],
)
def test_a_lost_sensor_stops_the_arm_at_once_and_is_named(
    kind: str, seen: Any, caplog: pytest.LogCaptureFixture
) -> None:
    planner = planner_of(ftqp.Detector())
    with caplog.at_level(logging.WARNING, "ftqp"):
        steps = drive(planner, 2.0, seen=seen)
    assert planner.findings[0].kinds == {kind}
    assert planner.findings[0].detected_at < 1.51
    assert steps[1515].status is ftqp.StepStatus.STOPPING
    assert planner.stopped_because is not None and "panda_joint4" in planner.stopped_because
    assert any("panda_joint4" in message and "stopped" in message for message in caplog.messages)
    assert not planner.resume()
    planner.reset(planner.robot.neutral)
    assert planner.findings == () and planner.stopped_because is None


@pytest.mark.parametrize("leader", ["target", "goto"])
def test_a_suspicion_slows_down_what_leads_the_arm_to_a_goal(leader: str) -> None:
    planner = planner_of(ftqp.Detector(), task=ftqp.Task(rows="position"))
    generator, robot = np.random.default_rng(2), planner.robot
    q = robot.neutral.copy()
    goal = q + np.array([0.6, 0.3, -0.4, 0.4, 0.3, 0.3, 0.2])
    target = ftqp.Target(pose=robot.pose(goal))
    follower: Any = ftqp.TargetFollower(planner) if leader == "target" else ftqp.GoTo(planner, q=goal)
    follower.reset(q)
    paces, speeds = [], []
    for k in range(1800):
        pushed = 8e-4 * np.interp(k, [400, 440, 480], [0.0, 1.0, 0.0])
        seen = q + pushed * np.eye(7)[1] + SIGMA * generator.standard_normal(7)
        arguments = (target,) if leader == "target" else ()
        step = follower.step(seen, None, *arguments)
        speeds.append(float(np.linalg.norm(step.reference.v)))
        paces.append(planner.pace)
        q = step.q.copy()
    assert planner.findings == () and planner.speed == 1.0
    assert paces[390] == paces[-1] == 1.0 and SLOWEST <= min(paces[400:700]) < 0.9
    slowest = 400 + int(np.argmin(paces[400:700]))
    assert min(speeds[slowest : slowest + 150]) < 0.9 * speeds[399]


@pytest.mark.long
def test_a_joint_that_is_withdrawn_is_looked_at_again() -> None:
    planner = planner_of(ftqp.Detector())
    drive(planner, 2.0, truth=lock(4, 1.7))
    assert planner.findings
    planner.withdraw("panda_joint5")
    assert planner.findings == () and planner.faults == {}


@pytest.mark.long
def test_a_fault_that_is_told_is_not_found_once_more() -> None:
    planner = planner_of(ftqp.Detector())

    def truth(k: int, q: np.ndarray, sent: np.ndarray) -> np.ndarray:
        if k == 1700:
            planner.report(ftqp.Locked("panda_joint3", mode="instant"))
        return lock(2, 1.7)(k, q, sent)

    steps = drive(planner, 3.0, truth=truth)
    assert planner.findings == ()
    assert steps[-1].status is ftqp.StepStatus.OK


def finding(*kinds: str, share: float | None = None) -> Finding:
    return Finding(joint="j", kinds=frozenset(kinds), sentence="", onset=0.0, detected_at=0.0, share=share)


@pytest.mark.parametrize(
    ("found", "fault"),
    [
        (finding("locked"), ftqp.Locked("j")),
        (finding("locked", "free_swinging"), ftqp.Locked("j")),
        (finding("runaway"), ftqp.Locked("j")),
        (finding("free_swinging"), ftqp.FreeSwinging("j")),
        (finding("degraded", share=0.4), ftqp.Degraded("j", torque=0.4)),
        (finding("degraded", share=float("nan")), ftqp.Degraded("j", torque=UNKNOWN_SHARE)),
        (finding("free_swinging", "degraded"), ftqp.Degraded("j", torque=UNKNOWN_SHARE)),
    ],
)
def test_of_what_was_found_the_planner_believes_what_does_least_harm(found: Finding, fault: Any) -> None:
    assert fault_of(found) == fault


@pytest.mark.parametrize(
    ("kinds", "stands", "harmless"),
    [
        (("degraded",), False, False),
        (("degraded", "free_swinging"), False, True),
        (("degraded", "free_swinging"), True, False),
        (("degraded", "locked"), False, False),
        (("degraded", "locked"), True, False),
        (("free_swinging",), False, False),
        (("locked",), True, False),
        (("runaway",), False, False),
    ],
)
def test_a_joint_that_may_just_be_weak_is_told_and_not_believed(
    kinds: tuple[str, ...], stands: bool, harmless: bool
) -> None:
    assert is_harmless(finding(*kinds), stands=stands) is harmless


def test_a_joint_without_torque_that_stands_counts_as_locked() -> None:
    assert fault_of(finding("free_swinging"), stands=True) == ftqp.Locked("j")
    assert fault_of(finding("free_swinging", "degraded"), stands=True) == ftqp.Locked("j")
    assert fault_of(finding("degraded", share=0.5), stands=True) == ftqp.Degraded("j", torque=0.5)


def test_an_arm_without_masses_counts_every_failed_joint_as_locked() -> None:
    assert fault_of(finding("degraded", share=0.5), may_swing=False) == ftqp.Locked("j")


@pytest.mark.parametrize(
    ("kinds", "another", "stands", "doubtful"),
    [
        (("free_swinging",), True, False, True),
        (("free_swinging",), False, False, False),
        (("free_swinging",), True, True, False),
        (("locked",), True, False, False),
        (("locked", "free_swinging"), True, False, False),
        (("degraded",), True, False, False),
    ],
)
def test_a_joint_that_seems_free_beside_one_that_failed_before_is_not_believed(
    kinds: tuple[str, ...], another: bool, stands: bool, doubtful: bool
) -> None:
    assert is_doubtful(finding(*kinds), another=another, stands=stands) is doubtful


class Arm:
    """Joint 2 of a Panda that counts as locked, and how it moves."""

    def __init__(self) -> None:
        self.planner = ftqp.Planner(ftqp.robots.load("panda"), DT, drive="torque", noise=ftqp.Noise(q=SIGMA))
        self.planner.reset(self.planner.robot.neutral)
        self.K = self.planner._session.K
        self.verification = ActiveVerification(self.planner._session, 7)
        self.random = np.random.default_rng(2)
        self.K.faults.code[2] = LOCKED
        self.K.feedback.seen[2] = self.home = float(self.K.state.q_command[2])

    def run(self, seconds: float, drift: float = 0.0) -> float | None:
        """When the joint is said not to be held, or None."""
        for k in range(round(seconds / DT)):
            q = self.home + drift * k * DT
            self.K.feedback.seen[2] = q + SIGMA * self.random.standard_normal()
            if self.verification.look() == 2:
                return k * DT
        return None


def test_a_joint_that_moves_by_itself_is_not_held_and_one_that_creeps_is() -> None:
    moving, creeping = Arm(), Arm()
    for arm in (moving, creeping):
        arm.verification.begin(2)
    assert moving.run(2.0, drift=0.3) == pytest.approx(0.33, abs=0.03)
    assert creeping.run(2.0, drift=0.02) is None


HALF_SECOND = 0.5
QUIET = 1e-7
"""Noise of an encoder that hardly has any; one without is taken for frozen."""


def probing(probe_after: float | None, **settings: Any) -> ftqp.Planner:
    robot = settings.pop("robot", None) or ftqp.robots.load("panda").with_friction(coulomb=1e-4)
    detector = ftqp.Detector(probe_after=probe_after)
    return ftqp.Planner(robot, DT, drive=KNOWN, noise=ftqp.Noise(q=SIGMA), detector=detector, **settings)


def stood(
    planner: ftqp.Planner, ticks: int, *, locked: int | None = None, at: int = 0, sigma: float = SIGMA
) -> list[ftqp.Step]:
    """Steps of an arm that is to stand where it is; a joint locks at a tick, and nobody says so."""
    robot, generator = planner.robot, np.random.default_rng(4)
    q = robot.neutral.copy()
    planner.reset(q)
    target, steps = ftqp.Target(pose=robot.pose(q)), []
    for k in range(ticks):
        step = planner.step(q + sigma * generator.standard_normal(robot.nv), None, target)
        steps.append(step.copy())
        stays, q = q, step.q.copy()
        if locked is not None and k >= at:
            q[locked] = stays[locked]
    return steps


@pytest.mark.parametrize("scheme", ["mvn", "man", "mke", "rmp"])
def test_a_probed_joint_moves_by_a_little_and_comes_back_while_the_tip_stays(level: str, scheme: str) -> None:
    planner = probing(HALF_SECOND, level=level, scheme=scheme)
    robot = planner.robot
    steps = stood(planner, 750, sigma=QUIET)
    q = np.array([step.reference.q for step in steps])
    far = np.abs(q - robot.neutral).max(axis=0)
    assert far.max() == pytest.approx(FARTHEST, rel=0.15)
    assert (far >= LEAST_SHARE * FARTHEST).sum() >= 2
    assert np.abs(q[499] - robot.neutral).max() < 1e-6
    assert np.abs(q[720] - robot.neutral).max() < 0.1 * FARTHEST
    assert max(np.linalg.norm(robot.pose(one)[:3, 3] - robot.pose(robot.neutral)[:3, 3]) for one in q) < 1e-5
    assert {step.status for step in steps} == {ftqp.StepStatus.OK}
    if level == "acceleration":
        a = np.array([step.a for step in steps])
        assert (np.abs(a) <= 0.6 * robot.limits.a_max).all()


def test_without_probing_commands_are_those_of_a_detector_that_never_heard_of_it() -> None:
    for one, other in zip(stood(probing(None), 300), stood(probing(10.0), 300), strict=True):
        assert (one.q == other.q).all() and (one.a == other.a).all()


@pytest.mark.long
def test_a_lock_at_rest_is_found_within_a_second_by_probing_alone() -> None:
    probed, alone = probing(HALF_SECOND), probing(None)
    stood(probed, 1700, locked=2, at=700)
    assert [(finding.joint, finding.kind) for finding in probed.findings] == [("panda_joint3", "locked")]
    assert probed.findings[0].detected_at < 1.7
    stood(alone, 1700, locked=2, at=700)
    assert alone.findings == ()


def test_a_joint_that_no_self_motion_moves_is_left_alone_and_named(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "ftqp"):
        stood(probing(HALF_SECOND), 900)
    said = [message for message in caplog.messages if "cannot be probed" in message]
    assert any("panda_joint4" in message for message in said)
    assert len(said) == len(set(said))


def test_a_joint_that_friction_holds_stays_while_others_are_probed() -> None:
    robot = ftqp.robots.load("panda").with_friction(coulomb=[1e-4] * 6 + [2.0])
    planner = probing(HALF_SECOND, robot=robot, task=ftqp.Task(rows="position"))
    far = np.abs(np.array([step.q for step in stood(planner, 900, sigma=QUIET)]) - robot.neutral).max(axis=0)
    assert far[6] < 1e-6 and far.max() > 1e-3


def test_nothing_is_probed_during_a_stop() -> None:
    planner, generator = probing(HALF_SECOND), np.random.default_rng(4)
    q = planner.robot.neutral.copy()
    planner.reset(q)
    target, ends = ftqp.Target(pose=planner.robot.pose(q)), []
    for k in range(1500):
        if k == 560:
            planner.stop()
        q = planner.step(q + QUIET * generator.standard_normal(7), None, target).q.copy()
        ends.append(q)
    assert np.abs(ends[600] - planner.robot.neutral).max() > 1e-4
    assert np.abs(np.array(ends[800:]) - ends[-1]).max() < 1e-9


def test_an_arm_without_self_motion_cannot_be_probed_and_says_so() -> None:
    panda = ftqp.robots.load("panda")
    six = ftqp.Robot.from_urdf(panda.to_urdf(), tip=panda.tip, locked=["panda_joint7"])
    with pytest.raises(InputError, match="panda has 6 joints for 6 task rows and no self-motion"):
        probing(HALF_SECOND, robot=six)


def test_a_closed_form_cannot_be_probed_by_and_says_so() -> None:
    with pytest.raises(InputError, match="closed form 'pseudoinverse' has no objective"):
        probing(HALF_SECOND, scheme="pseudoinverse", level="velocity")


@pytest.mark.parametrize("given", [0.0, -1.0, float("nan")])
def test_a_time_that_is_none_is_refused(given: float) -> None:
    with pytest.raises(InputError, match="probe_after"):
        ftqp.Detector(probe_after=given)
