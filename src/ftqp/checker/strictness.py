"""How strictly a run is judged: to rounding where the plant is exact, to some percent in physics."""

from dataclasses import dataclass
from typing import final


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Strictness:
    """What is let pass.

    Attributes:
        speed: Share of the speed limit.
        acceleration: Share of the acceleration limit.
        torque: Share of the torque limit.
        position: Beyond the range of a joint, in all [rad or m].
        plane: Beyond the plane of a point [m].
        body: Nearer than bodies are to be kept apart [m].
        creep: How far a locked joint may move, or be sent, in all [rad or m].
        standing: Speed below which a locked joint stands [rad/s or m/s].
        grace: How long a claim may be wrong [s].
        blow: How long a joint that strikes its end stop throws the others [s].
        calm: How long an arm whose target rests may take to come to rest [s].
        noise: Standard deviation of the measured positions [rad or m].
    """

    speed: float = 1e-9
    acceleration: float = 1e-6
    torque: float = 1e-6
    position: float = 1e-9
    plane: float = 2e-5
    body: float = 1e-3
    creep: float = 0.0
    standing: float = 0.0
    grace: float = 0.0
    blow: float = 0.0
    calm: float = 1.0
    noise: float = 0.0


KINEMATIC = Strictness()
"""Of a plant that does exactly what it is told."""
PHYSICS = Strictness(
    speed=0.02,
    acceleration=float("inf"),
    torque=0.02,
    position=0.02,
    plane=0.01,
    body=0.01,
    creep=5e-4,
    standing=1e-2,
    grace=0.1,
    blow=5e-3,
    calm=2.0,
)
"""Of an arm with drives, sensors and friction: 2 %, and a tenth of a second to notice what happened."""
