"""Several tasks along paths of their own in one common time, which waits for whoever stays behind."""

from collections.abc import Mapping
from typing import Any, final

import numpy as np

from ftqp.control.following.path_follower import PathStatus
from ftqp.control.following.tip_tracker import frame_of
from ftqp.control.paths.path import Path
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.control.planner.step_parts import TIP
from ftqp.control.planner.target import Target, target_on
from ftqp.core.checks import instance, positive, seen
from ftqp.core.errors import InputError
from ftqp.core.fixed import Fixed
from ftqp.kernel.layout.enums import HELD, STOPPED, STOPPING
from ftqp.kernel.layout.thresholds import SCALED_FROM

LEASH, TURN_LEASH = 0.004, 0.02
"""Errors at which paths wait [m, rad], by default: below the tolerance of a task, 0.01 and 0.05, so that a
path that waits is still followed."""
FREE = 0.25
"""Share of the leash up to which paths run at full speed."""
RISE = 0.2
"""How long the rate takes from 0 to 1, at least [s]: the tips' accelerations along their paths change by
speed over that."""
STANDS = 0.01
"""A rate below this is none, as of a ``PathFollower``. A convention."""
PATIENCE = 1.0
"""Paths that stand for so long are blocked [s]."""


@final
class TaskPaths:
    """Leads tasks of a planner along paths, hand in hand: their common time waits for the one that is behind.

    The common time, the progress, runs at the rate r in [0, 1]. Targets are the paths' poses at the progress,
    with twist r x' and acceleration r^2 x'' + r' x'. r is 1 while every task is within a quarter of its
    leash, falls in proportion beyond and is 0 at the leash, and changes by no more than 5 1/s; so tasks on
    level 0 and 1 are followed as long as joints can, and where they cannot, all paths slow down together.

    Args:
        planner: The planner that it commands.
        paths: The path of each task, by its name: further tasks, ``PoseTask`` and ``PositionTask``, and the
            tip by the name of its frame. A path that is shorter than another ends first and rests.
        leash: Position error at which paths wait, > 0 [m]. A larger one lets tasks stay farther behind before
            the paths slow down, which soft tasks, on level 3, need.
        turn_leash: The same of rotation, > 0 [rad].

    Raises:
        InputError: There is no such task, or it is of another kind, no path, or a number out of its range.
    """

    __slots__ = (
        "_duration", "_frames", "_leash", "_paths", "_planner", "_progress", "_rate", "_standing", "_targets",
        "_turn_leash", "_worst",
    )  # fmt: skip

    planner: Fixed[Planner] = Fixed("_planner")
    paths: Fixed[Mapping[str, Path]] = Fixed("_paths")

    def __init__(
        self,
        planner: Planner,
        paths: Mapping[str, Path],
        *,
        leash: float = LEASH,
        turn_leash: float = TURN_LEASH,
    ) -> None:
        instance("planner", planner, Planner, "an ftqp.Planner, ftqp.Planner(robot, tasks=[...])")
        if not isinstance(paths, Mapping) or not paths:
            raise InputError(
                f"paths is {type(paths).__name__}, expected a path by task, "
                "{'left_hand': ftqp.paths.Line(...)}"
            )
        for name, path in paths.items():
            instance(f"path of {name}", path, Path, "a path of ftqp.paths, for example ftqp.paths.Circle")
        self._planner, self._paths = planner, dict(paths)
        self._leash = positive("leash", leash, "m")
        self._turn_leash = positive("turn_leash", turn_leash, "rad")
        self._frames = {name: frame_of(planner, name) for name in paths}
        self._targets = {name: Target(pose=path.start) for name, path in paths.items()}
        self._duration = max(path.duration for path in paths.values())
        self._begin()

    def _begin(self) -> None:
        self._progress, self._rate, self._standing = 0.0, 0.0, 0.0
        self._worst: tuple[str, float] = ("", 0.0)

    def reset(self, q: Any, v: Any = None) -> None:
        """Begin the paths anew at (q, v), see ``Planner.reset``.

        Args:
            q: The measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: The measured velocity, (nv,) [rad/s or m/s]; None is rest.
        """
        self._planner.reset(q, v)
        self._begin()

    def step(self, q: Any, v: Any = None, target: Any = None, *, tau: Any = None, tip: Any = None) -> Step:
        """The command for the next ``dt``, and the progress with it; see ``Planner.step``.

        Args:
            q: The measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: The measured velocity, (nv,) [rad/s or m/s], or None.
            target: What tasks without a path are to do: a table of targets, or the end effector's target
                where it has no path; None lets them keep their last. An end effector that never had one is an
                error.
            tau: The measured torque, (nv,) [N m or N], or None.
            tip: The measured pose of the end effector, (4, 4), or None to take that of the model.
        """
        dt, before = self._planner.dt, self._rate
        wanted = self._planner.speed * float(np.clip((1.0 - self._worst[1]) / (1.0 - FREE), 0.0, 1.0))
        self._rate = float(np.clip(wanted, before - dt / RISE, before + dt / RISE))
        change = (self._rate - before) / dt
        table = dict(target) if isinstance(target, Mapping) else {} if target is None else {TIP: target}
        for name, path in self._paths.items():
            table[name] = self._aimed(name, path, change)
        step = self._planner.step(q, v, table, tau=tau, tip=tip)
        if step.code in (STOPPING, STOPPED, HELD):
            self._rate = 0.0
            return step
        self._progress = min(self._progress + 0.5 * (before + self._rate) * dt, self._duration)
        self._worst = max(((name, self._behind(name, step)) for name in self._paths), key=lambda one: one[1])
        self._standing = self._standing + dt if self._rate < STANDS else 0.0
        return step

    def _aimed(self, name: str, path: Path, change: float) -> Target:
        """The target of a task on its path at the progress."""
        target = self._targets[name]
        at = path.sample([min(self._progress, path.duration)])
        moves = self._progress < path.duration
        rate, change = (self._rate, change) if moves else (0.0, 0.0)
        target.pose[:] = at.pose[0]
        target.twist[:] = rate * at.twist[0]
        target.acceleration[:] = rate * rate * at.acceleration[0] + change * at.twist[0]
        return target

    def _behind(self, name: str, step: Step) -> float:
        """How far a task is from its target, as a share of the leash."""
        position, rotation = self._frames[name].distances(step)
        return max(position / self._leash, rotation / self._turn_leash)

    @property
    def progress(self) -> float:
        """The common time that has been reached [s]; it never runs backwards."""
        return self._progress

    @property
    def rate(self) -> float:
        """How fast it runs, 1 at the paths' own speed."""
        return self._rate

    @property
    def targets(self) -> dict[str, Target]:
        """What the last step aimed at, by task; it belongs to the follower."""
        return {name: target_on(seen(one.packed)) for name, one in self._targets.items()}

    @property
    def status(self) -> PathStatus:
        """Where the paths stand."""
        if self._progress >= self._duration:
            return PathStatus.DONE
        if self._standing > PATIENCE:
            return PathStatus.BLOCKED
        return (
            PathStatus.SCALED if self._worst[1] > FREE or self._rate < SCALED_FROM else PathStatus.FOLLOWING
        )

    @property
    def blocked(self) -> str | None:
        """Which task cannot go on, or None while the paths are not blocked."""
        if self.status is not PathStatus.BLOCKED:
            return None
        name, share = self._worst
        return (
            f"all paths wait at {self._progress:.3g} s for {name}, which is {share:.3g} of its leash "
            f"({1e3 * self._leash:.3g} mm, {self._turn_leash:.3g} rad) away"
        )

    def __repr__(self) -> str:
        return f"TaskPaths({list(self._paths)}, {self.status.name})"
