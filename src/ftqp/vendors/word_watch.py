"""Applies what status words say to a planner: what counts, what stands, and what ends it."""

import logging
from collections import deque
from collections.abc import Mapping, Sequence
from math import ceil, isfinite, pi
from typing import Any, Final, final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.core.checks import instance, positive, sized
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Degraded, Fault, FreeSwinging, Locked
from ftqp.vendors.status_words import Table
from ftqp.vendors.status_words import table as named
from ftqp.vendors.verdict import ARM, GOES_ON, OFF, PAUSED, PERSON, PROGRAM, RecoveryStep, Verdict

LOG = logging.getLogger("ftqp")
ANSWERS: Final = 2
"""So many answers in succession have to say the same before it counts."""
AT_REST: Final = 0.2
"""A joint without power that has stood for so long is taken to stay [s]."""
ONE_STEP: Final = 2.0 * pi / 4096
"""Step of the encoders of servos [rad]: what moves by no more stands."""
SILENT: Final = 5.0
"""A stream that has said nothing for so many of its periods is old."""
REBOOTS: Final = 3
"""A servo is rebooted so often at most ..."""
REBOOTS_IN: Final = 300.0
"""... in so many seconds."""
REBOOT: Final = "reboot"
AGAIN: Final = (RecoveryStep(PERSON, "look at what holds the arm"), RecoveryStep(PROGRAM, "begin_again"))


@final
class Recovery:
    """The steps back to work of a verdict, one after the other; a program cannot pass over a person's.

    Attributes:
        verdict: What is recovered from.
        next: The step that is due; None when all are done.
    """

    __slots__ = ("_left", "verdict")

    def __init__(self, verdict: Verdict, steps: Sequence[RecoveryStep] | None = None) -> None:
        self.verdict = verdict
        self._left = deque(verdict.recovery if steps is None else steps)

    @property
    def next(self) -> RecoveryStep | None:
        """The step that is due; None when all are done."""
        return self._left[0] if self._left else None

    def done(self, by: str) -> None:
        """The step that is due has been taken.

        Args:
            by: Who took it: ``person`` or ``program``.

        Raises:
            InputError: None is left, or it is somebody else's.
        """
        if not self._left:
            raise InputError("no step is left; see recovery.next")
        if by != self._left[0].by:
            raise InputError(f"{self._left[0].do!r} is a step of a {self._left[0].by}, not of a {by:.40}")
        self._left.popleft()


@final
class Watch:
    """Looks at the status words of an arm once a period, and reports to a planner what they mean.

    A fault counts when two successive answers show it. It is withdrawn by ``withdraw`` or ``begin_again``
    only, never because its bit has gone. Nothing here acknowledges anything at a controller.

        watch = ftqp.vendors.Watch(planner, "feetech")
        step = planner.step(watch.look({"status": status}, q), None, target)

    A joint that is off is ``Locked`` where it has a brake. Without one it is ``FreeSwinging`` until it has
    stood for 0.2 s, and ``Locked`` while it stands; where the planner cannot lead with a free joint,
    ``Locked`` at every new place.

    Args:
        planner: The planner that gets the reports.
        table: The name of a table, or a table: ``ftqp.vendors.names()``.
        joints: Names of the joints in the order of the words; None is that of the robot.
        brakes: Joints that have a brake that closes without power, or have none; others as the table says.
        period: Of the stream [s]; None is the planner's ``dt``.

    Attributes:
        news: Verdicts that have begun to count at the last ``look``.
        arm: What the whole arm does: ``goes_on``, ``paused`` or ``off``.

    Raises:
        InputError: No planner, an unknown table or joint, what is no brake, a joint that is named twice, or
            a number of joints that the table does not have.
    """

    __slots__ = (
        "_arms", "_brakes", "_counts", "_heard", "_joints", "_key", "_loose", "_lost", "_needed", "_planner",
        "_q", "_quiet", "_reboots", "_silent", "_standing", "_table", "_tick", "_words", "news",
    )  # fmt: skip

    def __init__(
        self, planner: Planner, table: str | Table, joints: Sequence[str] | None = None,
        brakes: Mapping[str, bool] | None = None, period: float | None = None,
    ) -> None:  # fmt: skip
        instance("planner", planner, Planner, "an ftqp.Planner, ftqp.Planner(robot)")
        instance("table", table, str | Table, "one of ftqp.vendors.names(), or a table")
        self._planner, self._table = planner, table if isinstance(table, Table) else named(table)
        robot = planner.robot
        instance("joints", joints, list | tuple | None, 'their names in the order of the words, ["j1", "j2"]')
        named_joints = robot.joints if joints is None else joints
        self._joints = tuple(robot.joints[robot.joint(one)] for one in named_joints)
        instance("brakes", brakes, Mapping | None, "a mapping, {joint: True}")
        for brake in (brakes or {}).values():
            instance("a brake", brake, bool, "True or False, {joint: True}")
        for name in self._joints:
            if self._joints.count(name) > 1:
                raise InputError(f"{name} is named twice in joints, expected each joint once")
        if self._table.joints not in (None, len(self._joints)):
            raise InputError(
                f"{len(self._joints)} joints are watched, expected {self._table.joints}, as "
                f"{self._table.title} has; name them by joints="
            )
        self._brakes = {robot.joints[robot.joint(one)]: brake for one, brake in (brakes or {}).items()}
        every = planner.dt if period is None else positive("period", period, "s")
        self._silent = ceil(SILENT * every / planner.dt - 1e-9)
        self._needed: dict[tuple[str, int | None], int] = {
            (name, i): max(ANSWERS, ceil(row.after / every - 1e-9))
            for name, word in self._table.words.items()
            for i, row in enumerate(word.rows)
        }
        self._words = tuple(self._table.words)
        self._tick = self._heard = 0
        self._key: Any = None
        self._quiet = False
        self._counts: dict[Any, int] = {}
        self._standing: dict[Any, Verdict] = {}
        self._arms = ARM.index(GOES_ON)
        self._lost: list[int] = []
        self._loose: dict[str, list[Any]] = {}
        self._q = np.zeros(robot.nv)
        self._reboots: dict[str, deque[int]] = {}
        self.news: tuple[Verdict, ...] = ()

    @property
    def arm(self) -> str:
        """What the whole arm does: ``goes_on``, ``paused`` or ``off``."""
        return ARM[self._arms]

    @property
    def standing(self) -> tuple[Verdict, ...]:
        """Every verdict on a joint or the arm that counts and has not been withdrawn."""
        return tuple(self._standing.values())

    def look(self, words: Mapping[str, Any] | None, q: Any) -> Any:
        """Look at the words of this period; returns the samples to hand to the planner.

        Args:
            words: The words by name, those of one answer; None where none has come since the last look.
            q: The measured configuration, (nv,) [rad or m].

        Returns:
            ``q`` itself, or a copy in which joints whose sensor is lost are NaN, valid until the next look.

        Raises:
            InputError: Unknown or missing words, a wrong number of joints, what is no status word, or q of
                another shape where a joint is loose or its sensor lost.
        """
        self._tick += 1
        if self.news:
            self.news = ()
        if words is None:
            if self._tick - self._heard == self._silent:
                self._silence()
        else:
            self._heard = self._tick
            key = self._key_of(words)
            if not self._quiet or key is None or key != self._key:
                self._hear(words)
                self._key = key
        if self._loose or self._lost:
            q = sized("q", q, self._q.shape, "(nv,)")
        if self._loose:
            self._follow_loose(q)
        if not self._lost:
            return q
        np.copyto(self._q, q)
        self._q[self._lost] = np.nan
        return self._q

    def gone(self, why: str = "the connection is lost") -> None:
        """Say that the connection has vanished: the arm counts as off, and this is said once."""
        key = ("gone",)
        if key not in self._standing:
            self._begin(key, Verdict(None, None, OFF, why, AGAIN))

    def withdraw(self, joint: str) -> None:
        """A joint works again: what stands of it is withdrawn, here and in the planner.

        Args:
            joint: Its name.
        """
        name = self._planner.robot.joints[self._planner.robot.joint(joint)]
        self._forget([key for key, one in self._standing.items() if one.joint == name])
        self._planner.withdraw(name)

    def begin(self) -> None:
        """Withdraw what the last answer does not show any more, as ``begin_again`` does; the rest stays."""
        self._forget([key for key in self._standing if key not in self._counts])

    def recover(self, joint: str | None = None) -> Recovery:
        """The steps back to work of a joint, or of the arm.

        A servo is rebooted at most 3 times in 5 minutes; then a person's step comes first.

        Args:
            joint: Its name; None is the arm as a whole.

        Raises:
            InputError: No fault of it is there.
        """
        found = [one for one in self._standing.values() if one.recovery and joint in (one.joint, None)]
        if not found:
            raise InputError(f"no fault of {joint or 'the arm'} is there; watch.standing lists what is")
        worst = max(
            found, key=lambda one: (any(step.by == PERSON for step in one.recovery), ARM.index(one.arm))
        )
        steps = list(worst.recovery)
        if steps[0].do == REBOOT:
            tries = self._reboots.setdefault(str(worst.joint), deque())
            while tries and (self._tick - tries[0]) * self._planner.dt > REBOOTS_IN:
                tries.popleft()
            if len(tries) >= REBOOTS:
                steps.insert(0, RecoveryStep(PERSON, "find out why it was rebooted 3 times in 5 minutes"))
            tries.append(self._tick)
        return Recovery(worst, steps)

    def _key_of(self, words: Mapping[str, Any]) -> Any:
        """The words as they are compared with those of the last look; None if they have to be read."""
        try:
            return len(words), [
                one if one is None or isinstance(one, int | str) else tuple(one)
                for one in map(words.get, self._words)
            ]
        except (TypeError, AttributeError):
            return None

    def _hear(self, words: Mapping[str, Any]) -> None:
        """Read an answer, and begin what has been said often enough."""
        values = self._table.read(words, len(self._joints))
        counts: dict[Any, int] = {}
        self._quiet = True
        for name, value, place, i in self._table.claims(values):
            key = (name, place, i, value if i is None else None)
            needed = self._needed.get((name, i), ANSWERS)
            counts[key] = self._counts.get(key, 0) + 1
            self._quiet &= counts[key] >= needed
            if counts[key] == needed and key not in self._standing:
                self._begin(key, self._table.verdict(name, value, place, i, self._joints, self._brakes))
        self._counts = counts

    def _silence(self) -> None:
        """Nothing has come for long."""
        late = 1e3 * self._silent * self._planner.dt
        self._begin(("silence",), Verdict(None, None, PAUSED, f"no news for {late:.0f} ms", AGAIN))

    def _begin(self, key: Any, verdict: Verdict) -> None:
        """A verdict counts from now on."""
        self.news = (*self.news, verdict)
        LOG.warning("%s", verdict.why)
        if verdict.fault is None and not verdict.sensor_lost and verdict.arm == GOES_ON:
            return
        self._standing[key] = verdict
        worse = ARM.index(verdict.arm)
        if worse > self._arms == 0:
            self._planner.stop()
        self._arms = max(self._arms, worse)
        if verdict.sensor_lost and verdict.joint is not None:
            self._lost = sorted({*self._lost, self._planner.robot.joint(verdict.joint)})
        if verdict.fault is not None:
            self._report(verdict.fault)

    def _report(self, fault: Fault) -> None:
        """Tell the planner; a weak joint never takes the place of one that has failed."""
        joint = str(fault.joint)
        present = self._planner.faults.get(joint)
        if isinstance(fault, FreeSwinging):
            if joint not in self._loose:
                self._loose[joint] = [np.nan, self._tick, False]
                self._let_go(fault)
        elif not (isinstance(fault, Degraded) and isinstance(present, Locked | FreeSwinging)):
            self._planner.report(fault)

    def _let_go(self, fault: FreeSwinging) -> None:
        """Report a joint without power that may move; as locked where the planner cannot lead with it."""
        try:
            self._planner.report(fault)
        except InputError:
            self._planner.report(Locked(fault.joint, mode="instant"))

    def _follow_loose(self, q: Any) -> None:
        """Joints without power: at rest they count as locked, where they move they do not."""
        for joint, state in self._loose.items():
            place, since, stands = state
            now = float(q[self._planner.robot.joint(joint)])
            if not isfinite(now):
                continue
            if not abs(now - place) <= ONE_STEP:
                state[:] = now, self._tick, False
                if stands:
                    self._let_go(FreeSwinging(joint))
            elif not stands and (self._tick - since) * self._planner.dt >= AT_REST - 1e-9:
                state[2] = True
                self._planner.report(Locked(joint, mode="instant"))

    def _forget(self, keys: Sequence[Any]) -> None:
        """Drop verdicts, and withdraw joints of which no other one stands."""
        dropped = [self._standing.pop(key) for key in keys]
        for key in keys:
            self._counts.pop(key, None)
        self._key, self._quiet = None, False
        self._arms = max((ARM.index(one.arm) for one in self._standing.values()), default=0)
        robot = self._planner.robot
        self._lost = sorted(
            {robot.joint(one.joint) for one in self._standing.values() if one.sensor_lost and one.joint}
        )
        kept = {one.joint for one in self._standing.values() if one.fault is not None}
        for joint in dict.fromkeys(one.joint for one in dropped if one.fault is not None):
            if joint is not None and joint not in kept:
                self._loose.pop(joint, None)
                self._planner.withdraw(joint)
