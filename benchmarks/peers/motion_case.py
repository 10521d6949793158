"""One motion after a lock, the same for every program; it needs numpy only, as all of them have it."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import process_time

import numpy as np

STOOD, STANDS = 25, 1e-9
"""Joints that have gone less than the second [rad] in so many ticks stand."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionCase:
    """A straight motion of the tip of an arm one of whose joints is locked from the beginning, past balls.

    Attributes:
        kind: ``path`` or ``goal``: whether the tip has to be on the line all the time, or at its end only.
        arm: Name of the arm.
        urdf: The arm, as text.
        tip: The frame that moves.
        joints: Names from base to tip, (n,).
        locked: Index of the locked joint, -1 of a healthy arm.
        dt: Step [s].
        q: Start, at rest, (n,).
        start: Pose of the tip there, (4, 4).
        goal: Where it shall be, (4, 4).
        duration: Of the line [s], with a quintic law.
        rest: How long it stands at the end [s].
        limits: q_min, q_max, v_max and a_max, (4, n).
        feasible: What the oracle says: ``straight``, ``other posture`` or ``not known``.
        rods: The arm's bodies: number of the joint, both ends in its frame, radius, (8,) each.
        balls: x, y, z and radius of each that stands in the way, (K, 4).
        keep: How far the arm shall stay away from them [m].
    """

    kind: str
    arm: str
    urdf: str
    tip: str
    joints: list
    locked: int
    dt: float
    q: list
    start: list
    goal: list
    duration: float
    rest: float
    limits: list
    feasible: str = ""
    rods: list = field(default_factory=list)
    balls: list = field(default_factory=list)
    keep: float = 0.0

    @property
    def steps(self) -> int:
        """Ticks of the line and of the rest."""
        return round((self.duration + self.rest) / self.dt)

    def targets(self):
        """Pose (K, 4, 4) and twist (K, 6) along W at each tick."""
        T0, T1 = np.array(self.start), np.array(self.goal)
        t = np.minimum(np.arange(self.steps) * self.dt / self.duration, 1.0)
        s = 10.0 * t**3 - 15.0 * t**4 + 6.0 * t**5
        ds = (30.0 * t**2 - 60.0 * t**3 + 30.0 * t**4) / self.duration
        w = vector_of(T1[:3, :3] @ T0[:3, :3].T)
        poses = np.tile(np.eye(4), (self.steps, 1, 1))
        poses[:, :3, 3] = T0[:3, 3] + s[:, None] * (T1[:3, 3] - T0[:3, 3])
        poses[:, :3, :3] = np.array([turn(share * w) for share in s]) @ T0[:3, :3]
        return poses, np.concatenate([ds[:, None] * (T1[:3, 3] - T0[:3, 3]), ds[:, None] * w], axis=1)


def vector_of(R):
    """The rotation vector of R, (3,)."""
    axis = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    s = np.linalg.norm(axis)
    return axis * (np.arctan2(s, 0.5 * (np.trace(R) - 1.0)) / s if s > 1e-12 else 1.0)


def turn(w):
    """exp of a rotation vector, (3, 3)."""
    angle = np.linalg.norm(w)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = w / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def write(cases, file: Path) -> None:
    """Cases into a file."""
    file.write_text(json.dumps([asdict(case) for case in cases]))


def read(file: Path):
    """Cases from a file."""
    return [MotionCase(**case) for case in json.loads(Path(file).read_text())]


def run_all(make, cases, out: Path, versions, longest: float = 0.0, *, remembers: bool = False) -> None:
    """Step every case with a program and keep its joints and times; what a program raises is kept, too.

    Args:
        make: From a case to a function of the number of the tick that gives the next q, (n,), or None from
            when nothing more will happen: joints then stay.
        cases: The cases.
        out: Where q of case i goes as ``q_i``, us per tick as ``us``, errors as ``failed``.
        versions: Packages and their versions.
        longest: How long a motion may take that does not end with the case's steps [s].
        remembers: Whether a program may do something else on the same joints and target; one that does not,
            and whose joints stand when the line is over, is not asked any more.
    """
    found, us, failed = {}, [], []
    for i, case in enumerate(cases):
        q, why, taken = [np.array(case.q)], "", 0.0
        try:
            step = make(case)
            began = process_time()
            for k in range(max(case.steps, round(longest / case.dt))):
                there = step(k)
                if there is None:
                    break
                q.append(np.array(there))
                still = k > STOOD and np.abs(q[-1] - q[-1 - STOOD]).max() < STANDS
                if still and not remembers and k * case.dt > case.duration + STOOD * case.dt:
                    break
            taken = process_time() - began
        except Exception as error:
            why = f"{type(error).__name__}: {error}"[:200]
        us.append(1e6 * taken / max(1, len(q) - 1))
        if not why:
            q += [q[-1]] * (case.steps + 1 - len(q))
        found[f"q_{i}"] = np.array(q)
        failed.append(why)
    np.savez(out, us=us, failed=failed, versions=json.dumps(versions), **found)
