"""What the monitor of joints that do not obey supposes, how long that has to last, and what is then done.

The evidence is computed in ``ftqp.kernel.feedback``, which guards every arm, and in
``ftqp.kernel.detection``, which looks closer where somebody asked for a detector. A hypothesis that has
lasted is answered by ``ftqp.kernel.feedback.monitor``, what a detector finds by
``ftqp.control.planner.response``.
"""

from enum import IntEnum
from typing import TYPE_CHECKING, Final, NamedTuple

from ftqp.kernel.layout.enums import numbered

if TYPE_CHECKING:
    from ftqp.kernel.layout.enums import __getattr__ as __getattr__


@numbered()
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
    MOVES = 11
    """A joint is seen to move although its command rests: a mean over so long."""
    REPEATS = 12
    """An encoder repeats its number although its joint was seen to move and should go on."""
    FROZEN = 13
    """It does so while the joint should have left the noise and what is normal for it."""
    DROPPED = 14
    """An encoder gives no numbers."""
    BIASED = 15
    """An encoder's numbers are off by the same."""
    WILD = 16
    """An encoder's numbers are off by whatever."""
    STANDS = 17
    """A detector: the joint that explains the residuals stands though it should move."""
    WEAK = 18
    """A detector: the joint that explains them runs away, or gives less torque than asked."""
    PUSHED = 19
    """A detector: a force at the tip explains them better than any joint."""
    QUIET = 20
    """A detector: nothing is left of what was suspected."""
    UNDECIDED = 21
    """A detector: what is suspected has led to no finding."""


class Row(NamedTuple):
    """A hypothesis, and the seconds that it has to last; ``docs/theory/feedback.md`` says what is then done.

    Attributes:
        hypothesis: Which.
        torque: For so long on an arm that takes torques [s].
        servo: For so long on one whose servos hold it [s].
        chosen: Who chose the times, or the number.
        samples: So many samples, or verdicts, in a row in place of times.
    """

    hypothesis: Hypothesis
    torque: float
    servo: float
    chosen: str
    samples: int = 0


PHYSICS = "`ftqp campaign physics`"
FREEZES, FINDS = "`python studies/frozen_encoders.py`", "`python studies/detection.py`"
TOUCHES = "`python studies/touches.py`"
H = Hypothesis
MONITOR: Final = (
    Row(H.LEFT_BAND, 0.02, 0.02, PHYSICS),
    Row(H.TOO_FAST, 0.01, 0.1, PHYSICS),
    Row(H.SILENT, 0.003, 0.003, PHYSICS),
    Row(H.OBEYS, 0.2, 0.2, PHYSICS),
    Row(H.CLEARED, 0.05, 0.05, PHYSICS),
    Row(H.PREDICTED, 0.005, 0.005, PHYSICS),
    Row(H.BOTH_OBEY, 0.2, 0.2, PHYSICS),
    Row(H.TOUCHED, 0.01, 0.01, TOUCHES),
    Row(H.ALONE_AGAIN, 0.1, 0.1, TOUCHES),
    Row(H.LAGS, 0.02, 0.02, PHYSICS),
    Row(H.FOLLOWS, 0.05, 0.05, PHYSICS),
    Row(H.MOVES, 0.02, 0.02, PHYSICS),
    Row(H.REPEATS, 0.0, 0.0, FREEZES, 2),
    Row(H.FROZEN, 0.0, 0.0, FREEZES, 5),
    Row(H.DROPPED, 0.0, 0.0, FINDS, 3),
    Row(H.BIASED, 0.0, 0.0, FINDS, 3),
    Row(H.WILD, 0.0, 0.0, FINDS, 10),
    Row(H.STANDS, 0.0, 0.0, FINDS, 9),
    Row(H.WEAK, 0.0, 0.0, FINDS, 5),
    Row(H.PUSHED, 0.0, 0.0, TOUCHES, 3),
    Row(H.QUIET, 0.0, 0.0, FINDS, 300),
    Row(H.UNDECIDED, 0.0, 0.0, FINDS, 200),
)
"""All that is supposed. Times and numbers are guesses that the campaigns and studies named beside them have
not contradicted; what is supposed of the whole arm is counted at joint 0."""
HYPOTHESES: Final = int(Hypothesis.MOVES)
"""So many are counted by ``ftqp.kernel.feedback.lasting``; the others by who computes their evidence."""
TORQUE_TIMES: Final = tuple(row.torque for row in MONITOR[:HYPOTHESES])
SERVO_TIMES: Final = tuple(row.servo for row in MONITOR[:HYPOTHESES])
MEAN_TIME: Final = MONITOR[Hypothesis.MOVES].torque
(
    HELD_SAMPLES, FROZEN_SAMPLES, DROPPED_AFTER, BIASED_AFTER, WILD_AFTER, STANDING_VERDICTS, VERDICTS,
    SURE_OF_PUSH, CALM_TICKS, LONGEST_FIT,
) = (row.samples for row in MONITOR[Hypothesis.REPEATS:])  # fmt: skip
"""Times and numbers, as compiled code reads them."""
