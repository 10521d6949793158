"""What a plan is made for: the task, its start and the knobs, in one record that every method takes."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, Final, Literal, TypeVar, final, get_args

import numpy as np

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.survival.continuing import task_session
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError, unknown
from ftqp.core.setting import refuse_out_of_range, setting
from ftqp.model.robot import Robot

Method = Literal["dp", "spline", "gradient", "constant"]
"""How the self-motion is chosen."""
Select = Literal["coverage", "energy"]
"""What of a sweep is taken: what survives most, or the paper's rule: least energy of what passes its test."""
OnProgress = Callable[[int, int, str], None]
"""Called with what is done, of how much, and what is being done."""

UNLIMITED_SPEED = 1.0
"""Speed that a plan gives to a joint without a limit [rad/s or m/s]."""
SWEEP = tuple(round(0.01 * k, 2) for k in range(-100, 101))
"""The paper's speeds of the self-motion [rad/s]."""


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

    waypoints: int = setting(60, least=1)
    spacing: float = setting(0.06, above=0.0, least=1e-3, most=1.0)
    nodes: int = setting(300, least=8)
    share: float = setting(0.5, above=0.0, least=1e-3, most=1.0)
    energy: float = setting(2e-4, least=0.0)
    margin: float = setting(0.0, least=0.0)
    thetas: tuple[float, ...] = SWEEP
    select: Select = "coverage"
    knots: int = setting(6, least=2)
    evaluations: int = setting(250, least=1)
    gain: float = setting(0.3, least=0.0)
    fastest: float = setting(1.0, above=0.0, least=1e-3)
    stride: int = setting(4, least=1)

    def __post_init__(self) -> None:
        refuse_out_of_range(self, every=True)
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


T = TypeVar("T")
ROUNDS: Final = 20
"""Work is done in about so many parts, to tell of progress."""


def in_parts(work: Callable[[Sequence[int]], Iterable[T]], count: int) -> Iterator[T]:
    """What work makes of all items, in order."""
    size = max(1, count // ROUNDS)
    for first in range(0, count, size):
        yield from work(range(first, min(first + size, count)))


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
    notify: OnProgress = silent  # Hears of progress

    @cached_property
    def study(self) -> GoalStudy:
        """Studies of the arm and the task rows, with steps of the settings' spacing."""
        return planning_study(self.task, self.settings.spacing)


def planning_study(task: TaskPath, spacing: float) -> GoalStudy:
    """Studies within the arm's limits of a task's rows; the goal is the first sample."""
    session = task_session(task)
    session.S.study.step = spacing
    return GoalStudy(robot=task.robot, rows=task.rows, pose=task.goals[0], free=session, limited=session)
