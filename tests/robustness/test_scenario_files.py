"""Scenario files that cannot be used: one clear sentence a fault, exit code 2, nothing half-written."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from ftqp.app.commands.cli import app

GOOD = """
[robot]
name = "panda"

[path]
kind = "line"
displacement = [0.05, 0.0, 0.0]
duration = 1.0
"""


@pytest.fixture
def refused(tmp_path: Path) -> Callable[..., str]:
    """Runs a scenario that must be refused; returns what is said."""

    def run(source: str | Path, *overrides: str) -> str:
        out = tmp_path / "out"
        before = sorted(tmp_path.rglob("*"))
        arguments = ["run", str(source), "--out", str(out)]
        for override in overrides:
            arguments += ["--set", override]
        result: Any = CliRunner().invoke(app, arguments)
        assert result.exit_code == 2, (result.exit_code, result.output, result.exception)
        assert result.stdout == ""
        assert sorted(tmp_path.rglob("*")) == before
        assert "Traceback" not in result.stderr
        assert "pydantic" not in result.stderr
        return str(result.stderr)

    return run


@pytest.fixture
def good(tmp_path: Path) -> Path:
    """A scenario that can be run."""
    file = tmp_path / "good.toml"
    file.write_text(GOOD, encoding="utf-8")
    return file


def test_missing_file_names_the_nearest_file(refused: Callable[..., str], good: Path) -> None:
    assert f"did you mean '{good}'?" in refused(good.with_name("goood.toml"))


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        ("planner.dtt=1", "planner.dtt is not a key of [planner] (did you mean 'dt'?)"),
        ("planner.dt=0", "planner.dt is 0, expected a number greater than 0 [s]"),
        ("planner.dt=nan", "planner.dt is nan, expected a finite number [s]"),
        ("path.displacement=[0.0, 0.0, 0.0]", "path: displacement of the line is zero"),
        ("robot.tip=hand", "robot: name does not go with tip"),
        ("planner.scheme={name='dlsm', alpha=2.0}", "alpha is 2, expected a share in [0, 1)"),
        ("planner.backend=qpsolvers:gurobbi", "gurobbi"),
        ("planner.profile=nowhere.toml", "nowhere.toml cannot be read"),
        ("planner.task.rows=['x', 'w']", "task row 'w' is unknown"),
        ("planner.task.kv=5000.0", "the feedback is unstable"),
        ("planner.posture=[0.0]", "posture has shape (1,), expected (nv,) = (7,)"),
        ("robot.limits.v_max=0.0", "panda_joint1"),
        ("robot.limits.a_max=-1.0", "panda_joint1"),
        ("start.v=[0, 0, -5.0, 0, 0, 0, 0]", "panda_joint3 starts with the speed -5, beyond its limit 2.175"),
        ("path.displacement=[3.0, 0.0, 0.0]", "out of reach: the stretched arm is"),
        ("path={kind='circle', radius=0.1, duration=1.0, turns=1e300}", "path.turns is 1e+300, expected a"),
    ],
)
def test_one_fault_gives_one_clear_sentence(
    refused: Callable[..., str], good: Path, override: str, sentence: str
) -> None:
    assert sentence in refused(good, override)


def test_start_outside_its_limits_names_every_joint_and_its_limit(
    refused: Callable[..., str], good: Path
) -> None:
    said = refused(good, "start.q=[0.0, -0.785, 0.0, 0.5, 0.0, 1.571, 9.0]")
    assert "start: panda_joint4 starts at 0.5, above its limit -0.0698" in said
    assert "panda_joint7 starts at 9, above its limit 2.897" in said
    assert refused(good, "robot.limits.q_min=1.0", "robot.limits.q_max=-1.0").count("q_min") == 7


@pytest.mark.parametrize(
    ("robot", "fault", "said"),
    [
        ("panda", 'kind = "locked"\njoint = "panda_joint8"', "'panda_joint8' is not a joint of panda"),
        ("panda", 'kind = "locked"\njoint = 7', "faults[0]"),
        ("panda", 'kind = "locked"\njoint = -1', "faults[0]"),
        ("srs7", 'kind = "free_swinging"\njoint = 0', "faults[0]: srs7 has no inertia"),
        ("panda", 'kind = "degraded"\njoint = 0\nq_min = 3.0', "the range left of panda_joint1 is empty"),
    ],
)
def test_fault_that_the_arm_cannot_have_is_refused(
    refused: Callable[..., str], good: Path, robot: str, fault: str, said: str
) -> None:
    good.write_text(GOOD.replace("panda", robot) + f"\n[[faults]]\n{fault}\nat = 0.5\n")
    assert said in refused(good)
