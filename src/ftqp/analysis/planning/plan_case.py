"""What a plan is made for: the task, its start and the knobs, in one record that every method takes."""

from base64 import b64decode, b64encode
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property, partial
from io import BytesIO
from typing import Any, Final, Literal, Protocol, cast, final, get_args

import numpy as np
from numpy.typing import NDArray

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.survival.continuing import task_session
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.core.checks import FloatArray, array, non_negative, positive, whole_number
from ftqp.core.errors import InputError, unknown
from ftqp.model.robot import Robot

Method = Literal["dp", "spline", "gradient", "constant"]
"""How the self-motion is chosen."""
Select = Literal["coverage", "energy"]
"""What of a sweep is taken: what survives most, or the paper's rule: least energy of what passes its test."""
Told = Callable[[int, int, str], None]
"""Called with what is done, of how much, and what is being done."""

UNLIMITED_SPEED = 1.0
"""Speed that a plan gives to a joint without a limit [rad/s or m/s]."""
SWEEP = tuple(round(0.01 * k, 2) for k in range(-100, 101))
"""The paper's speeds of the self-motion [rad/s]."""


def _setting(default: Any, least: float, most: float = np.inf) -> Any:
    return field(default=default, metadata={"least": least, "most": most})


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class PlanSettings:
    """The knobs of all methods.

    Attributes:
        waypoints: Of ``dp``: intervals that the path is parted in. More of them follow the path's turns
            better; the work grows with their square.
        spacing: Of ``dp``: arc length between nodes on a self-motion [rad or m]. Smaller is a finer choice;
            the work grows with 1 / spacing.
        nodes: Of ``dp`` with two or more joints to spare: nodes of a waypoint. More are a finer choice.
        share: Share of the joints' speed that ``dp`` uses, in (0, 1]. More lets the self-motion change faster
            and leaves less room for smoothing.
        energy: Share of coverage that is given up for one rad^2/s less of sum |dq|^2 / dt, >= 0. Larger is
            calmer.
        margin: Share of coverage that is given up for postures in the middle of the joints' ranges rather
            than at their ends, >= 0. Larger stays farther from limits.
        thetas: Of ``constant``: the speeds of the self-motion that are tried [rad/s].
        select: Of ``constant``: ``"coverage"``, or ``"energy"`` for the paper's own rule.
        knots: Of ``spline``: values of the speed between which it is interpolated, from 2. More bend more and
            take longer.
        evaluations: Of ``spline``: trajectories that are tried at most.
        gain: Of ``gradient``: speed of the self-motion per slope of its measure [rad/s per 1/rad]. Larger
            climbs faster.
        fastest: Of ``gradient`` and ``spline``: largest speed of the self-motion [rad/s].
        stride: Failures at every so-many-th sample are looked at when a plan is verified.
    """

    waypoints: int = _setting(60, 1)
    spacing: float = _setting(0.06, 1e-3, 1.0)
    nodes: int = _setting(300, 8)
    share: float = _setting(0.5, 1e-3, 1.0)
    energy: float = _setting(2e-4, 0.0)
    margin: float = _setting(0.0, 0.0)
    thetas: tuple[float, ...] = SWEEP
    select: Select = "coverage"
    knots: int = _setting(6, 2)
    evaluations: int = _setting(250, 1)
    gain: float = _setting(0.3, 0.0)
    fastest: float = _setting(1.0, 1e-3)
    stride: int = _setting(4, 1)

    def __post_init__(self) -> None:
        for name, about in self.__dataclass_fields__.items():
            if not about.metadata:
                continue
            least, most, value = about.metadata["least"], about.metadata["most"], getattr(self, name)
            if about.type is int or isinstance(about.default, int):
                whole_number(name, value, int(least))
                continue
            number = non_negative(name, value) if least == 0.0 else positive(name, value)
            if not least <= number <= most:
                raise InputError(f"{name} is {number:g}, expected a number from {least:g} to {most:g}")
        if self.select not in get_args(Select):
            raise unknown("rule of selection", self.select, "plan", get_args(Select))
        thetas = array("thetas", self.thetas, np.shape(self.thetas)).ravel()
        if not len(thetas):
            raise InputError("thetas is empty, expected at least one speed of the self-motion [rad/s]")
        object.__setattr__(self, "thetas", tuple(float(theta) for theta in thetas))

    def text(self) -> dict[str, Any]:
        """The settings as JSON can hold them."""
        return asdict(self)


def speeds(robot: Robot) -> FloatArray:
    """The speed of each joint that a plan may use, its limit or 1 where it has none, (nv,) [rad/s or m/s]."""
    v_max = robot.limits.v_max
    return np.asarray(np.where(np.isfinite(v_max), v_max, UNLIMITED_SPEED))


Portion = Callable[[Sequence[int]], list[tuple[Any, ...]]]
"""Computes some items of a stage, a text in a row each; it can be pickled, and a text depends on its item."""
ROUNDS: Final = 20
"""Without anybody who shares the work, a stage is computed in about so many parts, to tell of progress."""


class Portions(Protocol):
    """Who computes the parts of a plan; the plan is the same whoever does."""

    @property
    def keeps(self) -> bool:
        """Whether what is done is kept, so that an interrupted plan is given up and not ended in a hurry."""

    @property
    def threads(self) -> int | None:
        """How many threads compute one part; None is one a core."""

    def each(self, stage: str, work: Portion, count: int) -> Iterator[str]:
        """The texts of all items of a stage, in order; items do not depend on each other."""

    def one(self, stage: str, item: int, work: Callable[[], str]) -> str:
        """The text of one item of a stage whose items come one after the other."""


@final
class Here:
    """Computes everything in this process, and keeps nothing."""

    def __init__(self, threads: int | None = None) -> None:
        self.keeps, self.threads = False, threads

    def each(self, stage: str, work: Portion, count: int) -> Iterator[str]:
        """The texts of all items of a stage, in order."""
        size = max(1, count // ROUNDS)
        for first in range(0, count, size):
            for row in work(range(first, min(first + size, count))):
                yield str(row[0])

    def one(self, stage: str, item: int, work: Callable[[], str]) -> str:
        """The text of one item."""
        return work()


def packed(values: Any) -> str:
    """An array as a text, to the last bit."""
    file = BytesIO()
    np.save(file, np.asarray(values), allow_pickle=False)
    return b64encode(file.getvalue()).decode()


def unpacked(text: str) -> NDArray[Any]:
    """The array of a text."""
    return cast("NDArray[Any]", np.load(BytesIO(b64decode(text)), allow_pickle=False))


def _texts(work: Callable[[Sequence[int]], Iterable[Any]], items: Sequence[int]) -> list[tuple[str]]:
    """What work makes of some items, as rows of a study."""
    return [(packed(one),) for one in work(items)]


def silent(done: int, total: int, what: str) -> None:
    """Tell nobody."""


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class PlanCase:
    """What a method plans for."""

    task: TaskPath  # The path on its samples
    weights: FloatArray  # What a lock of each joint counts, (nv,), with the mean 1
    # Where the arm starts, exactly at the first sample, (nv,) [rad or m]; None leaves it free
    start: FloatArray | None = None
    settings: PlanSettings = field(default_factory=PlanSettings)  # The knobs
    seed: int = 0  # Of random starts
    told: Told = silent  # Hears of progress
    portions: Portions = field(default_factory=Here)  # Who computes the parts of the work

    def each(
        self, stage: str, work: Callable[[Sequence[int]], Iterable[Any]], count: int
    ) -> Iterator[NDArray[Any]]:
        """The arrays that work, which can be pickled, makes of all items of a stage, in order."""
        return map(unpacked, self.portions.each(stage, partial(_texts, work), count))

    @cached_property
    def study(self) -> GoalStudy:
        """Studies of the arm and the task rows, with steps of the settings' spacing."""
        return planning_study(self.task, self.settings.spacing)


def planning_study(task: TaskPath, spacing: float) -> GoalStudy:
    """Studies within the arm's limits of a task's rows; the goal is the first sample."""
    session = task_session(task)
    session.S.study.step = spacing
    return GoalStudy(robot=task.robot, rows=task.rows, pose=task.goals[0], free=session, limited=session)
