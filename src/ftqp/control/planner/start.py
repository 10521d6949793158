"""What the log says of where a planner begins, of rows that it gives up, and of an arm that holds short."""

import logging
from collections.abc import Mapping, Sequence
from typing import Any, Final, final

import numpy as np

from ftqp.control.paths.path import Path
from ftqp.control.planner.collision_model import CollisionModel
from ftqp.control.planner.mounted_robot import in_millimetres, weight_sentence
from ftqp.control.planner.stages import Stage
from ftqp.control.planner.step import Step
from ftqp.control.task.task import ROW_SETS
from ftqp.core.checks import FloatArray, perhaps_degrees
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import HEALTHY, SETS, TARGET_POSE, TARGET_TWIST
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.kernel.layout.thresholds import LENGTH_FRACTION, OUTSIDE_FROM
from ftqp.model.chain import frame_id
from ftqp.model.followers import coupled_columns, is_led
from ftqp.model.posture import NEAR_SINGULAR, least_singular_value, scaled_jacobian
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
PATIENCE: Final = 0.2
"""How long a task is RELAXED, and no nearer, before rows of it are given up [s]."""
SENTENCES: Final = {
    "position_axis": "the task stays infeasible: the rotation about the tool axis is given up",
    "position": "the task stays infeasible: the attitude is given up",
}
BACK: Final = "the rotation about the tool axis is given up, the direction of the tool can be held again"
WHOLE: Final = "the whole task can be held again: all its rows are back"


def allow(K: Any, sets: Sequence[str], dt: float, *, asked: bool) -> None:
    """Write down which rows of the task the kernel may give up."""
    task = K.task
    whole = int(task.m)
    fewer = [name for name in sets if len(ROW_SETS[name]) < whole][:SETS]
    task.sets, task.healthy_too = len(fewer), asked
    task.m_of[0], task.tool_of[0] = whole, task.tool_rows
    for k, name in enumerate(fewer):
        task.m_of[k + 1], task.tool_of[k + 1] = len(ROW_SETS[name]), name == "position_axis"
    task.patience = task.wait = round(PATIENCE / dt)


FAR = 0.05
"""A first target that is farther from the tip [m] is no beginning of a motion from where the arm is. A
convention: the default of the emergency stop's threshold."""
SAMPLES = 65
"""So many places of a path are looked at."""


class StartWatch:
    """Says once of a start what is wrong with it, as one warning on the logger ``ftqp``."""

    def __init__(self, K: Any, around: CollisionModel | None) -> None:
        self._K, self._said, self._around = K, "", around

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(begin=lambda q, robot, _: self.look(robot, q))

    def look(self, robot: Robot, q: FloatArray) -> None:
        """Warn of a start that is not what it seems; the warning of the start before is not repeated."""
        found = _sentences(robot, self._K, q)
        if self._around is not None:
            distances = {names: d[0] for names, d in self._around.distances(q[None]).items()}
            found += [*_within(distances), *_far_away(robot, distances)]
        sentence = "; ".join(found)
        if sentence and sentence != self._said:
            _LOG.warning("%s: %s", robot.name, sentence)
        self._said = sentence


def _sentences(robot: Robot, K: Any, q: FloatArray) -> list[str]:
    n, task = robot.nv, K.task
    rows = [COMPONENTS[c] for c in task.rows[: int(task.m)]]
    works = K.faults.code[:n] == HEALTHY
    axes = task.axis.reshape(3, 3) if task.tool_rows else None
    model = robot.model
    J = scaled_jacobian(
        model, model.createData(), frame_id(model, robot.tip), robot.configuration(q), rows, task.length, axes
    )
    share = least_singular_value(coupled_columns(robot.chain, J)[:, works]) / task.length
    found = _beyond(robot, q)
    if share < NEAR_SINGULAR:
        found.append(
            f"the start is near a singularity of the task (sigma_min is {share:.2g} of the characteristic "
            f"length, expected {NEAR_SINGULAR:g} or more), so directions of it may give way; start from "
            "another posture, such as robot.neutral"
        )
    if weight := weight_sentence(robot, q, K.limits.tau_max[:n]):
        found.append(weight)
    count = int(np.count_nonzero(works & ~is_led(robot.chain)))
    if count <= len(rows):
        found.append(
            f"{count} joints that work for {len(rows)} task rows leave no redundancy, so a joint that fails "
            "costs a direction; follow fewer rows, Task(rows=...), if the work allows it"
        )
    return found


def _beyond(robot: Robot, q: FloatArray) -> list[str]:
    limits = robot.limits
    away = np.maximum(limits.q_min - q, q - limits.q_max)
    far = [k for k in range(robot.nv) if away[k] > OUTSIDE_FROM]
    if not far:
        return []
    said = ", ".join(
        f"{robot.joints[k]} {q[k]:.4g} ({limits.q_min[k]:.4g} to {limits.q_max[k]:.4g})" for k in far
    )
    degrees = perhaps_degrees(float(away.max()))
    return [f"the start is beyond the range of {said}, which the arm is led back into first{degrees}"]


def _within(distances: Mapping[tuple[str, str], Any]) -> list[str]:
    """That bodies which are kept apart overlap at the start, the deepest first."""
    inside = sorted((float(d), pair) for pair, d in distances.items() if d < 0.0)
    if not inside:
        return []
    said = ", ".join(f"{a} and {b} by {-1e3 * d:.3g} mm" for d, (a, b) in inside)
    return [
        f"the arm starts within what it is to keep clear of: {said}; start elsewhere, or correct where they "
        "stand, in m"
    ]


def _far_away(robot: Robot, distances: Mapping[tuple[str, str], Any]) -> list[str]:
    """That a body is so far from the arm that it must be in millimetres, the farthest."""
    if not distances:
        return []
    pair, away = max(distances.items(), key=lambda one: float(one[1]))
    said = in_millimetres(robot, np.array([float(away)]), f"{pair[1]} is {{}} m from {pair[0]}")
    return [said] if said else []


def path_in_millimetres(robot: Robot, path: Path) -> str:
    """The same of the farthest of some samples of a path."""
    places = path.sample(np.linspace(0.0, path.duration, SAMPLES)).pose[:, :3, 3]
    away = np.linalg.norm(places, axis=1)
    return in_millimetres(robot, places[np.argmax(away)], "the path goes {} m from the base")


def in_milliseconds(robot: Robot, speed: float, dead_man: float) -> str:
    """To be said of a dead-man time in which the tip may go farther than the arm reaches; else empty."""
    reach, way = robot.length / LENGTH_FRACTION, speed * dead_man
    if not way > reach:
        return ""
    return (
        f"a dead_man of {dead_man:g} s lets the end effector go on for {way:.3g} m without its operator, "
        f"farther than the arm reaches, {reach:.2g} m; it is in s, 0.2 is usual"
    )


@final
class Rest:
    """Says when the arm begins and ends to hold, and when rows of its task go and come back, once each."""

    def __init__(self, session: Session, sets: Sequence[str], robot: Robot) -> None:
        self._robot, self._K = robot, session.K
        whole = int(session.K.task.m_of[0])
        self._sets = tuple(name for name in sets if len(ROW_SETS[name]) < whole)[:SETS]
        self._given_up, self._ticks = session.field("task", "given_up"), session.field("state", "ticks")
        self._holding = session.field("settling", "holding")
        self._said, self.held = 0, False

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life: a reset asks for the whole task again, and nothing is said of it."""
        return Stage(begin=lambda *_: self._forget())

    def _forget(self) -> None:
        self._said = 0

    @property
    def given_up(self) -> str | None:
        """What of the task is given up now, in a sentence; None while all counts."""
        if not self._given_up[0]:
            return None
        turns = int(self._K.task.m) > len(ROW_SETS["position"])
        what = "rotation about the tool axis" if turns else "attitude"
        return f"the {what} is given up, as the task cannot be held; it comes back as soon as it can"

    def tell(self, step: Step) -> None:
        """Log a change."""
        level, said = int(self._given_up[0]), self._said
        if level != said:
            _LOG.warning(SENTENCES[self._sets[level - 1]] if level > said else BACK if level else WHOLE)
            self._said = level
        if self._ticks[0] == 1:
            self._look_at_first_target(step)
        held = bool(self._holding[0])
        if held == self.held:
            return
        self.held = held
        if held:
            turned = f" and {step.rotation_error:.3g} rad" if step.rotation_error > 0.0 else ""
            _LOG.info("holding, out of reach by %.3g mm%s", 1e3 * step.position_error, turned)
        else:
            _LOG.info("no longer holding: the target, the working joints or the place of the arm has changed")

    def _look_at_first_target(self, step: Step) -> None:
        """Warn of a first target that is far from where the arm is: nobody leads it there."""
        away = step.position_error
        if not away > FAR:
            return
        target = self._K.task.target[TARGET_POSE:TARGET_TWIST]
        _LOG.warning(
            "%s: %s",
            self._robot.name,
            in_millimetres(self._robot, target[[3, 7, 11]])
            or f"the first target is {1e3 * away:.3g} mm from the end effector, which goes straight there "
            "as fast as its limits let it; begin where the arm is, or lead it by ftqp.GoTo or "
            "ftqp.TargetFollower",
        )
