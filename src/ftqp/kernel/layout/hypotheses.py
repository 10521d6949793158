"""What the monitor of joints that do not obey supposes, how long that has to last, and what is then done.

The evidence is computed in ``ftqp.kernel.feedback``, which guards every arm. A hypothesis that has lasted is
answered by ``ftqp.kernel.feedback.monitor``; who has failed is said by ``ftqp.kernel.monitor``.
"""

from enum import IntEnum
from typing import TYPE_CHECKING, Final

from ftqp.kernel.layout.enums import numbered

if TYPE_CHECKING:
    from ftqp.kernel.layout.enums import __getattr__ as __getattr__


@numbered()
class Hypothesis(IntEnum):
    """What may be the case with a joint, or with the arm; ``docs/theory/feedback.md`` says what is then done.

    Each has how long it has to last on an arm that takes torques, and on one whose servos hold it [s]; the
    runs that chose these times are named there. What is supposed of the whole arm is counted at joint 0.
    """

    torque: float
    servo: float

    def __new__(cls, number: int, torque: float, servo: float | None = None) -> "Hypothesis":
        made = int.__new__(cls, number)
        made._value_, made.torque, made.servo = number, torque, torque if servo is None else servo
        return made

    LEFT_BAND = 0, 0.02
    """A joint is outside its error band although the arm is being stopped."""
    TOO_FAST = 1, 0.01, 0.1
    """A joint is faster than its command and its limit by 20 % of that."""
    BOTH_OBEY = 2, 0.2
    """Two joints on nearly one axis, which were made soft, are where their commands are."""
    TOUCHED = 3, 0.01
    """A force at the tip explains the torques that are unusual, and no single motor does."""
    ALONE_AGAIN = 4, 0.1
    """Nothing unusual is left of a touch."""
    LAGS = 5, 0.02
    """A joint is outside its error band."""
    FOLLOWS = 6, 0.05
    """All errors are below half of what is tolerated."""
    MOVES = 7, 0.02
    """A joint is seen to move although its command rests: a mean over so long."""


HYPOTHESES: Final = int(Hypothesis.MOVES)
"""So many are counted by ``ftqp.kernel.feedback.persistence``; the last by who computes its evidence."""
TORQUE_TIMES: Final = tuple(row.torque for row in list(Hypothesis)[:HYPOTHESES])
SERVO_TIMES: Final = tuple(row.servo for row in list(Hypothesis)[:HYPOTHESES])
MEAN_TIME: Final = Hypothesis.MOVES.torque
"""Times, as compiled code reads them."""
HELD_SAMPLES: Final = 2
"""An encoder so often repeats its number although its joint was seen to move and should go on ..."""
FROZEN_SAMPLES: Final = 5
"""... or, so often, should have left the noise and what is normal for it."""
