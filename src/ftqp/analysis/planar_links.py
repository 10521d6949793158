"""A planar arm as its links: what it reaches with a joint locked, and the configurations of a tip."""

from dataclasses import dataclass
from typing import Any, Self, final

import numpy as np

from ftqp.core.checks import FloatArray, frozen
from ftqp.core.pose import transform
from ftqp.kernel.entry.law_study import Intervals, LawStudy
from ftqp.kernel.entry.study_session import StudySession
from ftqp.model.robot import Robot

SAMPLES = 720
"""Points of a self-motion between which equal arc lengths are found."""
PROJECTIONS = 60
"""Newton steps from a random configuration onto a tip position."""
ON = 1e-12
"""A configuration so near a tip position is on it [mean link lengths]."""
OFFSET = 0.382
"""Of the first configuration from the beginning of a component, where the arm may be stretched."""
TURN = 2.0 * np.pi


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanarLinks:
    """An arm of revolute joints whose axes are parallel to z, its links in the plane x, y."""

    link: FloatArray  # Lengths of the links, their mean 1, (n,)
    scale: float  # Their mean length [m]
    base: FloatArray  # Where joint 1 is, (2,) [m]
    # Those of the arm of such a size that ``scale`` is 1, with joint 1 at the origin
    constants: dict[str, Any]

    @classmethod
    def of(cls, robot: Robot) -> Self | None:
        """The links of a robot; None where it is no such arm."""
        chain = robot.chain
        offsets = np.vstack([chain.translation, chain.tip_translation])
        lengths = links_of(chain.rotation, offsets, chain.prismatic)
        if lengths is None or robot.nv < 2 or not robot.is_serial:
            return None
        scale, base = float(lengths.mean()), offsets[0, :2].copy()
        offsets[0] = 0.0
        moved = {"translation": offsets[:-1] / scale, "tip_translation": offsets[-1] / scale}
        constants = {**chain.constants(), **moved}
        return cls(link=frozen(lengths / scale), scale=scale, base=frozen(base), constants=constants)

    @property
    def reach(self) -> float:
        """Distance of the stretched arm's tip [m]."""
        return float(self.link.sum()) * self.scale

    def inner(self) -> float:
        """Radius of the void around the first joint that the tip does not reach [m]."""
        return max(0.0, 2.0 * float(self.link.max()) - float(self.link.sum())) * self.scale

    def local(self, point: Any) -> FloatArray:
        """A point of the plane seen from joint 1, in mean link lengths."""
        return np.asarray((np.asarray(point, dtype=np.float64) - self.base) / self.scale)

    def study(self, M: FloatArray, goal: FloatArray) -> LawStudy:
        """Compiled studies of the arm with one goal, in mean link lengths."""
        wide = np.full(len(self.link), np.inf)
        session = StudySession(self.constants, (0, 1), 1.0, q_min=-wide, q_max=wide, wraps=wide > 0.0)
        session.aim(transform(np.eye(3), np.append(goal, 0.0)))
        return LawStudy(session, M, 1.0)

    def ranges(self, goal: FloatArray) -> list[Intervals]:
        """The values of each joint at which the other joints can bring the tip to a goal.

        A locked joint i > 1 makes one link of length |l_{i-1} + l_i exp(j q_i)| of two; a locked joint 1
        moves the base to l_1 u(q_1). An arm reaches distances from 2 max l - sum l to sum l.
        Source: docs/theory/after-a-failure.md, "Reach".
        """
        l, R = self.link, float(np.hypot(*goal))
        found: list[Intervals] = []
        for i in range(len(l)):
            if i == 0:
                rest = l[1:]
                high = float(rest.sum())
                low = max(0.0, 2.0 * float(rest.max()) - high)
                middle, sign = float(np.arctan2(goal[1], goal[0])), -1.0
                size = R * R + l[0] ** 2, 2.0 * l[0] * R
            else:
                rest = np.delete(l, [i - 1, i])
                total, longest = float(rest.sum()), float(rest.max(initial=0.0))
                low, high = max(0.0, R - total, 2.0 * longest - total - R), R + total
                middle, sign = 0.0, 1.0
                size = l[i - 1] ** 2 + l[i] ** 2, 2.0 * l[i - 1] * l[i]
            found.append(_two_sided(middle, sign, low, high, *size))
        return found

    def configurations(self, point: FloatArray, count: int, seed: int) -> list[FloatArray]:
        """Configurations with the tip at a point, one array for each part of the self-motion, (k, n) [rad].

        Of three joints ``count`` for each component, at equal arc lengths; of two joints both; of more joints
        projections of quasi-random configurations, in one array.
        """
        if len(self.link) == 3:
            return [self._spread(part, count) for part in self._parts(point)]
        if len(self.link) == 2:
            return [q for s in (1.0, -1.0) if len(q := self._elbow(point, np.full(1, s)))]
        return [self._projected(point, count, seed)]

    def _elbow(self, point: FloatArray, sign: FloatArray) -> FloatArray:
        """The joints of a 2R arm with an elbow of a sign, (1, 2), or (0, 2) where the point is too far."""
        l1, l2 = self.link
        cosine = (point @ point - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
        if abs(cosine) > 1.0:
            return np.empty((0, 2))
        q2 = sign * np.arccos(cosine)
        q1 = np.arctan2(point[1], point[0]) - np.arctan2(l2 * np.sin(q2), l1 + l2 * np.cos(q2))
        return np.column_stack([q1, q2])

    def _parts(self, point: FloatArray) -> list[tuple[float, float, float, FloatArray]]:
        """Components of a 3R self-motion: (middle, half width, elbow, point) of the last link's angle.

        A half width of pi is a whole turn with one elbow; else the elbow changes at both ends.
        """
        l1, l2, l3 = self.link
        R, phi = float(np.hypot(*point)), float(np.arctan2(point[1], point[0]))
        square, slope = R * R + l3 * l3, max(2.0 * R * l3, 1e-300)
        low, high = (square - (l1 + l2) ** 2) / slope, (square - (l1 - l2) ** 2) / slope
        if low >= high or low > 1.0 or high < -1.0:
            return []
        if low <= -1.0 and high >= 1.0:
            return [(phi, np.pi, elbow, point) for elbow in (1.0, -1.0)]
        near, far = float(np.arccos(min(high, 1.0))), float(np.arccos(max(low, -1.0)))
        if near == 0.0:
            return [(phi, far, 0.0, point)]
        if far == np.pi:
            return [(phi + np.pi, np.pi - near, 0.0, point)]
        half = 0.5 * (far - near)
        return [(phi + side * 0.5 * (near + far), half, 0.0, point) for side in (1.0, -1.0)]

    def _at(self, part: tuple[float, float, float, FloatArray], t: FloatArray) -> FloatArray:
        """The configurations of a component at parameters t of [0, 2 pi), (k, 3), smooth in t."""
        middle, half, elbow, point = part
        l1, l2, l3 = self.link
        whole = elbow != 0.0
        psi = middle + (t if whole else half * np.cos(t))
        sign = elbow if whole else np.where(t < np.pi, 1.0, -1.0)
        wx, wy = point[0] - l3 * np.cos(psi), point[1] - l3 * np.sin(psi)
        cosine = np.clip((wx * wx + wy * wy - l1 * l1 - l2 * l2) / (2.0 * l1 * l2), -1.0, 1.0)
        q2 = sign * np.arccos(cosine)
        q1 = np.arctan2(wy, wx) - np.arctan2(l2 * np.sin(q2), l1 + l2 * np.cos(q2))
        return np.column_stack([q1, q2, psi - q1 - q2])

    def _spread(self, part: tuple[float, float, float, FloatArray], count: int) -> FloatArray:
        """Configurations at equal arc lengths, (count, 3)."""
        t = np.linspace(0.0, TURN, SAMPLES + 1)
        q = np.unwrap(self._at(part, np.where(t < TURN, t, 0.0)), axis=0)
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
        wanted = length[-1] * (np.arange(count) + OFFSET) / count
        return self._at(part, np.interp(wanted, length, t))

    def _projected(self, point: FloatArray, count: int, seed: int) -> FloatArray:
        """Quasi-random configurations brought onto the point by Newton steps, those that arrive, (k, n)."""
        q = spread_evenly(count, len(self.link), seed)
        for _ in range(PROJECTIONS):
            u = np.cumsum(q, axis=1)
            x, y = self.link * np.cos(u), self.link * np.sin(u)
            px, py = (np.cumsum(z[:, ::-1], axis=1)[:, ::-1] for z in (x, y))
            ex, ey = point[0] - px[:, 0], point[1] - py[:, 0]
            a, b, d = (py * py).sum(1), -(px * py).sum(1), (px * px).sum(1)
            w = 1.0 / np.maximum(a * d - b * b, 1e-9)
            along, across = (d * ex - b * ey) * w, (a * ey - b * ex) * w
            move = px * across[:, None] - py * along[:, None]
            longest = np.abs(move).max(axis=1, keepdims=True)
            q = q + move * np.minimum(1.0, 0.5 / np.maximum(longest, 1e-300))
        return np.asarray(q[np.hypot(ex, ey) < 1e3 * ON])


def _two_sided(middle: float, sign: float, low: float, high: float, square: float, slope: float) -> Intervals:
    """The angles a with low^2 <= square + sign slope cos(a - middle) <= high^2."""
    least, most = sorted((sign * (low * low - square) / slope, sign * (high * high - square) / slope))
    if low == 0.0:
        least, most = (-2.0, most) if sign > 0.0 else (least, 2.0)
    if least > 1.0 or most < -1.0:
        return ()
    near, far = float(np.arccos(min(most, 1.0))), float(np.arccos(max(least, -1.0)))
    if near == 0.0:
        return ((middle - far, middle + far),)
    if far >= np.pi:
        return ((middle + near, middle + TURN - near),)
    return ((middle - far, middle - near), (middle + near, middle + far))


def spread_evenly(count: int, dimension: int, seed: int) -> FloatArray:
    """Angles spread evenly over all turns, (count, dimension) [rad], the same every time.

    Source: the additive recurrence of Roberts 2018 with the generalised golden ratio; no formula of ours
    depends on it.
    """
    ratio = 2.0
    for _ in range(60):
        ratio = (1.0 + ratio) ** (1.0 / (dimension + 1.0))
    steps = ratio ** -np.arange(1.0, dimension + 1.0)
    offset = np.random.default_rng(seed).random(dimension)
    return np.asarray(TURN * ((offset + np.outer(np.arange(count), steps)) % 1.0) - np.pi)


def links_of(rotation: Any, offsets: FloatArray, prismatic: Any) -> FloatArray | None:
    """The lengths of the links of an arm whose joints all turn about z, one after the other along x; or None.

    Args:
        rotation: Of each joint's frame in its predecessor's at q = 0, (n, 3, 3) or (n, 9).
        offsets: Of each joint's frame in its predecessor's, and of the tip's in the last, (n + 1, 3) [m].
        prismatic: Which joints slide, (n,).
    """
    lengths = offsets[1:, 0]
    straight = np.allclose(np.reshape(rotation, (-1, 3, 3)), np.eye(3)) and np.allclose(offsets[1:, 1:], 0.0)
    return lengths if straight and not np.any(prismatic) and (lengths > 0.0).all() else None
