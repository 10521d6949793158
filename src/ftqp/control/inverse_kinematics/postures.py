"""Postures of a goal with the joints that still work: inverse kinematics of what is left of an arm."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from ftqp.control.inverse_kinematics.posture_search import Posture, PostureSearch, Surrounded
from ftqp.core.checks import instance
from ftqp.core.errors import InputError
from ftqp.faults.belief import Belief
from ftqp.faults.kinds import Fault, FreeSwinging, Locked
from ftqp.kernel.entry.planner_commands import LIMITS, PlannerCommands
from ftqp.kernel.entry.session import ArmSession, Session
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.model.frames import faults_on_way, off_way, on_way
from ftqp.model.robot import Robot

PORTION = 32
"""Starts between two looks at whether there are enough postures."""
QUIET = 64
"""So many further starts that bring no new posture end the search, once there is one."""
STARTS = 480
"""Starts where nothing is found ..."""
FEW = 96
"""... and where fewer joints work than there are rows: then almost no goal has a posture, and a start takes
ten times as long."""
ROUNDS = 8
"""Steps along self-motions, away from limits."""
FOUND_OF_EACH = 2
"""So many times as many postures as are asked for are enough to choose from."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Postures(Sequence[Posture]):
    """The postures that were found, the best first, and how much was looked at.

    Those that motors can hold come first; among them the soonest from ``near``, or, where no ``near`` was
    given, the one with the most room to limits.

    Attributes:
        found: The postures.
        starts: How many starts were tried.
        joints: Names of the joints of each ``q``, (nv,).
    """

    found: tuple[Posture, ...]
    starts: int
    joints: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """How many there are: never that there is none, only that none was found."""
        if not self.found:
            return f"no posture found in {self.starts} starts"
        held = sum(one.is_held for one in self.found)
        text = f"{len(self.found)} posture{'s' * (len(self.found) > 1)} found in {self.starts} starts"
        return text if held == len(self.found) else f"{text}, {held} of them such that the arm may rest there"

    def __len__(self) -> int:
        return len(self.found)

    def __getitem__(self, index: Any) -> Any:
        return self.found[index]

    def __iter__(self) -> Iterator[Posture]:
        return iter(self.found)

    def __repr__(self) -> str:
        return f"Postures({self.sentence})"


def postures(
    robot: Robot,
    pose: Any,
    *,
    faults: Fault | Sequence[Fault] = (),
    rows: Any = "pose",
    near: Any = None,
    count: int = 8,
    starts: int = STARTS,
    seed: int = 0,
    clear_of: Surrounded | None = None,
    frame: str | None = None,
) -> Postures:
    """Postures within the limits that put the end effector at a pose, failed joints where they are.

    Many Newton steps from random starts find the branches; where joints are to spare, postures are then led
    along their self-motions away from limits. It takes some 10 ms, and up to 0.2 s where there is none.

    Args:
        robot: The arm, with its load and tool.
        pose: Where the end effector shall be, (4, 4), or a point, (2,) or (3,) [m], for rows without
            rotation.
        faults: What has failed: locked joints stay where ``near`` has them, degraded ones keep what is left
            of their range, and of their torque for ``effort``. One fault or several; a joint that swings
            freely goes where gravity takes it and is refused.
        rows: Which rows of the pose count: ``"pose"``, ``"position"``, ``"position_axis"`` (position and
            direction of the tool's z axis) or names among x, y, z, rx, ry, rz.
        near: Where the arm is, (nv,) or (nq,) [rad or m]; needed with a locked joint. The soonest posture
            from there comes first.
        count: How many postures at most, from 1. More cover self-motions more finely and take longer.
        starts: How many starts at most, from 1, where none or few are found. More find rarer postures. Where
            fewer joints work than there are rows, it is 96 at most.
        seed: Of the random starts; the same seed gives the same postures.
        clear_of: A planner of this arm with a scene: postures in which a body is nearer to another one than
            it keeps come last, and say so (``clearance``, ``is_held``).
        frame: Of a robot with branches, the frame that shall be there, by its name; None is its first tip.
            Joints off the way to it stay where ``near`` has them, or else ``neutral``.

    Raises:
        InputError: A goal that does not fit the rows, an unknown joint or row, a joint that swings freely, a
            locked joint without ``near``, a number out of its range, a joint that mimics another, a base that
            floats, or ``clear_of`` with branches.

    Example:
        >>> import ftqp
        >>> robot = ftqp.robots.load("panda")
        >>> goal = robot.pose(robot.neutral)
        >>> goal[:3, 3] += [0.1, 0.2, 0.1]
        >>> found = ftqp.postures(robot, goal, faults=ftqp.Locked("panda_joint3"), near=robot.neutral)
        >>> found[0].q.round(2), found.sentence

    Source: docs/theory/ways-out.md.
    """
    instance("robot", robot, Robot, 'an ftqp.Robot, for example ftqp.robots.load("panda")')
    for name, value in (("count", count), ("starts", starts), ("seed", seed)):
        least = 0 if name == "seed" else 1
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
            raise InputError(f"{name} is {value!r:.40}, expected a whole number from {least}")
    belief = _belief(robot, faults)
    if near is None and any(isinstance(fault, Locked) for fault in belief.faults.values()):
        locked = next(joint for joint, fault in belief.faults.items() if isinstance(fault, Locked))
        raise InputError(
            f"{locked} is locked and near is None, so that it is not known where; give near=q, the "
            "configuration of the arm"
        )
    if frame is not None or not robot.is_serial:
        tip = robot.tip if frame is None else frame
        if clear_of is not None:
            raise InputError(
                f"clear_of looks at the whole of {robot.name}, but the joints off the way to {tip!r} are "
                "held; leave it out, or make the planner of robot.arm_to(...)"
            )
        serial = robot.arm_to(tip)
        serial.refuse_tree("a study of an arm's postures needs")
        at = robot.neutral if near is None else robot.angles(near)
        of_arm = postures(
            serial, pose, faults=faults_on_way(robot, tip, belief.faults.values()), rows=rows,
            near=None if near is None else on_way(robot, tip, at), count=count, starts=starts, seed=seed,
        )  # fmt: skip
        whole = tuple(replace(one, q=off_way(robot, tip, one.q, at)) for one in of_arm.found)
        return Postures(found=whole, starts=of_arm.starts, joints=robot.joints)
    session = Session(robot.nv)
    K, given_limits = session.K, {name: getattr(robot.limits, name) for name in LIMITS}
    arm = ArmSession(robot.chain.constants())
    belief.write(
        PlannerCommands(session, arm, {**given_limits, "coulomb": robot.coulomb, "torque_limits": 1})
    )
    n = robot.nv
    limits = K.limits
    working = np.array(K.faults.code[:n] == HEALTHY)
    q = robot.neutral if near is None else robot.angles(near)
    search = PostureSearch(
        robot, pose, rows, q, working=working, q_min=limits.q_min[:n], q_max=limits.q_max[:n], seed=int(seed)
    )
    quiet, starts = 0, min(starts, FEW) if int(working.sum()) < search.m else int(starts)
    while search.starts < starts:
        portion = min(PORTION, starts - search.starts)
        quiet = 0 if search.look(portion) else quiet + portion
        if len(search.q) >= FOUND_OF_EACH * count or (len(search.q) and quiet >= QUIET):
            break
    search.make_room(ROUNDS)
    found = search.postures(int(count), arm, limits, clear_of, ordered=near is not None)
    return Postures(found=found, starts=search.starts, joints=robot.joints)


def _belief(robot: Robot, faults: Fault | Sequence[Fault]) -> Belief:
    """What is believed of the joints."""
    belief = Belief(robot)
    for fault in faults if isinstance(faults, list | tuple) else (faults,):
        belief = belief.reported(fault)
    for joint, fault in belief.faults.items():
        if isinstance(fault, FreeSwinging):
            raise InputError(
                f"{joint} swings freely and goes where gravity takes it, so that it has no posture of its "
                f"own; brake it and give ftqp.Locked({joint!r})"
            )
    return belief
