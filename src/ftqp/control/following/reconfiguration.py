"""Other postures from which a blocked path goes on: looked for, a little in every tick, and gone to."""

from collections.abc import Generator, Iterator
from typing import Any, Final, NamedTuple, final

import numpy as np

from ftqp.control.inverse_kinematics.posture_search import SAME, may_have
from ftqp.control.paths.path import Path
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import PlannerView
from ftqp.control.planner.step import Step
from ftqp.control.planner.ways.joint_tracker import JointTracker
from ftqp.control.planner.ways.ways import Ways, looks_per_tick, refusal
from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.enums import HELD, STOPPED, STOPPING
from ftqp.kernel.layout.thresholds import AT_REST, RISE_TIME
from ftqp.kernel.layout.ways_room import WayStage

SAMPLES: Final = 200
"""Places of the rest of a path at which it is asked whether a posture goes on along it."""
LITTLE, FEWER = 0.01, 20
"""With less than the first share of a path left there are so many, so that arms just out of reach of the end
get their verdict soon."""
PATIENT: Final = 20.0
"""The path may take so many times its time, because a follower waits where joints are at their speed
limits."""
FARTHER: Final = 0.02
"""A posture is worth going to where the path goes on for this share of its rest, by convention; where hardly
anything is left, for all of it."""
STARTS, PASSING_STARTS = 256, 8
"""Newton starts for postures of the place, and of each of those behind it that may be passed by. Guesses."""
EXPLORED: Final = 36_000
"""So many looks are spent on postures on the spot, so that the verdict on a path comes within a second; an
eighth of them where hardly anything is left. A guess."""
MOST, SHORTENING = 40_000, 6000
"""So many looks are spent on a way in a tube at most, and on making it shorter. Guesses."""
BEST: Final = 0.9
"""Ways are looked for to postures that are worth this share of the best first. A convention."""
KEPT: Final = 0.8
"""The joints are led within this share of what the tip may leave its path by: the rest is for a motion that
limits bend."""
SHARE: Final = 0.5
"""On the spot joints go at this share of their speed limits at most, ..."""
BRAKE: Final = 4.0
"""... slower near a place: by this [1/s] times what is left, ..."""
NEAR: Final = 0.02
"""... and at this distance the next place, or the path, follows [rad or m]."""
WAITS: Final = 1.0
"""A motion that has come no nearer for so long is given up [s]."""
ARRIVED: Final = 1e-4
"""A command so near to its place has arrived [rad or m], by convention: the path's feedback does the rest."""


class Rest(NamedTuple):
    """The rest of a path: its poses, (k, 4, 4), how far joints go between two, (nv,), and the time [s]."""

    poses: FloatArray
    leap: FloatArray
    gap: float
    worth: float


def rest_of(path: Path, progress: float, v_max: FloatArray) -> Rest:
    """The rest of a path as it is followed in thought."""
    is_little = path.duration - progress <= LITTLE * path.duration
    times = np.linspace(progress, path.duration, (FEWER if is_little else SAMPLES) + 1)
    gap = float(times[1] - times[0])
    leap = PATIENT * gap * np.minimum(v_max, 1.0 / AT_REST)
    return Rest(path.sample(times).pose, leap, gap, 0.999 if is_little else FARTHER)


def fewer_rows_hold(
    planner: Planner, path: Path, progress: float, given_up: int
) -> Generator[None, None, int]:
    """How many further sets of rows are to be given up so that a path goes on; 0 where that does not help.

    It yields after each piece of thinking. The rest of the path is followed in thought in the rows of each
    set, within limits and clear of the scene.

    Source: docs/theory/ways-out.md, "Fewer rows".
    """
    if refusal(planner, "position"):
        return 0
    view, looks = planner.view(), looks_per_tick(planner.dt)
    rest = rest_of(path, progress, view.limits.v)
    for count, rows in enumerate(planner.task.kept_sets[given_up + 1 :], 1):
        if not may_have(planner.robot, rows):
            continue
        ways = Ways(planner, rows=rows, path=rest.poses, leap=rest.leap)
        ways.begin_following(view.command.q, 0)
        while not ways.follow(looks):
            yield
        if ways.followed > FARTHER * (len(rest.poses) - 1):
            return count
        yield
    return 0


class _Posture(NamedTuple):
    """A posture of a place of the path, and for how many places the path goes on from there."""

    q: FloatArray
    place: int
    gain: int


@final
class Reconfiguration:
    """Thinks of another posture from which a blocked path goes on, and of the way there.

    Postures of the place are found by Newton starts, and from each the rest of the path is followed in
    thought; a way is looked for to those from which it goes on farthest, then to the others. The tip stays
    where it is (``leave`` is 0), within so much of its path, or goes anywhere. Where it may leave the path a
    little, postures of places behind this one are looked for, too: what cannot be followed is passed by.

    Attributes:
        is_over: Whether nothing more will be thought of, and there is no way.
        way: Postures to go to one after the other, (k, nv) [rad or m]; None while there is none.
        until: The path time at which the way comes back to the path [s].
        leads: Whether the joints are led, and not the tip along its path.
        done: Whether the arm is where the path goes on.

    Source: docs/theory/ways-out.md.
    """

    def __init__(self, planner: Planner, path: Path, progress: float, leave: float) -> None:
        self._planner, self._leave, self._path = planner, leave, path
        self._view: PlannerView = planner.view()
        self._progress = self.until = progress
        self._looks = looks_per_tick(planner.dt)
        self.way: FloatArray | None = None
        self.leads = self.done = self._waits = False
        self._joints: JointTracker | None = None
        self._at, self._least, self._waited, self._until = 0, np.inf, 0.0, 0
        self._begin()

    def _begin(self) -> None:
        """Think anew, of the arm as it is believed now."""
        self._belief = self._view.belief
        self.way, self.until, self.is_over = None, self._progress, False
        self.starts, self._found, self._worthy, self._said = 0, 0, 0, ""
        self._rest = rest_of(self._path, self._progress, self._view.limits.v)
        self._pieces: Iterator[None] = self._search_steps()

    @property
    def is_of_now(self) -> bool:
        """Whether nothing is believed otherwise since it began."""
        return self._belief == self._view.belief

    @property
    def sentence(self) -> str:
        """What is being done, or was looked for."""
        if self._leave == 0.0:
            return self._looked_for
        within = f", the end effector within {1e3 * self._leave:.3g} mm of its path" * bool(
            np.isfinite(self._leave)
        )
        if self.leads and not self._waits:
            return f"the joints go to another posture, from which the path goes on{within}"
        if self.is_over:
            return f"no bridge was found{within}: {self._looked_for}"
        return f"a posture from which the path goes on is looked for{within}"

    @property
    def _looked_for(self) -> str:
        """What was looked for, and found."""
        if self._said:
            return self._said
        many = f"{self._found} posture{'s' * (self._found != 1)}"
        if self._leave == 0.0:
            return f"{many} that can be reached on the spot were looked at, and the path goes on from none"
        where = "" if np.isinf(self._leave) else " near the path"
        many = f"{many} found in {self.starts} starts"
        if not self._worthy:
            return f"{many}, and the path goes on from none"
        return f"{many}, from {self._worthy} of them the path goes on, and no way{where} leads there"

    def search_step(self) -> None:
        """Think for one tick, unless there is a way or no further one."""
        if self._leave > 0.0 and not self.is_of_now:
            self._begin()
        if not self.is_over and self.way is None:
            self._think_on()

    def _think_on(self) -> None:
        """Think for one tick, and lead the joints where there is a way then."""
        self.is_over = next(self._pieces, False) is False and self.way is None
        if self.way is not None and self._leave > 0.0:
            if self._joints is None:
                pose = self._rest.poses[0]
                self._joints = JointTracker(self._planner, self.way[-1], RISE_TIME, pose, whole=False)
            self._joints.seek(self.way[-1], **self._within)
            self.leads, self._waits = True, False

    def drive(self, dt: float) -> FloatArray | None:
        """Velocities along the way on the spot, (nv,) [rad/s or m/s]; None where it is over."""
        assert self.way is not None
        view = self._view
        working = view.working
        away = np.where(working, self.way[self._at] - view.command.q, 0.0)
        off = float(np.abs(away).max())
        if off <= NEAR:
            self._at, self._least, self._waited = self._at + 1, np.inf, 0.0
            if self._at >= len(self.way):
                return None
            away = np.where(working, self.way[self._at] - view.command.q, 0.0)
            off = float(np.abs(away).max())
        if off < 0.99 * self._least:
            self._least, self._waited = off, 0.0
        else:
            self._waited += dt
        if self._waited > WAITS or not self.is_of_now:
            return None
        top = SHARE * view.limits.v
        ratio = float((np.abs(away) / np.maximum(top, 1e-9))[working].max(initial=0.0))
        wanted: FloatArray = away * min(BRAKE, 1.0 / max(ratio, 1e-9))
        return wanted

    def step(self, q: Any, v: Any, tau: Any, tip: Any) -> Step:
        """A step of the joints along the way; see ``Planner.step``."""
        joints = self._joints
        assert joints is not None
        if not self.is_of_now and self._view.is_reset and not self._waits:
            joints.aim(self._view.command.q)  # another joint has failed: think anew, from here
            self._waits = True
        step = joints.step(q, v, tau, tip)
        if step.code in (STOPPING, STOPPED, HELD):
            return step
        if self._waits:
            self.search_step()
        elif joints.blocked is not None:
            self.leads, self.is_over, self._said = False, True, joints.blocked
        elif not joints.is_on_way:
            working = self._view.working
            off = float(np.abs(joints.way[working]).max(initial=0.0))
            self.done = off <= ARRIVED and self._view.pace <= AT_REST
        return step

    @property
    def _within(self) -> dict[str, Any]:
        """Where the tip stays, as ``Ways`` take it."""
        if np.isinf(self._leave):
            return {}
        if self._leave == 0.0:
            return {"tube": self._view.tip.pose[None]}
        own = self._planner.task.length
        wide = KEPT * self._leave
        turns = wide / (self._planner.robot.length if own is None else own)
        poses = self._path.sample(np.linspace(0.0, self._path.duration, SAMPLES + 1)).pose
        return {"tube": poses, "radius": (wide, turns), "most": MOST, "shortening": SHORTENING}

    def _search_steps(self) -> Iterator[None]:
        """All pieces of thinking."""
        if why := refusal(self._planner, stays=self._leave == 0.0):
            self._said = f"no other way was looked for: {why}"
            return
        rest, count = self._rest, len(self._rest.poses) - 1
        if self._leave == 0.0:
            yield from self._explored()
            return
        ways = Ways(self._planner, goal=rest.poses[0], path=rest.poses, leap=rest.leap)
        self._until = self._looks
        yield
        found = yield from self._postures(ways, 0, STARTS)
        best = BEST * max((one.gain for one in found), default=0)
        if (yield from self._joined([one for one in found if one.gain >= best])):
            return
        if (yield from self._joined([one for one in found if one.gain < best])):
            return
        behind = []
        for place in range(count // 32, count, max(1, count // 32)):
            behind += yield from self._postures(ways, place, PASSING_STARTS)
        yield from self._joined(behind)

    def _left(self, ways: Ways) -> int:
        """Looks that are left in this tick."""
        return max(1, self._until - ways.looks)

    def _pause(self, ways: Ways) -> Iterator[None]:
        """End the tick where its looks are spent."""
        if ways.looks >= self._until:
            yield
            self._until = ways.looks + self._looks

    def _explored(self) -> Iterator[None]:
        """Explore postures on the spot, up to the first from which all of the path can be followed.

        The way leads there, or to the one from which it goes on farthest.
        """
        rest, count = self._rest, len(self._rest.poses) - 1
        ways = Ways(self._planner, path=rest.poses, leap=rest.leap, **self._within)
        self._until = self._looks
        best, most = None, rest.worth * count
        while ways.looks < (EXPLORED if count == SAMPLES else EXPLORED // 8) and most < count:
            node = ways.explore(self._left(ways))
            if node is not None:
                ways.begin_following(ways.place(node), 0)
                while not ways.follow(self._left(ways)):
                    yield from self._pause(ways)
                self._found += 1
                best, most = (node, ways.followed) if ways.followed > most else (best, most)
            yield from self._pause(ways)
        if best is None:
            return
        ways.lead_to(best)
        while ways.stage is WayStage.SHORTENING:
            ways.search_step(self._looks)
            yield
        self.way = ways.way[1:]

    def _postures(self, ways: Ways, place: int, starts: int) -> Generator[None, None, list[_Posture]]:
        """Postures of a place from which the path goes on."""
        rest, before, known = self._rest, self.starts, list[_Posture]()
        ways.aim(rest.poses[place])
        while ways.starts < starts:
            q = ways.find(self._left(ways))
            self.starts = before + ways.starts
            if q is not None and not any(np.abs(one.q - q).max() < SAME for one in known):
                ways.begin_following(q, place)
                while not ways.follow(self._left(ways)):
                    yield from self._pause(ways)
                known.append(_Posture(q, place, ways.followed - place))
            yield from self._pause(ways)
        self._found += len(known)
        worthy = [one for one in known if one.gain > rest.worth * (len(rest.poses) - 1 - place)]
        self._worthy += len(worthy)
        return worthy

    def _joined(self, goals: list[_Posture]) -> Generator[None, None, bool]:
        """Whether there is a way to any of these postures, which is ``way`` then."""
        if not goals:
            return False
        ways = Ways(self._planner, goals=[one.q for one in goals], **self._within)
        while ways.is_searching:
            ways.search_step(self._looks)
            yield
        if not ways.has_way:
            return False
        end = min(goals, key=lambda one: float(np.abs(one.q - ways.way[-1]).max()))
        self.way, self.until = ways.way[1:], self._progress + end.place * self._rest.gap
        return True
