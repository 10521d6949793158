"""Makes a recorded sequence: a planner leads an arm, its QPs are kept, and the truth about them is found."""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import linprog

import ftqp
from ftqp.control.paths import Path
from ftqp.control.planner.planner_view import SLACK
from ftqp.core.checks import FloatArray
from ftqp.model.robot import Robot
from ftqp.qp import QP, Claim, Recorder, Recording, Solution, SolveStatus
from ftqp.qp.problem import ANSWER
from ftqp.qp.solving import scales
from ftqp.sim.log.description import recorded
from ftqp.sim.schedule import FaultEvent, Schedule

AGREEMENT = 1e-8
"""Reference answers of two independent solvers differ by less than this, relative to 1 + |x|."""
REFEREES = ("active_set", "daqp")
"""The two solvers of the reference answers: both are exact methods, with nothing in common but numpy."""
FEASIBLE, INFEASIBLE = 1e-9, 1e-6
"""A least violation below the first is none, one above the second is a contradiction [1 + max |b|]."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """How a sequence comes to be.

    Attributes:
        name: The name of the sequence and of its file.
        what: What is special about it, in a sentence.
        robot: Makes the arm.
        path: A function from the pose at the start, (4, 4), to what the tip follows.
        q: Start, (nv,) [rad or m]; None is the robot's neutral posture.
        planner: Arguments of the planner.
        faults: What fails.
        begin: Time of the first QP [s].
        count: How many ticks are kept.
    """

    name: str
    what: str
    _: KW_ONLY
    robot: Callable[[], Robot]
    path: Callable[[FloatArray], Path]
    q: tuple[float, ...] | None = None
    planner: Mapping[str, Any] = field(default_factory=dict)
    faults: tuple[FaultEvent, ...] = ()
    begin: float = 0.0
    count: int = 40


def made(recipe: Recipe, *, count: int | None = None) -> Recording:
    """The sequence of a recipe, with reference answers and truths; the same in every run on a machine."""
    robot = recipe.robot()
    dt = float(recipe.planner.get("dt", 1e-3))
    first = round(recipe.begin / dt)
    last = first + min(recipe.count, count or recipe.count) - 1
    recorder = Recorder(REFEREES[0], first=first, last=last)
    planner = ftqp.Planner(robot, **{"emergency": None, **recipe.planner}, backend=recorder)
    recorder.follow(planner)
    q = robot.neutral if recipe.q is None else np.array(recipe.q)
    path, schedule = recipe.path(robot.pose(q)), Schedule(recipe.faults)
    simulation = ftqp.Simulation(planner, path, q=q, schedule=schedule, duration=max(last, 1) * dt)
    simulation.run()
    about = {"scenario": recipe.name, "what": recipe.what}
    return _with_truth(recorded(recorder, planner, path, schedule, about))


def _with_truth(recording: Recording) -> Recording:
    """The recording with reference answers in place of the run's, and with what is true of each QP."""
    answers = {name: getattr(recording, name).copy() for name in ANSWER}
    unresolved, infeasible, hard, differences = [], [], [], [0.0]
    slack = np.array([name.startswith(SLACK) for name in recording.variables])
    for k, problem in enumerate(recording):
        tick = int(recording.tick[k])
        found = [ftqp.qp.solve(problem, name) for name in REFEREES]
        possible = feasible(problem)
        if possible is False:
            infeasible.append(tick)
        if feasible(without(problem, slack)) is False:
            hard.append(tick)
        best = min(found, key=lambda answer: relative_residual(problem, answer))
        apart = _difference(found)
        if possible is True and apart <= AGREEMENT:
            differences.append(apart)
        elif possible is not False or any(answer.status is not SolveStatus.INFEASIBLE for answer in found):
            unresolved.append(tick)
        for name, values in answers.items():
            good = possible is True and best.status is SolveStatus.SOLVED
            values[k] = getattr(best, name) if good else np.nan
    lost = np.isnan(answers["x"]).any(axis=1)
    claim = np.where(lost & (recording.claim == Claim.SOLVED), int(Claim.FAILED), recording.claim)
    reference = (
        f"of {' and '.join(REFEREES)}, solved cold, the answer with the smaller KKT residual; both agree "
        f"within {max(differences):.0e} (1 + |x|) except at unresolved_ticks"
    )
    return replace(
        recording,
        **answers,
        claim=claim,
        metadata={
            **recording.metadata,
            "reference": reference,
            "infeasible_ticks": infeasible,
            "hard_infeasible_ticks": hard,
            "unresolved_ticks": unresolved,
        },
    )


def relative_residual(problem: QP, answer: Solution) -> float:
    """The largest KKT residual over its scale (``ftqp.qp.solving.scales``)."""
    found = answer.residuals
    if not np.isfinite(found.largest):
        return np.inf
    values = np.array([found.primal, found.dual, found.complementarity, found.gap])
    return float((values / scales(problem, answer.x, answer.y)).max())


def _difference(found: list[Solution]) -> float:
    """Largest |x - x'| over 1 + |x|; infinite when one has no answer."""
    if any(answer.status is not SolveStatus.SOLVED for answer in found):
        return np.inf
    x, other = found[0].x, found[1].x
    return float(np.abs(x - other).max() / (1.0 + np.abs(x).max()))


def without(problem: QP, slack: FloatArray) -> QP:
    """The QP without its compliance: the task as plain equalities."""
    keep = ~slack.astype(bool)
    return QP(
        problem.H[np.ix_(keep, keep)], problem.g[keep], problem.A[:, keep], problem.b, problem.C[:, keep],
        problem.l, problem.u, problem.lb[keep], problem.ub[keep],
    )  # fmt: skip


def feasible(problem: QP) -> bool | None:
    """Whether a QP has a feasible point, by the LP min t, |Ax - b| <= t, l - t <= Cx <= u + t, box, t >= 0.

    HiGHS solves it, which has no part in any backend's answer; None when t is too small to tell.
    """
    low, high = np.isfinite(problem.l), np.isfinite(problem.u)
    rows = np.vstack([problem.A, -problem.A, problem.C[high], -problem.C[low]])
    right = np.concatenate([problem.b, -problem.b, problem.u[high], -problem.l[low]])
    if len(right) == 0:
        return True
    result = linprog(
        np.append(np.zeros(problem.n), 1.0),
        A_ub=np.hstack([rows, -np.ones((len(right), 1))]),
        b_ub=right,
        bounds=[*zip(problem.lb, problem.ub, strict=True), (0.0, None)],
        method="highs-ds",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    if result.status != 0:
        return None
    violation = float(result.fun) / (1.0 + float(np.abs(problem.b).max(initial=0.0)))
    return True if violation <= FEASIBLE else False if violation > INFEASIBLE else None
