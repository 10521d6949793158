"""Commands to a planner between its steps, as compiled calls on its record."""

from collections.abc import Mapping
from copy import copy
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import ArmSession, Call, Session, bound, rooms
from ftqp.kernel.layout.enums import ALL_USABLE, TARGET_SIZE
from ftqp.kernel.layout.record import dtype

LIMITS = ("q_min", "q_max", "v_max", "a_max", "tau_max")


@final
class ReserveSamples:
    """Samples of what braking takes: ``rows`` has q, v, |h| and |M| of each, (samples, 3 n + n^2)."""

    def __init__(
        self, constants: dict[str, Any], q: FloatArray, v: FloatArray, load: "Load | None" = None
    ) -> None:
        n = q.shape[1]
        arm = ArmSession(constants)
        if load is not None:
            session = Session(n)
            PlannerCommands(session, arm, {}).carry(load)
        self.rows = np.zeros((len(q), n * (n + 3)))
        self.rows[:, :n], self.rows[:, n : 2 * n] = q, v
        arm.bind("sample_reserve", self.rows, len(q))()
        self._n = n

    def shares(self, a_max: FloatArray, tau_max: FloatArray) -> tuple[float, float]:
        """Shares of a_max: that braking may count on, and up to which torque limits hold."""
        out = np.zeros(1, dtype("reserve"))
        given = np.ascontiguousarray(a_max), np.ascontiguousarray(tau_max)
        bound("reserve_shares", self.rows, len(self.rows), self._n, *given, out)()
        return float(out["share"][0]), float(out["guard"][0])


@final
class Load:
    """A load in the frame of the robot's own tip; a mass of 0 is none, the inertia is about ``com``."""

    def __init__(self, mass: float, com: Any = (0.0, 0.0, 0.0), inertia: Any = 0.0) -> None:
        self.memory = np.zeros(1, dtype("load"))
        self.memory["mass"], self.memory["com"] = mass, com
        self.memory["inertia"] = np.broadcast_to(inertia, (3, 3)).ravel()


NO_LOAD = Load(0.0)
"""What an arm without a load carries, exactly."""


@final
class PlannerCommands:
    """Commands to a planner between its steps; ``arm`` is the arm by itself, loaded as the record is."""

    def __init__(self, session: Session, arm: ArmSession, given: Mapping[str, Any]) -> None:
        self._session, self._arm = session, arm
        self.memory = np.zeros(1, dtype("given"))
        self.given: Any = rooms(self.memory)
        for name, value in given.items():
            field = getattr(self.given, name)
            if isinstance(field, np.ndarray) and field.ndim:
                field[: len(value)] = value
            else:
                setattr(self.given, name, value)
        self._know_body()
        self._shares = np.zeros(1, dtype("reserve"))
        n = len(arm.joints)
        self.expected = np.zeros(n)
        self.target, self._later = np.zeros(TARGET_SIZE), np.zeros(TARGET_SIZE)
        self._calls: dict[str, Call] = {}

    def _know_body(self) -> None:
        """The body that moves with the robot's own tip, as it is before any command."""
        given, chain = self.given, self._arm.K.chain
        body = given.body = int(chain.tip_joint)
        given.tip_rotation[:], given.tip_translation[:] = chain.tip_rotation, chain.tip_translation
        given.body_mass, given.body_lever = chain.mass[body], chain.lever[body]
        given.body_stoutness = chain.stoutness[body]
        given.body_com[:], given.body_inertia[:] = chain.com[body], chain.inertia[body]

    def on(self, session: Session) -> "PlannerCommands":
        """The same for a copy of the planner's session, with an arm of their own."""
        other = PlannerCommands(session, copy(self._arm), {})
        other.memory[:] = self.memory
        return other

    @property
    def arm(self) -> Any:
        """The record of the arm by itself, (1,)."""
        return self._arm.memory

    def _call(self, name: str, *first: Any) -> Call:
        """An entry point on the record, looked up once."""
        found = self._calls.get(name)
        if found is None:
            found = self._calls[name] = self._session.bind(name, *first)
        return found

    def believe(self, fault: Any, goes_on: bool) -> None:
        """Believe what a record of kind ``fault``, (1,), says of a joint."""
        self._session.bind("believe", self.memory, fault)(int(goes_on))

    def respond(self, joint: int) -> int:
        """What becomes of a joint by what the monitor says of it, see ``believed.respond``."""
        return self._call("respond", self.memory)(joint)

    def forget_finding(self, joint: int) -> None:
        """Forget what was found of a joint."""
        self._call("forget_finding")(joint)

    def believed(self) -> None:
        """What begins anew after faults were reported."""
        self._call("believed", self.memory)()

    def count_on(self, samples: ReserveSamples | None) -> None:
        """Let braking count on what motors certainly have; None where torque is not limited."""
        rows = self._shares if samples is None else samples.rows
        count = 0 if samples is None else len(samples.rows)
        self._session.bind("count_on", self.memory, rows, count, self._shares)()

    def hold_up(self, joint: int) -> bool:
        """Whether a joint that has lost torque cannot hold the arm, which is then stopped."""
        return bool(self._call("hold_up", self._arm.memory)(joint))

    def ask_for_brake(self, joint: int) -> None:
        """Let the brake of a joint be asked for."""
        self._call("ask_for_brake")(joint)

    def start(self, q: FloatArray, v: FloatArray) -> None:
        """Begin at joint positions and velocities, (n,) each."""
        self._session.bind("start", self.memory, np.ascontiguousarray(q), np.ascontiguousarray(v))()

    def stop(self, reason: int) -> None:
        """Latch a stop, if none is."""
        self._call("stop")(int(reason))

    def resume(self) -> bool:
        """Release a stop; False where something forbids it."""
        return bool(self._call("resume")())

    def carry(self, load: Load) -> None:
        """Count on a load at the tip."""
        self._session.bind("carry", self._arm.memory, self.memory, load.memory)()

    def hold(self, place: FloatArray) -> None:
        """Control the point at a pose, (4, 4), in the frame of the robot's own tip."""
        self._session.bind("hold", self.memory, np.ascontiguousarray(place))()

    def aim(self, task: int, target: FloatArray) -> None:
        """Let the goal of a further task be that of a packed target, (28,) or more."""
        self._call("aim", self.memory)(task, target.ctypes.data)

    def give_up(self) -> bool:
        """Whether the next set of rows of the task was given up; False where no more may be."""
        return bool(self._call("give_up")())

    def miss(self, target: Any, row: int, left: int) -> int:
        """Let the next tick, of ``expected`` and ``target``, be one that was missed: 0, or a mistake."""
        found = self._call("miss_tick")
        addresses = (self.expected.ctypes.data, self._later.ctypes.data, self.target.ctypes.data)
        return found(target, row, left, *addresses)

    def measure_again(self) -> None:
        """The next tick is measured again."""
        self._session.K.state.unusable = ALL_USABLE
