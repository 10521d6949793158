"""Sessions: the one owner of records, their addresses and their keys.

Whoever drives the kernel from Python holds a session, reads and writes its rooms by attribute
(``session.K.task.kp``) and calls what ``bind`` gives. No address leaves this module but inside such a call.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, seen
from ftqp.kernel.compiled.kernel import load
from ftqp.kernel.entry.table import ENTRIES
from ftqp.kernel.layout.record import check_joints, dtype, in_line, load_chain, memory, record

Call = Callable[..., int]
WORD = 8
"""Bytes of a word, which every number of a record takes. A convention of the layout."""


def rooms(memory: Any) -> Any:
    """The first record of a structured array, (1,), its fields as attributes that can be written."""
    return memory.view(np.recarray)[0]


def bound(name: str, *things: Any) -> Call:
    """An entry point with its first arguments given: numbers as they are, arrays by their address, None as 0.

    The caller keeps the arrays alive as long as it may call.
    """
    return partial(load(ENTRIES[name]), *map(_number, things))


def _number(thing: Any) -> int:
    """A whole number as it is, an array as its address, and nothing as 0."""
    if thing is None or isinstance(thing, int):
        return thing or 0
    return int(thing.ctypes.data)


def writer_of(target: FloatArray) -> Call:
    """What writes (pose, twist, acceleration) into a packed target, (29,): 0, or a mistake.

    The caller keeps the target alive as long as it may call.
    """
    return bound("write_target", target)


def write_together(changes: Sequence[tuple[Any, Any]]) -> None:
    """Write arrays into others in one compiled call: all of them, or none where an exception comes before."""
    table = np.array(
        [(to.ctypes.data, given.ctypes.data, given.nbytes // WORD) for to, given in changes], dtype=np.int64
    )
    bound("write_together", table, len(table))()


class Session:
    """A planner's record.

    Attributes:
        K: The rooms of the record, by attribute.
    """

    def __init__(self, joints: int) -> None:
        check_joints(joints)
        self._memory = record()
        self._begin(())

    def _begin(self, lent: tuple[FloatArray, ...]) -> None:
        self.K: Any = rooms(self._memory)
        self._twin: Session | None = None
        self._lent = lent

    @property
    def memory(self) -> Any:
        """The record itself, (1,)."""
        return self._memory

    def bind(self, name: str, *things: Any) -> Call:
        """An entry point on this record, further first arguments given; see ``bound``."""
        return bound(name, self._memory, *things)

    def field(self, room: str, name: str) -> Any:
        """A field as an array that follows the record: (1,) for a number, else of the field's own shape."""
        view = self._memory[room][name]
        return view if view.ndim == 1 else view[0]

    def view(self, room: str, name: str) -> Any:
        """The same, for those who only read."""
        return seen(self.field(room, name))

    def copy(self) -> "Session":
        """A session of its own that holds the same, with the scene as it is now for good."""
        other = Session.__new__(Session)
        other._memory = in_line(self._memory)
        other._begin(self._balls)
        other.K.scene.version_at = 0
        return other

    @property
    def _balls(self) -> tuple[FloatArray, ...]:
        """The balls at which the record looks now."""
        at = int(self.K.scene.cloud_at)
        return tuple(one for one in self._lent if one.ctypes.data == at)

    def lend(self, balls: FloatArray) -> int:
        """The address of balls of a cloud, (K, 4), which live while this record or a copy looks at them."""
        self._lent = (balls, *self._balls)
        return int(balls.ctypes.data)

    def torques(self) -> Call:
        """What fills in the torques of the last command, where the tick did without them."""
        return self.bind("torques")

    def pair_distances(self, postures: FloatArray) -> FloatArray:
        """The distances of all pairs of bodies at some postures, (S, nv): (S, pairs) [m].

        They are measured on a copy, so that the record is as it was.
        """
        if self._twin is None:
            self._twin = self.copy()
        for room in ("scene", "chain"):
            self._twin._memory[room] = self._memory[room]
        q = np.ascontiguousarray(postures, dtype=np.float64)
        found = np.zeros((len(q), int(self.K.scene.pairs)))
        self._twin.bind("pair_distances", q, found, len(q))()
        return found

    def __getstate__(self) -> dict[str, Any]:
        return {"memory": self._memory, "balls": self._balls}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._memory = in_line(state["memory"])
        self._begin(state["balls"])
        self.K.scene.version_at = 0
        for balls in state["balls"]:
            self.K.scene.cloud_at = balls.ctypes.data


class Reduced:
    """A reduced problem of the closed forms.

    Attributes:
        memory: The record, (1,).
        P: Its fields, by attribute.
    """

    def __init__(self, joints: int) -> None:
        check_joints(joints)
        self.memory = memory("reduced")
        self.P: Any = rooms(self.memory)

    def resolve(self) -> None:
        """Solve it by its method."""
        bound("resolve_reduced", self.memory)()

    def damp(self) -> None:
        """Find kappa by its rule."""
        bound("kappa", self.memory)()

    def __getstate__(self) -> dict[str, Any]:
        return {"memory": self.memory}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.memory = in_line(state["memory"])
        self.P = rooms(self.memory)


class ArmSession:
    """Kinematics and dynamics of one arm, apart from any planner.

    Args:
        constants: those of the chain, by the argument names of ``load_chain``.

    Attributes:
        K: the rooms ``state``, ``kinematics`` and ``chain``.
    """

    def __init__(self, constants: dict[str, Any]) -> None:
        joints = len(constants["mass"])
        check_joints(joints)
        self._memory = np.zeros(1, dtype("arm"))
        self.K: Any = rooms(self._memory)
        load_chain(self.K, **constants)
        self._q, self._v = self.K.state.given_q, self.K.state.given_v
        self._joints = joints
        self._kinematics: Call | None = None
        self._dynamics: Call | None = None

    @property
    def memory(self) -> Any:
        """The record, (1,)."""
        return self._memory

    @property
    def joints(self) -> range:
        """Its joints by number."""
        return range(self._joints)

    def bind(self, name: str, *things: Any) -> Call:
        """An entry point on this record, further first arguments given; see ``bound``."""
        return bound(name, self._memory, *things)

    def adopt(self, session: Session) -> None:
        """Be the arm of a planner as it is fitted now, with its tool and its load; of the same size."""
        self._memory["chain"] = session._memory["chain"]

    def kinematics(self, q: FloatArray, v: FloatArray | None = None) -> None:
        """Tip pose, J and drift at (q, v) into the room ``kinematics``; v None is rest."""
        if self._kinematics is None:
            self._kinematics = bound("kinematics", self._memory)
        self._kinematics(self._given(q, v))

    def dynamics(self, q: FloatArray, v: FloatArray | None = None) -> None:
        """Everything of ``kinematics``, and M and h."""
        if self._dynamics is None:
            self._dynamics = bound("inverse_dynamics", self._memory)
        self._dynamics(self._given(q, v))

    def servos(self, servo: "ServoMemory") -> Call:
        """What puts the torques of servos at (q, v) under the limits given into their memory; 1: one is full.

        It leaves M and h of that state in the room ``kinematics``.
        """
        return bound("servo_torques", self._memory, servo.memory)

    def _given(self, q: FloatArray, v: FloatArray | None) -> int:
        self._q[: len(q)] = q
        self._v[: self._joints] = 0.0 if v is None else v
        return len(q)

    def __getstate__(self) -> dict[str, Any]:
        return {"memory": self._memory, "joints": self._joints}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._memory, self._joints = in_line(state["memory"]), state["joints"]
        self.K = rooms(self._memory)
        self._q, self._v = self.K.state.given_q, self.K.state.given_v
        self._kinematics = self._dynamics = None


class PathMemory:
    """The record of a path that is followed by its progress.

    Attributes:
        memory: The record, (1,).
        path: Its fields, by attribute.
        table: The path's intervals, (rows, 50).
    """

    def __init__(self, table: FloatArray) -> None:
        self.memory = np.zeros(1, dtype("path"))
        self.path: Any = rooms(self.memory)
        self.table = np.ascontiguousarray(table)

    def begin(self) -> None:
        """Let the path begin anew."""
        bound("begin_path", self.memory)()

    def arguments(self) -> tuple[Any, ...]:
        """What the entry points take for it."""
        return self.memory, self.table, len(self.table)


class FreeMemory:
    """Work memory of a planner one of whose joints swings freely.

    Attributes:
        memory: The record, (1,).
        F: Its fields, by attribute.
    """

    def __init__(self) -> None:
        self.memory = np.zeros(1, dtype("free"))
        self.F: Any = rooms(self.memory)


class BaseMemory:
    """The record of a base that moves.

    Attributes:
        memory: The record, (1,).
        base: Its fields, by attribute.
    """

    def __init__(self) -> None:
        self.memory = np.zeros(1, dtype("base"))
        self.base: Any = rooms(self.memory)

    def arguments(self) -> tuple[Any, ...]:
        """What the entry points take for it."""
        return (self.memory,)


class JointsMemory:
    """The record of a motion of the joints.

    Attributes:
        memory: The record, (1,).
        joints: Its fields, by attribute.
    """

    def __init__(self) -> None:
        self.memory = np.zeros(1, dtype("joints"))
        self.joints: Any = rooms(self.memory)

    def arguments(self) -> tuple[Any, ...]:
        """What the entry points take for it."""
        return (self.memory,)


class PlanMemory:
    """The record of a plan that leads the null space.

    Args:
        q: Joint values, (rows, n) [rad or m], at equal distances of time.
        tips: Position and rotation of the tip in each row, (rows, 12).
        spacing: Time between two rows, > 0 [s].
        length: What weighs a rotation beside a way [m]; 0 leaves rotations out.

    Attributes:
        memory: The record, (1,).
        spacing: Time between two rows [s].
    """

    def __init__(self, q: FloatArray, tips: FloatArray, spacing: float, length: float) -> None:
        self.memory = np.zeros(1, dtype("plan"))
        self._P: Any = rooms(self.memory)
        self._kept = q, tips
        self._P.q_at, self._P.tip_at, self._P.rows = q.ctypes.data, tips.ctypes.data, len(q)
        self._P.spacing, self._P.length = spacing, length
        self.spacing = spacing

    @property
    def at(self) -> float:
        """Where the tip is, counted in rows."""
        return float(self._P.at)

    def begin(self, row: int) -> None:
        """Take a row for the place of the tip, at rest."""
        self._P.at, self._P.pace, self._P.begun = row, 0.0, 0

    def bind(self, session: Session) -> Call:
        """What sets the posture of the session's next tick."""
        return session.bind("follow_plan", self.memory)


class ServoMemory:
    """The memory of the servos of an arm.

    Attributes:
        memory: The record, (1,).
        S: Its fields, by attribute.
    """

    def __init__(self, joints: int) -> None:
        self.memory = np.zeros(1, dtype("servo"))
        self.S: Any = rooms(self.memory)
