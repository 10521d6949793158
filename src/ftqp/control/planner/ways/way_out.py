"""Ways out of where an arm is stuck, each tried in thought: back, home, or to where it can stand."""

from dataclasses import dataclass, replace
from typing import Any, Final, final

import numpy as np

from ftqp.control.planner.constraint_list import Constraints
from ftqp.control.planner.leading_plan import Remaining
from ftqp.control.planner.stages import CLOCK, FREE, LED, Stage
from ftqp.core.checks import FloatArray, IntArray, frozen, positive
from ftqp.core.errors import InputError
from ftqp.core.quiet import quiet
from ftqp.faults.belief import fault_record
from ftqp.faults.kinds import FreeSwinging, Locked
from ftqp.kernel.entry.planner_commands import PlannerCommands, ReserveSamples
from ftqp.kernel.entry.session import Memory, Session, copies
from ftqp.kernel.layout.enums import OK, STOPPED_AS_ASKED
from ftqp.kernel.layout.thresholds import STRONG
from ftqp.kernel.layout.ways_room import ROOMS, WayKind

HANGS: Final = 0.02
"""A joint that swings freely and is slower than this rests [rad/s or m/s]: its brake can be closed."""
WORDS: Final = {
    "pose": "position and orientation",
    "position_axis": "position and the direction of the tool",
    "position": "position",
    "": "nothing",
}
"""Rows of a task in words."""
KINDS: Final = {
    WayKind.BACK: "back", WayKind.TIPS: "back by the tip", WayKind.HOME: "home", WayKind.HALT: "halt",
    WayKind.STOP: "stop",
}  # fmt: skip
STILL: Final = {6: "pose", 5: "position_axis", 3: "position", 0: ""}
"""Rows in which the end effector can move, by how many the kernel says they are."""
SLICE: Final = 5_000
"""So many looks are thought on before an interrupt is looked for: some 10 ms. A convention."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WayOut:
    """One way out, as it was tried.

    Attributes:
        kind: ``back`` (along the way that the joints have come), ``back by the tip``, ``home``, ``halt`` (to
            a posture near by where the arm can stand for long) or ``stop``.
        rows: For ``back by the tip`` the rows of the pose that are kept on the way; else empty.
        places: The postures to go to one after the other, (k, nv) [rad or m]; ``ftqp.GoTo(planner,
            way=...)`` goes there.
        time: About how long it takes [s].
        arrives: Whether the arm comes to rest at the end, without a stop.
        clear: Whether it arrives, motors can hold it everywhere on the way, and it meets nothing.
        clearance: The least distance on the way from what it must not meet [m]; inf where nothing is known.
        effort: The largest share of a torque limit that holds the arm at rest, at the end.
        limit: From the joint that is nearest to an end of its range, at the end of the way [rad or m].
        still: What the end effector can do from there in all directions with the joints that work: ``pose``,
            ``position_axis``, ``position``, or nothing.
        near: Whether it comes too near to something.
        force: The largest force that the base bears on the way [N]; 0 of a model without masses.
        moment: The largest torque, about its origin [N m].
        brakes: Joints that swing freely, whose brakes are closed first: they are locked where they hang.
        failed: Joints that had failed when it was tried; one that fails later is missed where it stands off.
        sentence: The same in words.
    """

    kind: str
    rows: str
    places: FloatArray
    time: float
    arrives: bool
    clear: bool
    clearance: float
    effort: float
    limit: float
    still: str
    near: bool
    force: float
    moment: float
    brakes: tuple[str, ...]
    failed: tuple[str, ...]
    sentence: str

    def __repr__(self) -> str:
        return f"WayOut({self.kind}: {self.sentence})"

    def close_brakes(self, planner: Any) -> None:
        """Ask for the brakes that are closed first, of joints that are believed to swing freely.

        Args:
            planner: The planner that will be led.
        """
        for joint in self.brakes:
            if isinstance(planner.faults.get(joint), FreeSwinging):
                planner.brake(joint)

    @property
    def remaining(self) -> Remaining:
        """The same as an option of ``planner.options()``."""
        kind = {"stop": "stop", "halt": "halt"}.get(self.kind, "retreat")
        return Remaining(kind=kind, rows=self.rows, until=0.0, q=self.places, sentence=self.sentence)


def ways_out(
    planner: Any, commands: PlannerCommands, reserve: ReserveSamples | None, came: "Remembered | None",
    home: Any,
) -> tuple[WayOut, ...]:  # fmt: skip
    """Ways out, those that are clear first, in the order: back, back by the tip, home, halt, stop."""
    robot = planner.robot
    robot.refuse_floating("ways out need")
    if not planner.view().is_reset:
        raise InputError("it is not known where the arm is; call planner.reset(q) before ways_out()")
    belongs = robot.neutral if planner.posture is None else planner.posture
    belongs = belongs if home is None else robot.angles(home)
    trial = Trial(planner, commands, reserve, came, np.ascontiguousarray(belongs))
    found: list[WayOut] = []
    with quiet():
        for kind in WayKind:
            for fewer in range(int(planner.known.K.task.sets) + 1 if kind is WayKind.TIPS else 1):
                way = trial.tried(kind, fewer)
                found += [] if way is None else [way]
                if way is not None and way.clear:
                    break
    return tuple(sorted(found, key=lambda way: not way.clear))


@final
class Trial:
    """Tries ways out, each on a copy of what a planner knows: the same ticks as the arm would make."""

    def __init__(
        self, planner: Any, commands: PlannerCommands, reserve: ReserveSamples | None,
        came: "Remembered | None", home: FloatArray,
    ) -> None:  # fmt: skip
        robot, v = planner.robot, planner.view().command.v
        self._planner, self._commands, self._reserve, self._home = planner, commands, reserve, home
        self._came = (np.zeros((1, robot.nv)), 0) if came is None else (came.rows, int(came.facts[2]))
        free = [name for name, fault in planner.faults.items() if isinstance(fault, FreeSwinging)]
        rests = all(abs(v[robot.joint(name)]) < HANGS for name in free)
        self._hang = tuple(free) if rests and planner.drive.brakes == "each" else ()

    def _copy(self) -> tuple[Session, PlannerCommands]:
        """What the planner knows, where joints that hang at rest are locked."""
        session, robot = self._planner.known.copy(), self._planner.robot
        commands = self._commands.on(session)
        for name in self._hang:
            commands.believe(fault_record(robot.joint(name), Locked(name, mode="instant")), goes_on=False)
        if self._hang:
            commands.believed()
            commands.count_on(self._reserve)
        return session, commands

    def tried(self, kind: WayKind, fewer: int) -> WayOut | None:
        """A way of a kind, with so many sets of rows given up, and what is to be said of it; None: no way."""
        planner, robot, n = self._planner, self._planner.robot, self._planner.robot.nv
        session, commands = self._copy()
        going, joints, search, found = (Memory(name) for name in ("going", "joints", "ways", "way_out"))
        O: Any = found.fields
        table = copies([(search.memory[room], session.memory[room]) for room in ROOMS])
        led = (going.memory, joints.memory, search.memory, table, len(table), found.memory)
        came, count = self._came
        begin = session.bind("begin_way_out", commands.memory, *led, came, len(came), count, self._home)
        if not begin(int(kind), fewer):
            return None
        given = [one.given for one in planner.constraints.values()]
        own = Constraints(session, robot, given, lambda _: commands.stop(STOPPED_AS_ASKED))
        fill = own.stage.before
        go_on = session.bind("try_way_out", commands.memory, commands.arm, *led)
        while fill is None or fill() is None:  # functions of the user's are asked before every tick
            if go_on(SLICE if fill is None else 1):
                break
        if not O.places:
            return None
        kept = "position_axis" if O.has_axis else "pose" if O.rows >> 3 else "position" if O.rows else ""
        way = WayOut(
            kind=KINDS[kind], rows=kept, places=frozen(np.array(O.place[: O.places, :n])),
            time=float(O.time), arrives=bool(O.arrives), clear=bool(O.clear), clearance=float(O.clearance),
            effort=float(O.effort), limit=float(O.limit), still=STILL[int(O.still)], near=bool(O.near),
            force=float(O.force), moment=float(O.moment), brakes=self._hang, failed=tuple(planner.faults),
            sentence="",
        )  # fmt: skip
        return replace(way, sentence=_sentence(way))


def _sentence(way: WayOut) -> str:
    """A way in words."""
    what = {
        "back": "go back the way that the joints have come",
        "back by the tip": f"go back along the end effector's way with {WORDS[way.rows]}",
        "home": "go home with the joints that work",
        "halt": "go to a posture near by where the arm can stand for long",
        "stop": "stop and stand here",
    }[way.kind]
    if way.brakes:
        what = f"close the brake of {', '.join(way.brakes)}, then {what}"
    if not way.arrives:
        return f"{what}: it does not arrive"
    text = f"{what}, {way.time:.2g} s; motors then need {100.0 * way.effort:.0f} % of their limits, and "
    text += f"the end effector can still move in {WORDS[way.still]}"
    if way.moment > 0.0:
        text += f"; the base bears up to {way.force:.3g} N and {way.moment:.3g} N m"
    if way.clear:
        return text
    why = "it comes too near to something" if way.near else f"a motor needs more than {100.0 * STRONG:.0f} %"
    return f"{text}; it is not clear, as {why} on the way"


ROWS: Final = 1024
"""Places that are kept, of however long a time."""


@final
class Remembered:
    """Keeps where the joints were commanded to be, now and then, in memory of its own.

    Attributes:
        rows: The last places, (ROWS, nv) [rad or m], number k in row k % ROWS.
        facts: After how many ticks one is kept, ticks, and places that were kept, (3,).
    """

    def __init__(self, session: Session, joints: int, seconds: float, dt: float) -> None:
        self.rows: FloatArray = np.zeros((ROWS, joints))
        self.facts: IntArray = np.zeros(3, dtype=np.int64)
        self.facts[0] = ticks_apart(seconds, dt)
        self._remember = session.bind("remember", self.rows, ROWS, self.facts)

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(
            ticks=(CLOCK, FREE, *LED),
            after=lambda code, _: self._remember(code),
            begin=lambda *_: self.begin(),
        )

    def begin(self) -> None:
        """Forget the way, and keep where the arm is now."""
        self.facts[1:] = 0
        self._remember(OK)


def ticks_apart(seconds: float, dt: float) -> int:
    """After how many ticks a place is kept, so that ``ROWS`` of them are of so many seconds."""
    return max(1, round(positive("remember", seconds, "s") / (ROWS * dt)))
