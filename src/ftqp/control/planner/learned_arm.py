"""What a torque arm's planner has learned that its model does not say."""

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray, frozen
from ftqp.kernel.entry.session import Session
from ftqp.model.payload import Payload

LEAST_LOAD = 0.05
"""A load lighter than this [kg] is not named, because friction that is not learned yet looks like so much. A
guess that the campaigns have not contradicted."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Learned:
    """What the arm has beside its model, as learned since ``reset``.

    Attributes:
        rotors: Inertia of each joint's rotor beside that of the model, (nv,) [kg m2 or kg]; negative where
            the model has too much.
        rotors_error: Their standard deviations, (nv,); large for joints that were hardly accelerated.
        friction: Dry friction of each joint, (nv,) [N m or N], that of the model included, as it is not fed
            forward.
        delay: How much later samples come than the drive's ``latency`` says [s], as far as the arm has
            shaken, which alone tells.
        payload: The load at the tip beside what the planner carries, as a point mass; None is none.
    """

    rotors: FloatArray
    rotors_error: FloatArray
    friction: FloatArray
    delay: float
    payload: Payload | None

    def facts(self) -> dict[str, Any]:
        """The same as anything JSON can hold, for logs: ``payload`` has its mass and its centre."""
        load = self.payload
        return {
            "rotors": self.rotors.tolist(),
            "rotors_error": self.rotors_error.tolist(),
            "friction": self.friction.tolist(),
            "delay": self.delay,
            "payload": None if load is None else {"mass": load.mass, "com": load.com.tolist()},
        }


def learned(session: Session, joints: int) -> Learned | None:
    """What the planner of this session has learned; None where it does not learn, or has not begun.

    Args:
        session: The planner's.
        joints: How many the arm has.
    """
    K = session.K
    room, chain = K.learned, K.chain
    if not room.on or not room.based:
        return None
    mass, payload = float(room.load[0]), None
    if mass > LEAST_LOAD:
        away = np.array(room.load[1:4]) / mass - chain.tip_translation
        payload = Payload(mass, np.reshape(chain.tip_rotation, (3, 3)).T @ away)
    return Learned(
        rotors=frozen(room.rotor[:joints]),
        rotors_error=frozen(room.sigma[:joints]),
        friction=frozen(room.friction[:joints]),
        delay=float(room.later) * float(K.state.dt),
        payload=payload,
    )
