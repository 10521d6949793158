"""Ways out of where an arm is stuck, each tried in thought: back, home, or to where it can stand."""

from dataclasses import dataclass, replace
from typing import Any, Final, final

import numpy as np

from ftqp.control.inverse_kinematics.motion_validity import HELD, MotionValidity
from ftqp.control.planner.leading_plan import Remaining
from ftqp.control.planner.planner_view import JointState, PlannerView
from ftqp.control.planner.stages import CLOCK, FREE, LED, Stage
from ftqp.control.planner.ways.trial import Trial, Tried, corners, thinned
from ftqp.control.planner.ways.ways import Ways
from ftqp.control.task.task import Task
from ftqp.core.checks import FloatArray, frozen, positive
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_vector
from ftqp.core.quiet import quiet
from ftqp.faults.kinds import FreeSwinging, Locked
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.thresholds import SINGULAR_FROM
from ftqp.kernel.layout.ways_room import WayStage
from ftqp.model.robot import Robot

OFF_RECORD: Final = 0.03
"""The way back leaves the one that the arm has come by at most this in any joint [rad or m]: a centimetre or
two at the tip."""
APART: Final = 0.01
"""Places of the way that has been come are so far apart [rad or m], by convention ..."""
MANY: Final = 200
"""... or farther, so that there are not many more than these."""
LONGEST: Final = 60
"""Places of a way at most."""
LEAP: Final = 0.3
"""Where the joints follow the tip's way, none goes farther from one place to the next [rad or m]. A guess."""
ROUND = 60_000
"""So many looks are spent on a way home round what is in between at most, 0.15 s or so. A guess."""
TIP_BACK: Final = 0.01
"""The tip is back within this of where its way began [m] ..."""
TURNED_BACK: Final = 0.05
"""... and this [rad]: the defaults of a task's tolerances, so that it counts as being there, exactly then."""
HANGS: Final = 0.02
"""A joint that swings freely and is slower than this rests [rad/s or m/s]: its brake can be closed."""
WORDS: Final = {
    "pose": "position and orientation",
    "position_axis": "position and the direction of the tool",
    "position": "position",
    "": "nothing",
}
"""Rows of a task in words."""
TRIAL_DT: Final = 8e-3
"""Sampling period of planners for trials [s], if that is longer than the planner's own: motions of joints
with limited jerk are the same at both, and a trial takes an eighth of the time."""


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


def ways_out(planner: Any, make: type[Any], came: FloatArray | None, home: Any) -> tuple[WayOut, ...]:
    """Ways out, those that are clear first, in the order: back, back by the tip, home, halt, stop."""
    robot, view = planner.robot, planner.view()
    robot.refuse_floating("ways out need")
    if not view.is_reset:
        raise InputError("it is not known where the arm is; call planner.reset(q) before ways_out()")
    belongs = robot.neutral if planner.posture is None else planner.posture
    belongs = belongs if home is None else robot.angles(home)
    hang = _hanging(planner, view)
    with quiet():
        twin = _twin(planner, make, hang)
        twin.reset(view.command.q, view.command.v)
        found = _found(planner, twin, planner.passable(), came, belongs, hang)
    return tuple(sorted(found, key=lambda way: not way.clear))


def _hanging(planner: Any, view: PlannerView) -> tuple[str, ...]:
    """The joints that swing freely, where all of them rest and have a brake; else none."""
    free = [name for name, fault in planner.faults.items() if isinstance(fault, FreeSwinging)]
    v = view.command.v
    rests = all(abs(v[planner.robot.joint(name)]) < HANGS for name in free)
    return tuple(free) if rests and planner.drive.brakes == "each" else ()


def _twin(planner: Any, make: type[Any], hang: tuple[str, ...]) -> Any:
    """A planner for trials: this one with a slower clock."""
    own = planner.task
    twin = make(
        planner.robot, max(planner.dt, TRIAL_DT), level=planner.level, bounds=planner.bounds, emergency=None,
        task=Task(rows=own.rows, length=own.length, axis=own.axis),
        torque_limits=bool(np.isfinite(planner.view().limits.tau).any()),
        constraints=[one.given for one in planner.constraints.values()],
        scene=planner.scene, clearance=planner.clearance,
    )  # fmt: skip
    for name, fault in planner.faults.items():
        twin.report(Locked(name, mode="instant") if name in hang else fault)
    return twin


def _found(
    planner: Any, twin: Any, passable: MotionValidity, came: FloatArray | None, home: FloatArray,
    hang: tuple[str, ...],
) -> list[WayOut]:  # fmt: skip
    """All ways, in their order."""
    view = planner.view()
    start, limits, working = view.command, view.limits, view.working
    trial = Trial(twin, view, passable)
    found: list[WayOut] = []

    def add(kind: str, places: FloatArray, tried: Tried, rows: str = "") -> None:
        found.append(_way(kind, rows, places, tried, planner, passable, hang))

    swings = not hang and any(isinstance(fault, FreeSwinging) for fault in planner.faults.values())
    only_stops = swings or not working.any()
    if came is not None and len(came) > 1 and not only_stops:
        length = float(np.abs(np.diff(came, axis=0)).max(axis=1).sum())
        came = thinned(came, max(APART, length / MANY))
        back = corners(np.vstack([came, start.q])[::-1], OFF_RECORD)[1 : LONGEST + 1]
        back = np.where(working, np.clip(back, limits.q_min, limits.q_max), start.q)
        add("back", back, trial.joints(list(back)))
        if not working.all():
            for rows in planner.task.kept_sets:
                done = _back_by_tip(twin, trial, start, came, rows)
                if done is not None:
                    add("back by the tip", *done, rows=rows)
                    if found[-1].clear:
                        break
    stand = start.q + start.v * np.abs(start.v) / (2.0 * np.maximum(limits.a, 1e-9))  # where braking ends
    stand = np.where(working, np.clip(stand, limits.q_min, limits.q_max), start.q)
    if not only_stops:  # as far as is known
        place = np.where(working, np.clip(home, limits.q_min, limits.q_max), start.q)
        way = _round(twin, stand, place)
        add("home", way, trial.joints(list(way)))
        rest = trial.halt_posture(stand)
        add("halt", rest[None], trial.joints([rest]))
    add("stop", stand[None], trial.joints([stand]))
    return found


def _round(twin: Any, stand: FloatArray, place: FloatArray) -> FloatArray:
    """The places of a way to a posture, (k, nv), round what is in between; itself where none is found."""
    if not twin.avoids:
        return place[None]
    ways = Ways(twin, stand, goals=[place], most=ROUND)
    while ways.stage in (WayStage.GROWING, WayStage.SHORTENING):
        ways.search_step(ROUND)
    return ways.way[1:] if ways.has_way else place[None]


def _back_by_tip(
    twin: Any, trial: Trial, start: JointState, came: FloatArray, rows: str
) -> tuple[FloatArray, Tried] | None:
    """The places of the way along the tip's, and what they come to; None where that does not lead back."""
    view, joints = twin.view(), np.vstack([came, start.q])[::-1]
    way = np.append(0.0, np.cumsum(np.abs(np.diff(joints, axis=0)).max(axis=1)))
    s = np.linspace(0.0, way[-1], MANY + 1)
    poses = view.poses(np.array([np.interp(s, way, column) for column in joints.T]).T)
    leap = np.full(len(start.q), LEAP)
    ways = Ways(twin, start.q, rows=rows, path=poses, leap=leap, tolerance=(TIP_BACK, TURNED_BACK))
    led, k = [start.q], 0
    while k < MANY:  # places that cannot be come to are passed by
        ways.begin_following(led[-1], k)
        while not ways.follow(1):
            led.append(ways.at)
        k = ways.followed + 1
    if ways.followed < MANY:
        return None
    places = corners(np.array(led), OFF_RECORD / 3.0)[1 : LONGEST + 1]
    tried = trial.joints(list(places))
    return (places, tried) if _is_back(view, tried.q[-1], poses[-1], rows) else None


def _is_back(view: PlannerView, q: FloatArray, begin: FloatArray, rows: str) -> bool:
    """Whether the tip is where its way began, in the rows kept."""
    end = view.poses(q[None])[0]
    lean = float(np.arccos(np.clip(end[:3, 2] @ begin[:3, 2], -1.0, 1.0)))
    turned = float(np.linalg.norm(rotation_vector(end[:3, :3].T @ begin[:3, :3])))
    off = {"position": 0.0, "position_axis": lean, "pose": turned}[rows]
    away = float(np.linalg.norm(end[:3, 3] - begin[:3, 3]))
    return away <= TIP_BACK and off <= TURNED_BACK


def _way(
    kind: str, rows: str, places: FloatArray, tried: Tried, planner: Any, passable: MotionValidity,
    hang: tuple[str, ...],
) -> WayOut:  # fmt: skip
    """A way with what there is to say of it."""
    view, end = planner.view(), tried.q[-1]
    limits, working = view.limits, view.working
    ends = np.minimum(end - limits.q_min, limits.q_max - end)[working]
    way = WayOut(
        kind=kind, rows=rows, places=frozen(places.copy()), time=tried.time, arrives=tried.arrives,
        clear=tried.arrives and tried.passes, clearance=tried.clearance,
        effort=float(passable.effort(end[None])[0]), limit=float(ends.min(initial=np.inf)),
        still=_still(planner.robot, end, np.asarray(working)), near=tried.near,
        force=float(tried.borne[0]), moment=float(tried.borne[1]), brakes=hang,
        failed=tuple(planner.faults), sentence="",
    )  # fmt: skip
    return replace(way, sentence=_sentence(way))


def _still(robot: Robot, q: FloatArray, working: FloatArray) -> str:
    """The rows in which the tip can move in all directions."""
    J = robot.jacobian(q)[:, working].copy()
    R = robot.pose(q)[:3, :3]
    J[3:] = robot.length * (R.T @ J[3:])
    for name, count in (("pose", 6), ("position_axis", 5), ("position", 3)):
        if J.shape[1] >= count:
            sigma = np.linalg.svd(J[:count], compute_uv=False)
            if sigma[-1] > SINGULAR_FROM * robot.length:
                return name
    return ""


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
    why = "it comes too near to something" if way.near else f"a motor needs more than {100.0 * HELD:.0f} %"
    return f"{text}; it is not clear, as {why} on the way"


ROWS: Final = 1024
"""Places that are kept, of however long a time."""
STOOD: Final = 1e-3
"""A place nearer than this to the last one in every joint is not kept [rad or m]: the arm stands. A
convention."""


@final
class Remembered:
    """Keeps where the joints were commanded to be, now and then, in memory of its own."""

    def __init__(self, session: Session, joints: int, seconds: float, dt: float) -> None:
        self._q = session.field("state", "q_command")[:joints]
        self._rows = np.zeros((ROWS, joints))
        self._stride = max(1, round(positive("remember", seconds, "s") / (ROWS * dt)))
        self._count = self._ticks = 0

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(ticks=(CLOCK, FREE, *LED), after=self.see, begin=lambda *_: self.begin())

    def begin(self) -> None:
        """Forget the way, and keep where the arm is now."""
        self._count = self._ticks = 0
        self._keep()

    def see(self, code: int, _inputs: tuple[Any, ...] = ()) -> None:
        """Keep the place of a tick when it is time."""
        self._ticks += 1
        if code >= 0 and self._ticks % self._stride == 0:
            last = self._rows[(self._count - 1) % ROWS]
            if np.abs(self._q - last).max() > STOOD:
                self._keep()

    def _keep(self) -> None:
        self._rows[self._count % ROWS] = self._q
        self._count += 1

    @property
    def q(self) -> FloatArray:
        """The places in the order of time, (k, nv) [rad or m]; a copy."""
        first = max(0, self._count - ROWS)
        return self._rows[np.arange(first, self._count) % ROWS].copy()
