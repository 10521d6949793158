"""What the benchmark of others runs on, and what it writes."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from bench import cases
from bench.results import README, ROOT, folder
from bench.urdf import TIP, Arm, Array, text

import ftqp


@pytest.fixture(scope="module")
def path() -> cases.Path:
    """Targets of the chain."""

    def load(urdf: str, a_max: Array) -> Callable[[Array], Array]:
        return ftqp.Robot.from_urdf(urdf, tip=TIP, acceleration=a_max).pose

    return cases.path("chain30", cases.chain30(), load)


def test_targets_start_at_rest_where_the_robot_is(path: cases.Path) -> None:
    np.testing.assert_allclose(path.poses[0], path.pose(path.arm.neutral), atol=1e-12)
    np.testing.assert_allclose(path.twists[0], 0.0, atol=1e-9)


def test_twists_are_the_velocity_of_the_poses(path: cases.Path) -> None:
    k = 700
    ahead = path.poses[k, :3, :3] @ (
        np.eye(3) + _skew(path.poses[k, :3, :3].T @ path.twists[k, 3:]) * cases.DT
    )
    np.testing.assert_allclose(ahead, path.poses[k + 1, :3, :3], atol=1e-7)
    ahead = path.poses[k, :3, 3] + path.twists[k, :3] * cases.DT
    np.testing.assert_allclose(ahead, path.poses[k + 1, :3, 3], atol=1e-6)


def _skew(w: Array) -> Array:
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


SHOWN = {
    README: ("compare_accuracy",),
    ROOT / "docs/evidence/speed.md": ("bench_step", "bench_memory", "bench_first_use", "bench_batch"),
}


@pytest.mark.parametrize(("text", "name"), [(text, name) for text, names in SHOWN.items() for name in names])
def test_a_text_shows_the_tables_of_the_report_on_record(text: Path, name: str) -> None:
    """Every line of its part of the text is one of the report; so are date and command."""
    report = (folder(name) / f"{name}.md").read_text(encoding="utf-8")
    part = (
        text.read_text(encoding="utf-8").split(f"<!-- begin {name} -->")[1].split(f"<!-- end {name} -->")[0]
    )
    *lines, last = [line.lstrip("# ") for line in part.splitlines() if line]
    held = {line.lstrip("# ") for line in report.splitlines()}
    assert len(lines) > 4 and not [line for line in lines if line not in held]
    said = re.fullmatch(r"From \[(\S+)\]\((\S+)\), (\S+), .* Made by `(.*)`\.", last)
    assert said is not None and said[1] == f"{name}.md"
    assert (text.parent / said[2]).resolve() == folder(name) / f"{name}.md"
    assert said[3] in report and f"    {said[4]}" in report.splitlines()


@pytest.mark.parametrize("name", ["panda", "iiwa14"])
def test_a_catalog_robot_survives_the_text(name: str) -> None:
    robot = ftqp.robots.load(name)
    arm = Arm.of(robot)
    again = ftqp.Robot.from_urdf(text(name, arm), tip=TIP, acceleration=arm.a_max)
    rng = np.random.default_rng(1)
    q = rng.uniform(robot.limits.q_min, robot.limits.q_max)
    v = rng.normal(size=robot.nv)
    np.testing.assert_allclose(again.pose(q), robot.pose(q), atol=1e-12)
    torques = [pin.rnea(r.model, r.model.createData(), q, v, v) for r in (robot, again)]
    np.testing.assert_allclose(torques[1], torques[0], atol=1e-9)
    for limit in ("q_min", "q_max", "v_max", "a_max", "tau_max"):
        np.testing.assert_array_equal(getattr(again.limits, limit), getattr(robot.limits, limit))
