"""FreeJoint: the ticks of a planner one of whose joints swings freely, and what is said of it."""

import logging
from collections.abc import Mapping
from math import ceil, isfinite
from typing import Any, NamedTuple, final

from ftqp.control.planner.stages import FREE, Stage, Tick
from ftqp.faults.belief import Belief
from ftqp.kernel.entry.session import Memory, Session
from ftqp.kernel.layout.enums import ARREST, DECIDE, FOLLOW, HOLD, MAKE_UP, STOPPED, TARGET_HAS_ROTATION, Kept
from ftqp.kernel.layout.enums import FREE as SWINGS
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
KEPT_OF = {"pose": Kept.POSE, "position_axis": Kept.POSITION_AXIS, "position": Kept.POSITION}
"""The sets of rows by their names."""
ON_TASK = (FOLLOW, MAKE_UP)
"""What the others do where the task goes on."""
STILL_SWING = 0.01
"""A joint that swings no farther than this hangs at rest [rad or m] ..."""
STILL_DRIFT = 1e-3
"""... and one that drifts no faster than this rests [rad/s or m/s]."""
HELD = {
    Kept.NOTHING: "the task is given up, the remaining joints move it to where it can hang still",
    Kept.POSE: "end effector held at its pose",
    Kept.POSITION_AXIS: "end effector held at its position and axis, rotation about it given up",
    Kept.POSITION: "end effector held at its position, attitude given up",
}


class Impact(NamedTuple):
    """The impact of a free-swinging joint on its end stop, as it is expected.

    Attributes:
        time: When, from now on [s].
        speed: How fast [rad/s or m/s].
        energy: The joint's kinetic energy then, 1/2 M_ii v_i^2 [J].
        side: Which stop, ``lower`` or ``upper``.
    """

    time: float
    speed: float
    energy: float
    side: str


@final
class FreeJoint:
    """The compiled tick for an arm with a free-swinging joint, from when one is believed in."""

    def __init__(self, session: Session, robot: Robot, parts: Mapping[str, Any]) -> None:
        self._session, self._joints, self._parts = session, robot.joints, parts
        self._tick: Tick | None = None
        self._said: Any = None
        self._on = False

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(ticks=(FREE,), after=self.tell, believe=self.believe)

    @property
    def tick(self) -> Tick | None:
        """The tick beside the joint; None while no joint is believed to swing freely."""
        return self._tick if self._on else None

    @property
    def leads(self) -> bool:
        """Whether a free-swinging joint, and not the task, leads the arm, or that is yet to be seen."""
        if not self._on or not (self._session.K.faults.code == SWINGS).any():
            return False
        free = self._session.K.free
        return not (free.joint >= 0 and free.mode == FOLLOW)

    def held_target(self, leader: Memory) -> Any:
        """The packed target at which a path stops; None where it has not begun."""
        task, target = self._session.K.task, leader.fields.target
        leader.fields.rate = 0.0
        return None if task.uses_rotation and not target[TARGET_HAS_ROTATION] else target

    def believe(self, belief: Belief) -> None:
        """From the next tick on the arm has a free-swinging joint, another one than before, or none."""
        if belief.needs_dynamics and self._tick is None:
            self._memory = Memory("free")
            self._tick = self._session.bind("step_free", self._memory.memory)
        self._on = belief.needs_dynamics
        self._said = None

    def tell(self, code: int, _inputs: tuple[Any, ...]) -> None:
        """Log a change of what the operator should know after a tick."""
        parts = self._parts
        key = (*(int(parts[name][0]) for name in ("free_mode", "free_rows", "impact_side")), code == STOPPED)
        if key != self._said and code >= 0:
            self._said = key
            sentence = notice(parts, self._joints)
            if sentence is not None:
                _LOG.warning(sentence)


def impact(parts: Any) -> Impact | None:
    """The expected impact, or None."""
    side = int(parts["impact_side"][0])
    if parts["free_joint"][0] < 0 or side == 0:
        return None
    time, speed, energy = (float(parts[name][0]) for name in ("impact_time", "impact_speed", "impact_energy"))
    return Impact(time, speed, energy, "lower" if side < 0 else "upper")


def notice(parts: Any, joints: tuple[str, ...]) -> str | None:
    """What the operator should know of a free-swinging joint now; None without one."""
    i = int(parts["free_joint"][0])
    if i < 0:
        return None
    joint, mode, hit = joints[i], int(parts["free_mode"][0]), impact(parts)
    reach = 10.0 * float(parts["reach"][0])
    clear = "keep clear"
    if isfinite(reach):
        clear += f", links go up to {max(1, ceil(reach)) / 10.0:.1f} m from where they were"
    if mode == DECIDE:
        return f"{joint} swings freely: the remaining joints brake while it is decided what can be kept"
    if mode == HOLD:
        return f"{joint} swings freely: {HELD[Kept(int(parts['free_rows'][0]))]}"
    if mode == MAKE_UP:
        return f"{joint} has no motor: the remaining joints keep the task and make up for its measured motion"
    if mode == FOLLOW:
        return _drifting(joint, float(parts["drift"][0]), float(parts["drift_time"][0]))
    if hit is not None and hit.speed > 0.0 and not parts["contact"][i]:
        others = (
            "the remaining joints move to soften it" if mode == ARREST else "the remaining joints hold still"
        )
        return (
            f"{joint} swings freely and will hit its {hit.side} stop in {hit.time:.2f} s at {hit.speed:.1f} "
            f"rad/s ({hit.energy:.0f} J): {others}; {clear}"
        )
    if mode == ARREST:
        return f"{joint} swings freely: the remaining joints move to catch it; {clear}"
    if parts["contact"][i]:
        return f"{joint} lies still on its {'lower' if parts['contact'][i] > 0 else 'upper'} stop"
    swing = float(parts["swing"][0])
    if swing > STILL_SWING:
        undamped = parts["viscous"][i] == 0.0 and parts["coulomb"][i] == 0.0
        end = ", no friction: will not come to rest" if undamped else ""
        return f"{joint} is still swinging, +-{swing:.1g} rad{end}"
    return f"{joint} hangs still"


def _drifting(joint: str, drift: float, time: float) -> str:
    if abs(drift) < STILL_DRIFT:
        return f"{joint} has no gravity and stands still: the remaining joints keep the task"
    until = f": {time:.0f} s to its stop" if isfinite(time) else " and does not reach its stop"
    return f"{joint} has no gravity and drifts at {abs(drift):.1g} rad/s{until}"
