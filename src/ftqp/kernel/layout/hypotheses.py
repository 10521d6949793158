"""What the monitor of joints that do not obey supposes, how long that has to last, and what is then done.

The evidence is computed in ``ftqp.kernel.feedback``, a hypothesis that has lasted is answered by
``ftqp.kernel.feedback.monitor``.
"""

from enum import IntEnum
from typing import Final, NamedTuple


class Hypothesis(IntEnum):
    """What may be the case with a joint, or with the arm."""

    LEFT_BAND = 0
    """A joint is outside its error band although the arm is being stopped."""
    TOO_FAST = 1
    """A joint is faster than its command and its limit by 20 % of that."""
    SILENT = 2
    """The motor of one joint alone explains the torques that are unusual: it does not give what is sent."""
    OBEYS = 3
    """A joint that was left out has been where its own loop would have it."""
    CLEARED = 4
    """The same for less long, which is enough where another joint is suspected."""
    PREDICTED = 5
    """A joint that was left out moves as it would if it obeyed, and not as if it did not."""
    BOTH_OBEY = 6
    """Two joints on nearly one axis, which were made soft, are where their commands are."""
    TOUCHED = 7
    """A force at the tip explains the torques that are unusual, and no single motor does."""
    ALONE_AGAIN = 8
    """Nothing unusual is left of a touch."""
    LAGS = 9
    """A joint is outside its error band."""
    FOLLOWS = 10
    """All errors are below half of what is tolerated."""


class Response(IntEnum):
    """What is done about it."""

    BRAKE = 0
    """The joint asks for its brake."""
    BRAKE_AND_STOP = 1
    """And the arm is stopped."""
    LEAVE_OUT = 2
    """The others reckon with what the joint does, not with what it should."""
    TAKE_BACK = 3
    """They reckon with what it should do again."""
    SUSPECT_OTHERS = 4
    """Another joint may be left out in its place."""
    STIFFEN = 5
    """The feedback of the pair is what it was."""
    NAME = 6
    """The force is named, ``planner.touch``; no joint is suspected meanwhile."""
    FORGET = 7
    """No force is named any more."""
    SAY_LAGGING = 8
    SAY_OK = 9


class Row(NamedTuple):
    """A hypothesis, the seconds that it has to last, and the response.

    Attributes:
        hypothesis: Which.
        torque: For so long on an arm that takes torques [s].
        servo: For so long on one whose servos hold it [s].
        response: What is done then.
        chosen: Who chose the times.
    """

    hypothesis: Hypothesis
    torque: float
    servo: float
    response: Response
    chosen: str


PHYSICS = "`ftqp campaign physics`"
TRUTHS = "`ftqp campaign wrong-model`"
H, R = Hypothesis, Response
MONITOR: Final = (
    Row(H.LEFT_BAND, 0.02, 0.02, R.BRAKE, PHYSICS),
    Row(H.TOO_FAST, 0.01, 0.1, R.BRAKE_AND_STOP, PHYSICS),
    Row(H.SILENT, 0.003, 0.003, R.LEAVE_OUT, PHYSICS),
    Row(H.OBEYS, 0.2, 0.2, R.TAKE_BACK, PHYSICS),
    Row(H.CLEARED, 0.05, 0.05, R.SUSPECT_OTHERS, PHYSICS),
    Row(H.PREDICTED, 0.005, 0.005, R.TAKE_BACK, PHYSICS),
    Row(H.BOTH_OBEY, 0.2, 0.2, R.STIFFEN, PHYSICS),
    Row(H.TOUCHED, 0.01, 0.01, R.NAME, "`python studies/touches.py`"),
    Row(H.ALONE_AGAIN, 0.1, 0.1, R.FORGET, "`python studies/touches.py`"),
    Row(H.LAGS, 0.02, 0.02, R.SAY_LAGGING, PHYSICS),
    Row(H.FOLLOWS, 0.05, 0.05, R.SAY_OK, PHYSICS),
)
"""All that the monitor supposes. The times are guesses that the campaigns named beside them have not
contradicted; what is supposed of the whole arm is counted at joint 0."""
HYPOTHESES: Final = len(MONITOR)
TORQUE_TIMES: Final = tuple(row.torque for row in MONITOR)
SERVO_TIMES: Final = tuple(row.servo for row in MONITOR)
"""The times, as compiled code reads them."""
(
    LEFT_BAND, TOO_FAST, SILENT, OBEYS, CLEARED, PREDICTED, BOTH_OBEY, TOUCHED, ALONE_AGAIN, LAGS, FOLLOWS,
) = map(int, Hypothesis)  # fmt: skip
