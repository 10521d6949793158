"""For how long a hypothesis of the monitor has had evidence without a break."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import TORQUE_DRIVE
from ftqp.kernel.layout.hypotheses import HYPOTHESES, SERVO_TIMES, TORQUE_TIMES


@jit
def persisted(state: Any, feedback: Any, hypothesis: int, i: int, evidence: bool) -> bool:
    """Whether a hypothesis of joint i has lasted, this tick's evidence counted; without any it is dropped."""
    count = feedback.persistence[hypothesis, i] + 1 if evidence else 0
    feedback.persistence[hypothesis, i] = count
    return has_persisted(state, feedback, hypothesis, i)


@jit
def has_persisted(state: Any, feedback: Any, hypothesis: int, i: int) -> bool:
    """Whether a hypothesis of joint i had evidence, for as long as the table of hypotheses says.

    A loop that is slower than the table's time needs one sample of it.
    """
    torque = feedback.kind == TORQUE_DRIVE
    time = TORQUE_TIMES[hypothesis] if torque else SERVO_TIMES[hypothesis]
    lasted: bool = feedback.persistence[hypothesis, i] * state.dt > max(time - 0.5 * state.dt, 0.0)
    return lasted


@jit
def reset_counter(feedback: Any, i: int) -> None:
    """Nothing is supposed of joint i any more."""
    for hypothesis in range(HYPOTHESES):
        feedback.persistence[hypothesis, i] = 0
