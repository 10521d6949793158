"""Others beside the caller: threads that call while it is inside, and objects of its own that do so."""

import sys
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

import ftqp
from ftqp.core.errors import FtqpError, InputError
from fuzz.inside.interruptions import at_line
from fuzz.inside.world import Disturbed, Stopped, Told, World
from fuzz.world import last_line

PATIENCE = 30.0
"""A thread that takes longer hangs [s]."""
SWITCH = 1e-6
"""How often threads take turns [s]."""


class Other:
    """A call of another thread."""

    def __init__(self, call: Callable[[], Any]) -> None:
        self._call = call
        self.refused, self.done, self.wrong = False, False, ""
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Begin it."""
        self._thread.start()

    def join(self) -> None:
        """Wait for its end."""
        self._thread.join(PATIENCE)
        if self._thread.is_alive():
            self.wrong = "a call of another thread hangs"

    def _run(self) -> None:
        try:
            self._call()
            self.done = True
        except InputError as error:
            self.refused = "belongs to one thread" in str(error)
            self.wrong = "" if self.refused else last_line(error)
        except BaseException as error:  # in a thread nobody would see it
            self.wrong = last_line(error)

    def now(self) -> None:
        """From begin to end."""
        self.start()
        self.join()


def _else(world: World, joints: set[int]) -> Told:
    """Something to be told of another joint."""
    robot, planner = world.made.robot, world.planner
    free = [
        i
        for i in range(robot.chain.floating, robot.nv)
        if i not in joints and robot.joints[i] not in world.told
    ]
    if not free or len(world.told) >= 3:
        names = [name for name in world.told if robot.joint(name) not in joints]
        name = names[0] if names else robot.joints[free[0] if free else 0]
        return Told("withdraw", lambda: planner.withdraw(name), {}, joints=frozenset({name}))
    fault = world.drawn_fault(free[int(world.rng.integers(len(free)))])
    return Told("report", lambda: planner.report(fault), {robot.joints[robot.joint(fault.joint)]: fault})


def _happened(world: World, other: Told) -> None:
    """What another thread has told is believed, too."""
    if other.name == "report":
        world.told = {**world.told, **other.told}
    else:
        world.told = dict(world.planner.faults)


def thread_inside(world: World) -> Any:
    """While the caller is at some line of a step, another thread tells the planner something, or steps."""
    told = _else(world, set())
    steps = world.rng.random() < 0.4
    other = Other(world.make if steps else told.call)
    mine = world.make
    try:
        step, _ = at_line(world, "step", mine, other.now)
    except InputError as error:
        if "belongs to one thread" not in str(error):
            raise
        step = None
    _ended(world, other, None if steps else told)
    return (
        world.make() if step is None or other.done else step
    )  # what came behind the tick counts from the next


def thread_beside_a_call(world: World, mine: Told) -> None:
    """While the caller is at some line of telling something, another thread calls."""
    theirs = _else(world, {world.made.robot.joint(name) for name in mine.joints})
    steps = world.rng.random() < 0.4
    other = Other(world.make if steps else theirs.call)
    at_line(world, mine.name, mine.call, other.now)
    mine.happened(world)
    _ended(world, other, None if steps else theirs)


def _ended(world: World, other: Other, told: Told | None) -> None:
    if other.wrong:
        world.watch.say_disagreement(f"another thread: {other.wrong}")
    if other.refused:
        world.done["refused to another thread"] = world.done.get("refused to another thread", 0) + 1
    if other.done and told is not None:
        _happened(world, told)
        if told.name == "withdraw":  # while it had failed a tick may have been made that nobody sees
            for name in told.joints:
                world.watch.failed_unseen(world.made.robot.joint(name))


def threads_at_once(world: World) -> Any:
    """Two threads step and tell as fast as they can; each call is made as a whole or refused."""
    robot, planner, rng = world.made.robot, world.planner, world.rng
    q, joint = world.arm[0].copy(), robot.joints[int(rng.integers(robot.chain.floating, robot.nv))]
    target, trouble, last = world.target, [], [world.told.get(joint)]
    wrong = Other(lambda: None)

    def allowed(call: Callable[[], Any]) -> bool:
        try:
            call()
        except InputError as error:
            if "belongs to one thread" not in str(error):
                trouble.append(last_line(error))
            return False
        return True

    def theirs() -> None:
        for k in range(6):
            fault = ftqp.Locked(joint) if k % 2 == 0 else ftqp.Degraded(joint, velocity=0.5)
            if allowed(lambda fault=fault: planner.report(fault)):
                last[0] = fault
            allowed(lambda: planner.step(q, None, target))

    wrong = Other(theirs)
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH)
    try:
        wrong.start()
        for _ in range(30):
            allowed(world.make)
        wrong.join()
    finally:
        sys.setswitchinterval(before)
    for sentence in [*trouble, *filter(None, [wrong.wrong])]:
        world.watch.say_disagreement(f"two threads: {sentence}")
    world.watch.failed_unseen(robot.joint(joint))
    left = {name: fault for name, fault in world.told.items() if name != joint}
    world.told = left if last[0] is None else {**left, joint: last[0]}
    return world.make()


class Raises:
    """An object of the caller that raises whenever it is looked at."""

    def __init__(self, kind: type[BaseException]) -> None:
        self._kind = kind

    def _raise(self, *given: Any, **named: Any) -> Any:
        raise self._kind("of the caller")

    __array__ = __len__ = __getitem__ = __iter__ = __float__ = __index__ = __bool__ = _raise
    __array_interface__ = homogeneous = packed = row = property(_raise)


class Answers:
    """An object of the caller that is an array after it has done something else."""

    def __init__(self, value: Any, act: Callable[[], Any]) -> None:
        self._value, self._act = value, act

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        """The array."""
        self._act()
        return np.array(self._value, dtype=dtype)


class Fake:
    """A target that is none: what it has is not what it says."""

    def __init__(self, packed: Any, row: Any) -> None:
        self.packed, self.row = packed, row


KINDS = (Disturbed, Stopped, ValueError, TypeError, AttributeError, MemoryError, OverflowError, SystemExit)
ROWS = (1, -1, 2**62, -(2**63), 2**70, 0.5, None, "0", 10**6)


def _filled(count: int, value: Any) -> Any:
    array = np.empty(count, dtype=object)
    for i in range(count):
        array[i] = value
    return array


def objects(world: World) -> Any:
    """A step with objects of the caller that raise, or that are not what they seem; then one without."""
    rng, planner = world.rng, world.planner
    q, target, way = world.arm[0], world.target, int(rng.integers(6))
    kind = KINDS[int(rng.integers(len(KINDS)))]
    packed = (np.zeros(5), np.zeros(29, dtype=np.float32), np.zeros((2, 29))[:, ::2], np.zeros(0), [0.0] * 29,
              target.packed, None)  # fmt: skip
    given: tuple[Any, ...] = (
        (Raises(kind), None, target),
        (q, Raises(kind), target),
        (q, None, Raises(kind)),
        (q, None, Fake(packed[int(rng.integers(len(packed)))], ROWS[int(rng.integers(len(ROWS)))])),
        (Raises(kind), Raises(kind), Raises(kind)),
        (q, _filled(len(q), Raises(kind)), target),
    )[way]
    try:
        return planner.step(*given)
    except (FtqpError, *KINDS):
        return world.make()


def objects_that_call(world: World) -> Any:
    """A step during which an object of the caller tells the planner something."""
    told = _else(world, set())
    count = [0]

    def act() -> None:
        told.call()
        count[0] += 1

    step = world.planner.step(Answers(world.arm[0], act), None, world.target)
    if count[0]:
        _happened(world, told)
    return step
