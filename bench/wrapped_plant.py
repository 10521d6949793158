"""A plant around another one, for those who look at commands or change them."""

from typing import Any

from ftqp.sim.plants.plant import Plant


class WrappedPlant(Plant):
    """Hands everything on but the commands; ``advance`` is the subclass's.

    Args:
        plant: The plant within.
    """

    def __init__(self, plant: Plant) -> None:
        self._plant = plant

    q = property(lambda self: self._plant.q)
    v = property(lambda self: self._plant.v)
    drive = property(lambda self: self._plant.drive)
    tolerance = property(lambda self: self._plant.tolerance)
    motors = property(lambda self: self._plant.motors)
    failure = property(lambda self: self._plant.failure)

    def reset(self, q: Any, v: Any) -> None:
        """Put the arm at (q, v)."""
        self._plant.reset(q, v)

    def fail(self, fault: Any) -> None:
        """Let a joint fail."""
        self._plant.fail(fault)

    def repair(self, joint: Any) -> None:
        """Let a joint work again."""
        self._plant.repair(joint)
