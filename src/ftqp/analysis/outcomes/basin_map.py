"""Which start goes where when one joint is locked at a value: basins of an arm of three joints."""

from dataclasses import dataclass
from typing import Any, final

import numpy as np
from scipy.integrate import solve_ivp

from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.outcomes.unaware_law import UnawareLaw, weights_inverse
from ftqp.analysis.rest.linearisation import reduced_jacobians
from ftqp.analysis.rest.rest_curves import rests_at
from ftqp.core.checks import FloatArray, IntArray, frozen, whole_number
from ftqp.core.errors import InputError
from ftqp.kernel.entry.law_study import LawStudy
from ftqp.kernel.layout.enums import Ending
from ftqp.model.robot import Robot

TURN = 2.0 * np.pi
SAME = 1e-3
"""Ends so near each other are one [rad]."""
LEAVING = 1e-3
"""From a saddle to the begin of a separatrix [rad]."""
LONGEST = 40.0
"""Of a separatrix, in s."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Basins:
    """Where starts lead, over the two joints that move.

    Attributes:
        moving: The indices of the joints that move.
        angles: Their values, the middles of the cells, (grid,) [rad].
        label: Which end, (grid, grid), first index the first joint that moves: an index of ``ends``, or -1
            without rest, -2 without verdict.
        ends: Configurations at rest, (k, nv) [rad], angles in (-pi, pi].
        kinds: What each is: ``correct``, ``erroneous`` or ``singular``.
        share: Share of the area of each, (k,).
        saddles: Rest configurations that attract in one direction only, (s, nv) [rad].
        eigenvalues: Of each of them, (s, 2) [1/s], with gain 1.
        separatrices: The ways into the saddles, which part the basins, each (k, nv) [rad].
    """

    moving: tuple[int, int]
    angles: FloatArray
    label: IntArray
    ends: FloatArray
    kinds: tuple[str, ...]
    share: FloatArray
    saddles: FloatArray
    eigenvalues: FloatArray
    separatrices: list[FloatArray]


def basins(
    robot: Robot, goal: Any, joint: str | int, value: float, grid: int = 400, *, W: Any = None
) -> Basins:
    """The basins of the ends of all motions with a joint locked at a value that nobody knows of.

    Args:
        robot: A planar arm of three revolute joints.
        goal: Where the end effector is to go, (2,) or (3,) [m].
        joint: The joint that is locked, by name or index.
        value: Where [rad].
        grid: Cells along each of the two joints that move, >= 2; the cost grows with its square.
        W: Weights of the joint rates, positive definite, (nv, nv) or diagonal (nv,); None is the identity.

    Raises:
        InputError: The arm is another one, there is no such joint, or a number is out of its range.
    """
    if robot.nv != 3 or robot.default_rows != ("x", "y") or robot.chain.prismatic.any():
        raise InputError(f"{robot.name} has no map of basins, expected a planar arm of three revolute joints")
    whole_number("grid", grid, 2)
    i = robot.joint(joint)
    first, second = (k for k in range(3) if k != i)
    M = weights_inverse(W, 3)
    study = goal_study(robot, goal, "position")
    angles = -np.pi + TURN * (np.arange(grid) + 0.5) / grid
    starts = np.empty((grid, grid, 3))
    starts[:, :, i] = value
    starts[:, :, first], starts[:, :, second] = angles[:, None], angles[None, :]
    law = LawStudy(study.free, M, 2.0 * robot.length)
    endings, ends, _ = law.runs(starts.reshape(-1, 3), np.full(grid * grid, 1 << i))
    label, found, kinds = _labelled(endings, ends)
    share = np.array([np.mean(label == k) for k in range(len(found))])
    saddles, eigenvalues, ways = _saddles(study, M, i, value, (first, second))
    return Basins(
        moving=(first, second), angles=frozen(angles), label=frozen(label.reshape(grid, grid)),
        ends=frozen(found), kinds=kinds, share=frozen(share), saddles=frozen(saddles),
        eigenvalues=frozen(eigenvalues), separatrices=ways,
    )  # fmt: skip


def _principal(q: FloatArray) -> FloatArray:
    """Angles in (-pi, pi]."""
    return np.asarray(np.pi - (np.pi - q) % TURN)


def _labelled(endings: IntArray, ends: FloatArray) -> tuple[IntArray, FloatArray, tuple[str, ...]]:
    """The label of each run, the different ends and what they are, the largest basin first."""
    label = np.where(endings == Ending.NONE, -1, -2)
    rest = (endings != Ending.NONE) & (endings != Ending.UNRESOLVED)
    groups: list[tuple[int, FloatArray, str]] = []
    left = np.flatnonzero(rest)
    number = 0
    while len(left):
        q = ends[left[0]]
        near = np.abs(_principal(ends[left] - q)).max(axis=1) < SAME
        near &= endings[left] == endings[left[0]]
        label[left[near]] = number
        groups.append((int(near.sum()), _principal(q), Ending(int(endings[left[0]])).name.lower()))
        left, number = left[~near], number + 1
    order = sorted(range(number), key=lambda k: -groups[k][0])
    new = np.empty(number, np.int64)
    new[order] = np.arange(number)
    label = np.where(label >= 0, new[np.maximum(label, 0)] if number else label, label)
    found = np.array([groups[k][1] for k in order]).reshape(number, 3)
    return label.astype(np.int64), found, tuple(groups[k][2] for k in order)


def _saddles(
    study: GoalStudy, M: FloatArray, i: int, value: float, moving: tuple[int, int]
) -> tuple[FloatArray, FloatArray, list[FloatArray]]:
    """Saddles away from the goal, their eigenvalues, and the ways into them."""
    law = UnawareLaw(study, M, (i,))
    found, values, ways = [], [], []
    for rest in rests_at(study, M, i, value):
        eigenvalues, vectors = np.linalg.eig(reduced_jacobians(study, M, rest[None], (i,))[0])
        order = np.argsort(eigenvalues.real)
        low, high = eigenvalues.real[order]
        if np.abs(eigenvalues.imag).max() > 0.0 or not low < 0.0 < high:
            continue
        found.append(np.where(np.arange(3) == i, value, _principal(rest)))
        values.append(np.array([low, high]))
        for side in (LEAVING, -LEAVING):
            begin = found[-1].copy()
            begin[list(moving)] += side * vectors[:, order[0]].real
            ways.append(_backwards(law, begin))
    return np.array(found).reshape(-1, 3), np.array(values).reshape(-1, 2), ways


def _backwards(law: UnawareLaw, q: FloatArray) -> FloatArray:
    """The way that leads to q, (k, nv)."""

    def reversed_motion(s: float, y: FloatArray) -> FloatArray:
        return np.asarray(-law.scaled(s, y))

    options: dict[str, Any] = {"method": "DOP853", "rtol": 1e-8, "atol": 1e-8, "max_step": 0.1}
    way = solve_ivp(reversed_motion, (0.0, LONGEST), np.append(q, 0.0), **options)
    return frozen(way.y[:-1].T.copy())
