"""Sessions: the one owner of records and their addresses, and how work is shared out among threads.

Whoever drives the kernel from Python holds a session, reads and writes its rooms by attribute
(``session.K.task.kp``) and calls what ``bind`` gives. No address leaves this module but inside such a call.
"""

import os
from _thread import start_new_thread
from collections.abc import Callable, Sequence
from copy import copy
from functools import cached_property, partial
from itertools import pairwise
from queue import Empty, SimpleQueue
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray, seen
from ftqp.kernel.compiled.library import load
from ftqp.kernel.entry.table import ENTRIES
from ftqp.kernel.layout.record import check_joints, in_line, load_chain, memory, record

Call = Callable[..., int]
WORD = 8
"""Bytes of a word, which every number of a record takes. A convention of the layout."""
PORTIONS = 8
"""Portions that work is shared out in, for each thread, so that none waits long for another at the end."""
POLL = 0.1
"""How often an interrupt of the user is looked for [s]. A convention: shorter than a person notices."""


def rooms(memory: Any) -> Any:
    """The first record of a structured array, (1,), its fields as attributes that can be written."""
    return memory.view(np.recarray)[0]


def bound(name: str, *things: Any) -> Call:
    """An entry point with its first arguments given: numbers as they are, arrays by their address, None as 0.

    The arrays live as long as the call does; those whose addresses a record holds are the caller's to keep.
    """
    call = partial(load(ENTRIES[name]), *map(_number, things))
    vars(call)["things"] = things
    return call


def _number(thing: Any) -> int:
    """A whole number as it is, an array as its address, and nothing as 0."""
    if thing is None or isinstance(thing, int):
        return thing or 0
    return int(thing.ctypes.data)


def writer_of(target: FloatArray) -> Call:
    """What writes (pose, twist, acceleration) into a packed target, (29,): 0, or a mistake."""
    return bound("write_target", target)


def copies(changes: Sequence[tuple[Any, Any]]) -> Any:
    """What tells compiled code which arrays are written into which, (k, 3); they are the caller's to keep."""
    rows = [(to.ctypes.data, given.ctypes.data, given.nbytes // WORD) for to, given in changes]
    return np.array(rows, dtype=np.int64).reshape(-1, 3)


def bound_write(changes: Sequence[tuple[Any, Any]]) -> Call:
    """The compiled call that writes arrays into others; the caller keeps them till then."""
    return bound("write_together", table := copies(changes), len(table))


def write_together(changes: Sequence[tuple[Any, Any]]) -> None:
    """Write arrays into others in one compiled call: all of them, or none where an exception comes before."""
    bound_write(changes)()


def thread_count() -> int:
    """``NUMBA_NUM_THREADS`` where it is a whole number from 1, else the number of cores."""
    given = os.environ.get("NUMBA_NUM_THREADS", "")
    return int(given) if given.isdecimal() and int(given) > 0 else os.cpu_count() or 1


def _next_of(queue: SimpleQueue[Any]) -> Any:
    """What comes next; an interrupt of the user is raised meanwhile."""
    while True:
        try:
            return queue.get(timeout=POLL)
        except Empty:
            continue


def share_out(
    work: Callable[[int, int], int | None], count: int, threads: int | None = None, *,
    size: int | None = None, progress: Callable[[int], None] | None = None,
    stop: Callable[[], None] | None = None,
) -> int:  # fmt: skip
    """Do work(first, last) on portions of ``count`` things, on so many threads; None: ``thread_count``.

    A portion has ``size`` things, if it is said. What work says of each is summed up, handed to ``progress``
    and returned; ``stop`` makes portions that have begun end soon. Ctrl-C is raised when they have.
    """
    workers = thread_count() if threads is None else threads
    portions = min(count, PORTIONS * workers) if size is None else -(-count // size)
    if size is None and (workers == 1 or portions <= 1):
        return work(0, count) or 0
    ends = [k * count // portions if size is None else min(k * size, count) for k in range(portions + 1)]
    todo, done, ended = iter([*pairwise(ends)]), SimpleQueue[int | BaseException](), SimpleQueue[None]()

    def do_portions() -> None:
        try:
            for first, last in todo:
                done.put(work(first, last) or 0)
        except BaseException as error:  # raised by who waits
            done.put(error)
        ended.put(None)

    # Ctrl-C may come anywhere here. Pools, futures and threading.Thread would leave locks taken and
    # wait for ever; these calls are of C, and are done or not.
    begun, total = 0, 0
    try:
        for _ in range(min(workers, portions)):
            start_new_thread(do_portions, ())
            begun += 1
        for _ in range(portions):
            said = _next_of(done)
            if isinstance(said, BaseException):
                raise said
            total += said
            if progress is not None:
                progress(total)
    except BaseException:
        for _ in todo:  # nobody begins another one
            pass
        if stop is not None:
            stop()
        raise
    finally:
        for _ in range(begun):
            _next_of(ended)
    return total


class Session:
    """A planner's record, and its rooms by attribute, ``K``."""

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
        return copy(self)

    @property
    def _balls(self) -> tuple[FloatArray, ...]:
        """The balls at which the record looks now."""
        at = int(self.K.scene.cloud_at)
        return tuple(one for one in self._lent if one.ctypes.data == at)

    def lend(self, balls: FloatArray) -> int:
        """The address of balls of a cloud, (K, 4), which live while this record or a copy looks at them."""
        self._lent = (balls, *self._balls)
        return int(balls.ctypes.data)

    @cached_property
    def torques(self) -> Call:
        """What fills in the torques of the last command, where the tick did without them."""
        return self.bind("torques")

    def pair_distances(self, postures: FloatArray) -> FloatArray:
        """The distances of all pairs at some postures, (S, nv), measured on a copy: (S, pairs) [m]."""
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


@final
class Memory:
    """A record beside a planner's: of what leads it, of servos, of a joint that swings freely, and the like.

    ``kind`` is its name in the layout, ``fields`` has its fields by attribute, and a path has a ``table`` of
    its intervals, (rows, 50).
    """

    def __init__(self, kind: str, table: Any = ()) -> None:
        self.kind, self.memory, self.table = kind, memory(kind), np.ascontiguousarray(table, np.float64)
        self.fields: Any = rooms(self.memory)

    def arguments(self) -> tuple[Any, ...]:
        """What the entry points take for what leads."""
        return (self.memory, self.table, len(self.table)) if self.kind == "path" else (self.memory,)

    def call(self, name: str) -> int:
        """Call an entry point on the record."""
        return bound(name, self.memory)()

    def __getstate__(self) -> dict[str, Any]:
        return {"kind": self.kind, "memory": self.memory, "table": self.table}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.kind, self.memory, self.table = state["kind"], in_line(state["memory"]), state["table"]
        self.fields = rooms(self.memory)


class ArmSession:
    """Kinematics and dynamics of one arm, apart from any planner, in the rooms of its own ``K``."""

    def __init__(self, constants: dict[str, Any]) -> None:
        check_joints(len(constants["mass"]))
        self._begin(memory("arm"))
        load_chain(self.K, **constants)
        self.joints = range(len(constants["mass"]))

    def _begin(self, memory: Any) -> None:
        self.memory = memory
        self.K: Any = rooms(memory)
        self._q, self._v = self.K.state.given_q, self.K.state.given_v

    def bind(self, name: str, *things: Any) -> Call:
        """An entry point on this record, further first arguments given; see ``bound``."""
        return bound(name, self.memory, *things)

    def adopt(self, session: Session) -> None:
        """Be the arm of a planner as it is fitted now, with its tool and its load; of the same size."""
        self.memory["chain"] = session.memory["chain"]

    @cached_property
    def _kinematics(self) -> Call:
        return self.bind("kinematics")

    @cached_property
    def _dynamics(self) -> Call:
        return self.bind("inverse_dynamics")

    def kinematics(self, q: FloatArray, v: FloatArray | None = None) -> None:
        """Tip pose, J and drift at (q, v) into the room ``kinematics``; v None is rest."""
        self._kinematics(self._given(q, v))

    def dynamics(self, q: FloatArray, v: FloatArray | None = None) -> None:
        """Everything of ``kinematics``, and M and h."""
        self._dynamics(self._given(q, v))

    def servos(self, servo: Memory) -> Call:
        """What puts the torques of servos at (q, v) under limits into their memory; 1: one is full."""
        return self.bind("servo_torques", servo.memory)

    def _given(self, q: FloatArray, v: FloatArray | None) -> int:
        self._q[: len(q)] = q
        self._v[: len(self.joints)] = 0.0 if v is None else v
        return len(q)

    def __getstate__(self) -> dict[str, Any]:
        return {"memory": self.memory, "joints": self.joints}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._begin(in_line(state["memory"]))
        self.joints = state["joints"]
