"""A plan: a trajectory along a path whose postures survive as many failures as can be."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self, final

import numpy as np

from ftqp.analysis.planning.plan_case import planning_study
from ftqp.analysis.planning.remaining import continuation, remaining
from ftqp.analysis.planning.self_motion_speeds import null_vectors
from ftqp.analysis.survival.continuing import locks_survived
from ftqp.analysis.survival.coverage import coverage
from ftqp.analysis.survival.coverage_report import CoverageReport
from ftqp.analysis.survival.task_path import (
    Around,
    MotionOnPath,
    TaskPath,
    around_of,
    robot_digest,
    task_path,
)
from ftqp.control.planner.leading_plan import Remaining
from ftqp.control.scene.placed_shapes import Clearance, Scene
from ftqp.core.checks import BoolArray, FloatArray, IntArray, frozen, positive, read_only, whole_number
from ftqp.core.errors import InputError, reading
from ftqp.core.npz import read_npz, write_npz
from ftqp.core.small_picture import curves_svg, html_table
from ftqp.faults.kinds import Fault
from ftqp.model.robot import Robot


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Corridor:
    """Postures next to a plan that survive at least what it survives.

    Attributes:
        samples: Of the plan, (K,).
        low: How far the posture may go against n, the null vector with det [n; J] > 0, (K,) [rad or m].
        high: How far it may go along n, (K,) [rad or m].
        q_low: The posture there, (K, nv) [rad or m].
        q_high: The posture at the other end, (K, nv) [rad or m].
    """

    samples: IntArray
    low: FloatArray
    high: FloatArray
    q_low: FloatArray
    q_high: FloatArray


def corridor_of(task: TaskPath, q: FloatArray, *, stride: int, widest: float, spacing: float) -> Corridor:
    """The postures on the self-motion through each sample that survive every lock that is survived there.

    From each sample the self-motion is followed both ways in steps, until a posture is outside the limits,
    loses a joint, or is as far as is looked. Source: docs/theory/fault-tolerant-plans.md, "The corridor".
    """
    samples = np.arange(0, task.N, stride)
    survived = locks_survived(task, q[samples], samples)
    ends = [_walk(task, q[samples], samples, survived, side, widest, spacing) for side in (-1.0, 1.0)]
    return Corridor(
        samples=frozen(samples),
        low=frozen(ends[0][0]),
        high=frozen(ends[1][0]),
        q_low=frozen(ends[0][1]),
        q_high=frozen(ends[1][1]),
    )


def _walk(
    task: TaskPath,
    q: FloatArray,
    samples: IntArray,
    survived: BoolArray,
    side: float,
    widest: float,
    spacing: float,
) -> tuple[FloatArray, FloatArray]:
    """How far one side goes, (K,), and the posture there, (K, nv)."""
    study, limits = planning_study(task, spacing), task.robot.limits
    reach, edge, going = np.zeros(len(q)), q.copy(), np.arange(len(q))
    for step in range(1, int(np.floor(widest / spacing + 1e-9)) + 1):
        ahead = edge[going] + side * spacing * null_vectors(study, edge[going])
        exact, left, _ = study.limited.solutions(ahead, goals=task.goals[samples[going]], near=True)
        inside = ((exact >= limits.q_min) & (exact <= limits.q_max)).all(axis=1)
        kept = np.flatnonzero((left <= study.tolerance) & inside)
        if not len(kept):
            break
        labels = locks_survived(task, exact[kept], samples[going[kept]])
        kept = kept[(labels | ~survived[going[kept]]).all(axis=1)]
        going, exact = going[kept], exact[kept]
        reach[going], edge[going] = step * spacing, exact
        if not len(going):
            break
    return reach, edge


FORMAT = 1
"""Version of the file's layout."""


FACTS = (
    "dt", "joints", "rows", "axis", "coverage", "stride", "method", "settings", "robot_digest", "task_digest",
)  # fmt: skip
"""What a file holds of a plan beside its arrays, and the arm's name as ``robot``."""
ROUNDING = 1e-8
"""Poses of one path differ by less, whatever start they are computed from [m, and entries of rotations]."""


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class Plan(MotionOnPath):
    """A trajectory along a path, and what it survives; made by ``plan``, read by ``load_plan``.

    Attributes:
        q: Configurations at the samples, (N + 1, nv) [rad or m].
        goals: Poses of the path there, (N + 1, 4, 4) [m].
        dt: The time between samples [s].
        joints: Names of the joints.
        rows: Names of the task rows.
        axis: Whether of the orientation only the direction of the goal's z axis counts.
        coverage: Share of pairs of joint and instant that are survived, as it was verified.
        stride: Instants are so many samples apart.
        method: How the self-motion was chosen.
        settings: What it was made with, and what was found on the way; anything JSON can hold.
        robot_name: The arm's name.
        robot_digest: A hash of the arm.
        task_digest: A hash of arm, rows and path.
        robot: The arm; None where the plan was read without one.
        around: What the arm keeps clear of; None is nothing. A file does not hold it.
    """

    q: FloatArray
    goals: FloatArray
    dt: float
    joints: tuple[str, ...]
    rows: tuple[str, ...]
    axis: bool
    coverage: float
    stride: int
    method: str
    settings: Mapping[str, Any]
    robot_name: str
    robot_digest: str
    task_digest: str
    robot: Robot | None = None
    around: Around | None = None

    def __post_init__(self) -> None:
        read_only(self)

    def __repr__(self) -> str:
        """Arm, method, samples and coverage."""
        return (
            f"Plan({self.robot_name!r}, method={self.method!r}, samples={len(self.q)}, "
            f"coverage={self.coverage:.4f})"
        )

    def _repr_html_(self) -> str:
        """Arm, method, samples and coverage, for notebooks."""
        rows = [
            ("method", self.method),
            ("samples", len(self.q)),
            ("duration", f"{float(self.t[-1]):g} s"),
            ("failures survived", f"{100.0 * self.coverage:.1f} %"),
        ]
        says = f"joints over {float(self.t[-1]):g} s, {self.q.min():.3g} to {self.q.max():.3g} rad or m"
        picture = curves_svg([(self.t, one) for one in self.q.T], says)
        return html_table(f"Plan of {self.robot_name}", (), rows, picture=picture)

    @property
    def t(self) -> FloatArray:
        """Times of the samples, (N + 1,) [s]."""
        return self.dt * np.arange(len(self.q), dtype=np.float64)

    @property
    def v(self) -> FloatArray:
        """Velocities between samples, (N, nv) [rad/s or m/s]."""
        return np.asarray(np.diff(self.q, axis=0) / self.dt)

    @property
    def energy(self) -> float:
        """E = sum |q_(k+1) - q_k|^2 / dt [rad^2/s]."""
        return float((self.v**2).sum() * self.dt)

    @cached_property
    def task(self) -> TaskPath:
        """The path on its samples."""
        if self.robot is None:
            raise InputError(
                f"this plan was read without its robot, {self.robot_name}; give it one with plan.of(robot)"
            )
        found = task_path(self.robot, self.goals, rows=self._named_rows, dt=self.dt)
        return found.among(self.around)

    @property
    def _named_rows(self) -> str | tuple[str, ...]:
        return "position_axis" if self.axis else self.rows

    def of(
        self,
        robot: Robot,
        path: Any = None,
        *,
        scene: Scene | None = None,
        clearance: Clearance | None = None,
    ) -> Self:
        """This plan with its robot.

        Args:
            robot: The arm that it was made for.
            path: The path that it has to be for, as ``plan`` takes it; None is that of the plan.
            scene: What stands around the arm now; None is what the plan was made with.
            clearance: How far the arm keeps; None as in ``plan``.

        Raises:
            InputError: The plan is for another robot or another path.
        """
        if robot_digest(robot) != self.robot_digest:
            raise InputError(
                f"the plan is for another robot ({self.robot_name} with {len(self.joints)} joints) than "
                f"{robot.name}: links, tool, load or limits differ; plan again for this one"
            )
        around = around_of(robot, scene, clearance)
        own = replace(self, robot=robot, around=self.around if around is None else around)
        if path is not None:
            other = task_path(robot, path, rows=self._named_rows, dt=self.dt)
            if other.digest != self.task_digest and not _same(own.task, other):
                raise InputError(
                    f"the plan is for another path: {_difference(own.task, other)}; plan again for this"
                )
        return own

    @cached_property
    def report(self) -> CoverageReport:
        """Everything about what the plan survives, verified again at its stride."""
        return coverage(self.task.robot, self.task, self.q, stride=self.stride)

    def continue_after(self, joint: str | int, time: float) -> FloatArray:
        """How the arm finishes the path when a joint locks: configurations from that sample on, (K, nv).

        It is the continuation with which the plan was verified: the joint stays where it is from the last
        sample at or before the time on, the remaining joints go on along the path.

        Args:
            joint: The joint that locks, by name or 0-based index.
            time: When, from 0 to before the end of the path [s].

        Raises:
            NotSurvived: The path cannot be finished; the error says until when, and has the motion so far.
            InputError: The joint is unknown, the time is outside the path, or the plan has no robot.
        """
        return self.report.continue_after(joint, time)

    def corridor(self, *, stride: int | None = None, widest: float = 0.5, spacing: float = 0.02) -> Corridor:
        """How far the postures may be off along their self-motion with every survived lock still survived.

        Args:
            stride: Samples that are looked at are so far apart; None is that of the plan.
            widest: How far is looked each way, > 0 [rad or m]. More takes longer.
            spacing: Of the steps, > 0 [rad or m]. Smaller ones find narrower gaps and take longer.

        Raises:
            InputError: More than one joint is to spare, a number is out of range, or the plan has no robot.
        """
        task = self.task
        if task.redundancy != 1:
            raise InputError(
                f"{self.robot_name} has {task.redundancy} joints to spare; a corridor is known with one only"
            )
        step = self.stride if stride is None else stride
        whole_number("stride", step, 1)
        return corridor_of(
            task, self.q, stride=step, widest=positive("widest", widest), spacing=positive("spacing", spacing)
        )

    def remaining(self, q: FloatArray, at: float, faults: Sequence[Fault]) -> tuple[Remaining, ...]:
        """What can still be done of the path after faults, least lost first; see ``Planner.options``.

        Args:
            q: Where the arm is, (nv,) [rad or m].
            at: The time that the end effector has reached on the path [s].
            faults: What has failed.

        Raises:
            InputError: The plan was read without its robot.
        """
        return remaining(self.task, q, at, faults)

    def continuation(
        self, q: FloatArray, at: float, faults: Sequence[Fault]
    ) -> tuple[int, FloatArray] | None:
        """The verified postures after locks: the sample, and the joints from there on, (k, nv) [rad or m].

        Of the same arguments as ``remaining``; None where there is nothing to choose.
        """
        return continuation(self.task, q, at, faults)

    def save(self, file: str | Path) -> None:
        """Write the plan to a file for ``load_plan``; one of the same name is replaced.

        Args:
            file: It ends in ``.npz``.

        Raises:
            InputError: It does not end so, or cannot be written.
        """
        path, arrays = Path(file), {"q": self.q, "goals": self.goals}
        if path.suffix != ".npz":
            raise InputError(f"plan {str(file)!r} has to end in .npz; name it {path.stem or 'plan'}.npz")
        about = {name: getattr(self, name) for name in FACTS} | {"robot": self.robot_name}
        try:
            write_npz(path, arrays, {"format": FORMAT, **about})
        except OSError as error:
            raise InputError(f"plan {path} cannot be written: {error.strerror or error}") from error


def plan_of(
    task: TaskPath, q: FloatArray, *, coverage: float, stride: int, method: str, settings: Mapping[str, Any]
) -> Plan:
    """A trajectory as a plan."""
    return Plan(
        q=frozen(np.array(q, dtype=np.float64)),
        goals=task.goals,
        dt=task.dt,
        joints=task.robot.joints,
        rows=task.rows,
        axis=task.axis,
        coverage=coverage,
        stride=stride,
        method=method,
        settings=settings,
        robot_name=task.robot.name,
        robot_digest=robot_digest(task.robot),
        task_digest=task.digest,
        robot=task.robot,
        around=task.around,
    )


def load_plan(file: str | Path, robot: Robot | None = None, path: Any = None) -> Plan:
    """A plan from its file.

    Args:
        file: As ``Plan.save`` wrote it.
        robot: The arm that the plan has to be for. Without it ``q`` and ``t`` can be read, and the arm can be
            given later with ``Plan.of``.
        path: The path that the plan has to be for, as ``plan`` takes it.

    Raises:
        InputError: The file does not exist, is no plan, of another version or damaged, or the plan is for
            another robot or another path.
    """
    with reading(file, "a plan", "`ftqp.analysis.plan(...).save(file)` makes one"):
        arrays, about = read_npz(Path(file))
        if (version := about["format"]) != FORMAT:
            raise InputError(
                f"plan {file} has format {version!r:.20}, this ftqp reads {FORMAT}; plan it again with "
                "this ftqp"
            )
        about |= {name: tuple(about[name]) for name in ("joints", "rows")}
        about |= {
            "dt": float(about["dt"]),
            "coverage": float(about["coverage"]),
            "stride": int(about["stride"]),
        }
        facts: dict[str, Any] = {name: about[name] for name in FACTS}
        found = Plan(q=arrays["q"], goals=arrays["goals"], robot_name=about["robot"], **facts)
    if path is not None and robot is None:
        raise InputError("path is given without the robot, expected both")
    return found if robot is None else found.of(robot, path)


def _same(own: TaskPath, other: TaskPath) -> bool:
    """Whether two paths of one arm differ by rounding at most, which a hash may see."""
    if own.rows != other.rows or own.axis != other.axis or own.N != other.N or own.dt != other.dt:
        return False
    off = np.abs(own.goals - other.goals).max(axis=0)
    turns = off[:3, :3].max() if max(own.indices) > 2 else 0.0
    return bool(max(turns, *(off[i, 3] for i in own.indices if i < 3)) <= ROUNDING)


def _difference(own: TaskPath, other: TaskPath) -> str:
    """What first tells two paths of one arm apart."""
    if own.rows != other.rows or own.axis != other.axis:
        return f"it has the rows {', '.join(own.rows)} and not {', '.join(other.rows)}"
    if own.N != other.N or not np.isclose(own.dt, other.dt):
        return f"it has {own.N + 1} samples of {own.dt:g} s and not {other.N + 1} of {other.dt:g} s"
    off = np.abs(own.goals - other.goals).max(axis=(1, 2))
    k = int(np.argmax(off > 1e-6)) if (off > 1e-6).any() else 0
    return f"they differ at sample {k} (t = {own.t[k]:g} s) by {off[k]:.3g}"
