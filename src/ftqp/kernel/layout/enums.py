"""Every code that the record carries, each enumeration once.

Compiled code compares plain integers: ``numbered`` gives those of an enumeration names in its module. Whoever
shows a code to a person reads its name here. The members of one that is a line count from 0.
"""

import sys
from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING, Final, TypeVar

Kind = TypeVar("Kind", bound=type[IntEnum])

if TYPE_CHECKING:

    def __getattr__(name: str) -> int:
        """A number that ``numbered`` has named."""


def numbered(pattern: str = "{}", **others: str) -> Callable[[Kind], Kind]:
    """Name the number of each member in its module, as in the pattern, or as it is said for the member."""

    def name(kind: Kind) -> Kind:
        vars(sys.modules[kind.__module__]).update(
            {others.get(one.name, pattern.format(one.name)): int(one) for one in kind}
        )
        return kind

    return name


JOINTS: Final = 64
"""The most joints that an arm may have."""
TASK_ROWS: Final = 6
"""The most rows that a task may have: those of a pose."""
SETS: Final = 3
"""The most sets of rows that a task may be reduced to, one after the other."""

Level = IntEnum("Level", "VELOCITY ACCELERATION", start=0)
"""What the QP decides."""
numbered()(Level)

Mode = IntEnum("Mode", "HARD SLACK SCALED LEXICOGRAPHIC", start=0)
"""What becomes of the task where it cannot be kept."""
numbered(SCALED="SCALE")(Mode)

Conversion = IntEnum("Conversion", "VIABILITY JIN ONE_STEP", start=0)
"""How joint limits become one interval a joint."""
numbered()(Conversion)

JointCode = IntEnum("JointCode", "HEALTHY BRAKING LOCKED FREE INSTANT MEASURED", start=0)
"""What is believed of a joint; an INSTANT lock jumps to LOCKED at the next tick.

A joint without motor and brake is MEASURED: nobody commands it, and the others make up for where it is
seen to go. It is FREE where it swings as its dynamics say.
"""
numbered()(JointCode)

Reset = IntEnum("Reset", "KINEMATIC MOMENTUM TASK", start=0)
"""What the velocities of the other joints do when one is locked at once."""
numbered("RESET_{}")(Reset)


@numbered()
class Claim(IntEnum):
    """What a solver says of its answer."""

    SOLVED = 0
    MAX_ITERATIONS = 1
    INFEASIBLE = 2
    FAILED = 3
    OUT_OF_TIME = 4


Status = IntEnum("Status", "OK RELAXED SCALED LAGGING FALLBACK STOPPING STOPPED INVALID_INPUT HELD", start=0)
"""What a step says to the operator; the sentences are those of ``ftqp.StepStatus``."""
numbered()(Status)

NEWS: Final = 64
"""Is added to the status of a tick in which the monitor has found something, or taken it back."""


@numbered(NONE="ALL_USABLE")
class Unusable(IntEnum):
    """Why samples of a tick cannot be used."""

    NONE = 0
    NOT_FINITE = 1
    """What else was measured is not finite."""
    NOTHING_HEARD = 2
    """The loop was late: nothing was measured at that tick, and no sensor is to blame."""


DriveKind = IntEnum("DriveKind", "POSITION VELOCITY TORQUE", start=0)
"""What the arm takes."""
numbered("{}_DRIVE")(DriveKind)

StopReason = IntEnum(
    "StopReason",
    "NONE ASKED ERROR FALLBACKS SENSOR DEVIATION LAG FREE_JOINT OVERLOAD SECOND_FREE CLEARANCE SCENE",
    start=0,
)
"""Why a stop is latched; the sentences are those of ``ftqp.Planner.stopped_because``."""
numbered("STOPPED_BY_{}", NONE="NOT_STOPPED", ASKED="STOPPED_AS_ASKED")(StopReason)

Going = IntEnum("Going", "MOVING REACHED UNREACHABLE HALTED RESTLESS", start=0)
"""Where an arm stands on its way to a posture; an arm in C has no other."""
numbered("GOING_{}")(Going)

Brakes = IntEnum("Brakes", "EACH ALL NONE", start=0)
"""Which brakes an arm has, by the names that ``ftqp.Drive`` gives them."""
numbered("{}_BRAKES", EACH="EACH_BRAKE", NONE="NO_BRAKES")(Brakes)


@numbered()
class Turn(IntEnum):
    """What a tick waits for, where it has no status yet."""

    QP_READY = 100
    """The QP is assembled and waits for a solver."""
    SOLVE = 101
    """A substitute QP waits for the in-kernel solver."""
    ANSWERED = 102
    """A solver has answered."""


@numbered()
class Mistake(IntEnum):
    """A programmer's mistake, in place of a status."""

    WRONG_SHAPE = -1
    """q or v has another size than the arm."""
    NO_ROTATION = -2
    """The task has rotation rows but the target carries a position only."""
    NOT_RESET = -3
    """No state is known yet."""
    NOT_READ = -4
    """q, v or the target is no buffer of contiguous numbers of this machine."""
    TWIST_ALONE = -5
    """The target says how fast the tip should move, but not where it should be."""


@numbered("{}_STAGE")
class Stage(IntEnum):
    """Which QP of the fallback cascade is being solved, see ``ftqp.kernel.judge.fallback_cascade``."""

    FIRST = 0
    MAIN = 1
    RELAX = 2
    ELASTIC = 3
    REST = 4
    REST_ELASTIC = 5
    LEAST_EXCESS = 6
    PLAIN = 7
    SETTLING = 8
    SETTLING_ELASTIC = 9
    CLIP = 10
    """No QP any more: the rest within the box."""
    COMMAND = 11
    """None: the answer is the command."""


Limit = IntEnum("Limit", "NONE ACCELERATION VELOCITY POSITION FAULT", start=0)
"""Which limit set an end of a joint's interval."""
numbered("BY_{}", NONE="NO_LIMIT")(Limit)


@numbered()
class FreeMode(IntEnum):
    """What the healthy joints do while one swings freely."""

    DECIDE = 0
    """They brake while it is decided what can be kept of the task."""
    HOLD = 1
    """They lead the arm to a posture in which it can rest with the tip at its place."""
    ARREST = 2
    """They swing so that the free joint meets its stop softly, or never."""
    STILL = 3
    """They hold still."""
    FOLLOW = 4
    """They follow the task: gravity does not move the free joint."""
    MAKE_UP = 5
    """They follow the task and make up for where the joint is seen to go: nobody knows yet that it swings."""


Kept = IntEnum("Kept", "NOTHING POSITION POSITION_AXIS POSE", start=0)
"""What is kept of a pose while a joint swings freely."""
numbered("{}_KEPT", POSITION_AXIS="AXIS_KEPT")(Kept)

Refusal = IntEnum(
    "Refusal",
    "NONE NO_POSTURE NO_GAIN OFF_THE_WAY STOP_TOUCHED TORQUE OFF_IN_THE_END",
    start=0,
)
"""Why a set of rows cannot be kept while a joint swings freely."""
numbered(NONE="NOT_REFUSED", TORQUE="TOO_WEAK")(Refusal)


@numbered(
    "IS_{}",
    FREE_SWINGING="IS_FREE",
    SENSOR_FROZEN="IS_FROZEN",
    SENSOR_BIASED="IS_BIASED",
    SENSOR_DROPPED="IS_DROPPED",
)
class FaultKind(IntEnum):
    """What can be found of a joint, bit by bit: a set of kinds is one number."""

    LOCKED = 1
    FREE_SWINGING = 2
    DEGRADED = 4
    RUNAWAY = 8
    SENSOR_FROZEN = 16
    SENSOR_BIASED = 32
    SENSOR_DROPPED = 64


AS_STATED: Final = 1
"""The loop begins anew where the arm was said to be ..."""
AS_SENT: Final = 2
"""... or at what was last sent, as a command was not let through."""

TARGET_POSE: Final = 0
"""Offset of the pose, 16 numbers by rows, in a packed target."""
TARGET_TWIST: Final = 16
"""Offset of the twist, 6 numbers."""
TARGET_ACCELERATION: Final = 22
"""Offset of the acceleration, 6 numbers."""
TARGET_HAS_ROTATION: Final = 28
"""1 with a pose, 0 with a position, -1 with a twist alone."""
TARGET_SIZE: Final = 29
"""Numbers of a packed target."""

LOOKED_THROUGH: Final = 1
"""Of a joint whose samples repeat themselves: its own feedback is off, its sample is a following error ..."""
FROZEN: Final = 2
"""... or the sample is refused, too."""

DELAYS: Final = 64
"""Capacity: samples by which a measurement may be late, plus one."""
HISTORY: Final = 64
"""Capacity: given targets that are kept."""

Attitude = IntEnum("Attitude", "ESTIMATED NOMINAL MEASURED", start=0)
"""Which attitude of a moving base turns the inertial error into the base's axes."""
numbered("{}_ATTITUDE")(Attitude)

BaseCode = IntEnum("BaseCode", "TRACKING SATURATED RANK_DEFICIENT UNREACHABLE STALE HALTED", start=0)
"""How a task in inertial space goes; the sentences are those of ``ftqp.BaseStatus``."""
numbered("BASE_{}")(BaseCode)

HAS_TIP: Final = 1
"""What is measured at a tick of a moving base, bit by bit."""
HAS_POSITION: Final = 2
"""Of the tip the position only."""
HAS_BASE: Final = 4
"""The pose of the base."""
HAS_TWIST: Final = 8
"""The twist of the base."""

ClosedForm = IntEnum("ClosedForm", "PSEUDOINVERSE DAMPED APPROXIMATE", start=0)
"""Closed forms: x = J^+ b with scaled columns, its damped form, or the approximate pseudoinverse."""
numbered()(ClosedForm)

Rule = IntEnum("Rule", "BOUND BOUND_2 TIGHT ROW EXACT_2 EXACT_INF", start=0)
"""Rules of the damping factor, see ``ftqp.kernel.closed_forms.closed_form_tick``."""
numbered()(Rule)

Iteration = IntEnum("Iteration", "LVI94 E47 IMPLICIT", start=0)
"""Methods of the network, by formula in ``ftqp.kernel.dtrnn.iterations``."""
numbered()(Iteration)


@numbered()
class CurveEnd(IntEnum):
    """How a traced curve ended."""

    CUT = 0  # at a joint limit, or where it could not be followed
    CLOSED = 1
    UNFINISHED = 2  # its memory was full


Ending = IntEnum("Ending", "CORRECT ERRONEOUS NONE SINGULAR UNRESOLVED", start=0)
"""What becomes of the tip: at the goal, at rest elsewhere, no rest, at a singularity, or not known."""
numbered()(Ending)

Survival = IntEnum(
    "Survival",
    "SURVIVED LIMIT VELOCITY SINGULAR SINGULAR_VELOCITY NOT_CONVERGED NOMINAL ERROR STRUCTURAL TOO_NEAR",
    start=0,
)
"""How the continuation of one pair of joint and instant ends.

The path is finished, or it is not: a joint meets its position limit, a joint would have to be too fast,
the joints that are left become singular, at once or so that a speed limit is met first, no solution is
found, the plan itself is outside its limits at the failure, the error leaves its tolerance, the joint is
one that this task can never do without, or a body comes too near to another one.
"""
numbered(VELOCITY="LOST_BY_VELOCITY", SINGULAR="LOST_BY_SINGULARITY")(Survival)
