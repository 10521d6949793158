"""Bedrossian 1993 with a path that waits, a task with slack, and one in two stages."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog
from tests.arm_at import arm_at
from tests.papers.bedrossian1993_scaling import (
    INCH,
    NO_LIMIT,
    Q1,
    Q2,
    ROLLS_TOO,
    STARTS,
    Run,
    follow,
    lock,
    planner,
)

import ftqp

LIMIT = 1.0 + 1e-9


@cache
def e3(start: str = "N", **settings: Any) -> Run:
    return follow(STARTS[start], **settings)


class TestExactScale:
    """Section 8: the largest s that the limits allow is a linear program."""

    POSTURE = np.deg2rad([0.0, -50.0, 0.0, -30.0, 0.0, 83.0, 0.0, 3.0, 0.0, 14.0, 0.0])

    def scale_and_oracle(self, limit: float) -> tuple[float, float]:
        arm = planner(limit)
        lock(arm, (2, 4, 7))
        path = ftqp.paths.Line(
            arm.robot.pose(self.POSTURE), [-100.0 * INCH, 0.0, 0.0], duration=20.0, law="constant"
        )
        follower = ftqp.PathFollower(arm, path)
        follower.reset(self.POSTURE)
        follower.step(self.POSTURE, np.zeros(11))
        free = [i for i in range(11) if i not in (1, 3, 6)]
        J = arm_at(arm.robot, self.POSTURE).J[:, free]
        top = np.deg2rad(limit)
        wanted = path.sample(0.0).twist[0]
        best = linprog(
            [0.0] * len(free) + [-1.0],
            A_eq=np.column_stack([J, -wanted]),
            b_eq=np.zeros(6),
            bounds=[(-top, top)] * len(free) + [(0.0, 1.0)],
            method="highs",
        )
        return follower.rate, float(best.x[-1])

    @pytest.mark.parametrize(("limit", "published"), [(20.0, 0.698770), (5.0, 0.174693)])
    def test_rate_at_the_reference_posture(self, limit: float, published: float) -> None:
        scale, best = self.scale_and_oracle(limit)
        assert best == pytest.approx(published, abs=1e-6)
        assert scale == pytest.approx(best, rel=1e-3)

    def test_full_rate_where_the_limits_allow_it(self) -> None:
        scale, best = self.scale_and_oracle(50.0)
        assert best == 1.0
        assert scale == pytest.approx(1.0, abs=1e-3)


class TestE1AndE2:
    def test_locked_joints_change_nothing_for_the_tool(self) -> None:
        free, locked = (follow(Q1, locks, (-110.0, -50.0, 30.0)) for locks in ((), (1, 6, 7)))
        for run, fastest in ((free, 10.19), (locked, 18.11)):
            assert run.progress == 1.0 and run.time < 20.1
            assert run.off_path < 0.006
            assert run.fastest == pytest.approx(fastest, abs=0.02)
        assert (locked.v[[0, 5, 6]] == 0.0).all()

    def test_healthy_arm_needs_no_scaling(self) -> None:
        run = follow(Q2, ())
        assert run.progress == 1.0 and run.fastest == pytest.approx(5.02, abs=0.01)
        assert run.rates[:-1].min() > 0.999  # the last step only closes the gap


class TestE3:
    def test_start_r_is_done_in_time_on_the_line(self) -> None:
        run = e3("R")
        assert 20.0 <= run.time <= 20.3
        assert run.off_path < 0.05 and run.turned < 0.05
        assert run.fastest <= 50.0 * LIMIT

    def test_start_n_is_done_with_the_default(self) -> None:
        run = e3("N")
        assert run.time < 21.0
        assert run.off_path < 0.05 and run.turned < 0.05
        assert run.fastest <= 50.0 * LIMIT

    @pytest.mark.parametrize(
        ("limit", "spec"), [(5.0, 44.9), (8.0, 29.9), (10.0, 25.6), (20.0, 21.1), (50.0, 20.3), (100.0, 20.4)]
    )
    def test_other_limits_are_exact_and_no_slower_than_the_spec(self, limit: float, spec: float) -> None:
        run = e3("N", limit=limit)
        assert run.progress == 1.0 and run.time <= spec + 0.1
        assert run.off_path <= 0.10 and run.fastest <= limit * LIMIT

    @pytest.mark.parametrize("rate_change", [2000.0, 1000.0, 500.0, 250.0])
    def test_rate_change_limits(self, rate_change: float) -> None:
        run = e3("N", rate_change=rate_change)
        assert 20.1 <= run.time <= 20.5 and run.off_path <= 0.07

    @pytest.mark.parametrize("start", ["N", "R"])
    def test_acceleration_level(self, start: str) -> None:
        run = e3(start, level="acceleration", rate_change=250.0)
        assert run.progress == 1.0 and run.time < 21.5
        assert run.off_path < 0.06 and run.fastest <= 50.0 * LIMIT


@cache
def blocked(rate_change: float = NO_LIMIT, level: str = "velocity") -> Run:
    return follow(Q2, ROLLS_TOO, longest=12.0, rate_change=rate_change, level=level)


class TestBlocked:
    """The path really ends after 11.6 in: three pitch joints, stretched out."""

    @pytest.mark.parametrize(
        ("rate_change", "level", "off"),
        [(NO_LIMIT, "velocity", 0.09), (250.0, "velocity", 0.15), (250.0, "acceleration", 0.15)],
    )
    def test_blocked_where_the_path_ends(self, rate_change: float, level: str, off: float) -> None:
        run = blocked(rate_change, level)
        assert run.progress == pytest.approx(0.116, abs=0.002)
        assert run.blocked_at is not None and run.blocked_at < 7.0
        assert run.follower.status is ftqp.PathStatus.BLOCKED
        assert run.off_path < off and run.fastest <= 50.0 * LIMIT

    def test_arm_rests_once_its_path_is_blocked(self) -> None:
        assert np.rad2deg(np.abs(blocked(250.0).v)).max() < 1.0

    def test_verdict_names_the_direction_and_the_joints(self) -> None:
        verdict = blocked().follower.blocked
        assert verdict is not None
        assert "cannot go on along -x" in verdict and "2.3 s of 20 s" in verdict
        assert "j2 (locked)" in verdict and "j6" not in verdict
