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

ARM = """
<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="tool"><inertial><mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="first" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="{lower}" upper="{upper}" velocity="{velocity}" effort="10"/></joint>
  <joint name="second" type="revolute"><parent link="upper"/><child link="tool"/><origin xyz="1 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="10"/></joint>
</robot>
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
    ("source", "said"),
    [
        ("panda_circle", "neither a file nor a bundled scenario (did you mean 'panda-circle'?)"),
        ("runs/none", "runs/none is neither a file nor a bundled scenario"),
        ("", "is a folder, expected a scenario file"),
        ("/dev/null", "is not a regular file"),
        ("a\0b", "cannot be read"),
        ("x" * 10_000, "cannot be read"),
    ],
)
def test_what_is_no_file_is_refused(refused: Callable[..., str], source: str, said: str) -> None:
    assert said in refused(source)


FILES = {
    "picture": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "is not a text file (byte 0 is not UTF-8)"),
    "wide": (GOOD.encode("utf-16"), "is not a text file"),
    "large": (bytes(50_000_000), "has 50.0 MB, expected a scenario of at most 1 MB"),
    "broken": (b"[robot]\nname = \n", "line 2"),
    "arrays": (b"a = " + b"[" * 400_000, "nested too deeply"),
    "inline tables": (b"a = " + b"{a=" * 200_000, "nested too deeply"),
    "dotted key": (b"a" + b".a" * 300_000 + b" = 1", "a key of more than 500 parts in line 1"),
    "dotted table": (b"[" + b"a." * 300_000 + b"a]", "a key of more than 500 parts in line 1"),
    "empty": (b"", "path is missing"),
}


@pytest.mark.parametrize("name", FILES)
def test_file_that_is_no_scenario_is_refused(refused: Callable[..., str], tmp_path: Path, name: str) -> None:
    content, sentence = FILES[name]
    (tmp_path / "file.toml").write_bytes(content)
    said = refused(tmp_path / "file.toml")
    assert sentence in said and len(said) < 1000


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        ("planner.dtt=1", "planner.dtt is not a key of [planner] (did you mean 'dt'?)"),
        ("plannr.dt=1", "plannr is not a key of a scenario (did you mean 'planner'?)"),
        ("planner.dt=0", "planner.dt is 0, expected a number greater than 0 [s]"),
        ("planner.dt=-0.001", "planner.dt is -0.001, expected a number greater than 0 [s]"),
        ("planner.dt=nan", "planner.dt is nan, expected a finite number [s]"),
        ("planner.dt=10.0", "planner.dt is 10.0, expected a number at most 1 [s]"),
        ("path.duration=inf", "path.duration is inf, expected a finite number [s]"),
        ("path.duration=0", "path.duration is 0, expected a number greater than 0 [s]"),
        ("path.displacement=[1.0]", "path.displacement has 1 entries, expected at least 3 [m]"),
        ("path.displacement=[0.0, 0.0, 0.0]", "path: displacement of the line is zero"),
        ("path.law=quintik", "'quintik' is not a law of motion"),
        ("path.kind=lines", "path has kind 'lines', expected one of line"),
        ("robot.name=pandas", "'pandas' is not a robot of the catalog (did you mean 'panda'?)"),
        ("robot.tip=hand", "robot: name does not go with tip"),
        ("planner.scheme=mvm", "'mvm' is not a scheme (did you mean 'mvn'?)"),
        ("planner.scheme={name='dlsm', alfa=1}", "'alfa' is not a parameter of scheme 'dlsm'"),
        ("planner.scheme={name='dlsm', alpha=2.0}", "alpha is 2, expected a share in [0, 1)"),
        ("planner.backend=proxpq", "'proxpq' is not a backend of ftqp (did you mean 'proxqp'?)"),
        ("planner.backend=qpsolvers:gurobbi", "gurobbi"),
        ("planner.backend={name='osqp', tolerence=1e-9}", "(did you mean 'tolerance'?)"),
        ("planner.profile=nowhere.toml", "nowhere.toml cannot be read"),
        ("planner.bounds=viabilty", "'viabilty' is not a bound conversion (did you mean 'viability'?)"),
        ("planner.task.rows=['x', 'w']", "task row 'w' is unknown"),
        ("planner.task.kv=5000.0", "the feedback is unstable"),
        ("planner.posture=[0.0]", "posture has shape (1,), expected (nv,) = (7,)"),
        ("start.q=[0.0, 0.1]", "start: q has shape (2,), expected (nv,) = (7,)"),
        ("start.v=[0.0, 0.1]", "start: v has shape (2,), expected (nv,) = (7,)"),
        ("start.q=[0, 0, 0, 0, 0, 0, nan]", "start.q[6] is nan, expected a finite number [rad or m]"),
        ("start.q=[[0.0]]", "start.q[0] is [0.0], expected a number"),
        ("robot.limits.v_max=nan", "robot.limits.v_max[0] is nan, expected a number (inf for no limit)"),
        ("robot.limits.v_max=[1.0, 2.0]", "v_max has shape (2,), expected (nv,) = (7,)"),
        ("robot.limits.v_max=0.0", "panda_joint1"),
        ("robot.limits.a_max=-1.0", "panda_joint1"),
        ("simulation.duration=1e-9", "expected at least one step"),
        ("robot.limits.a_max=inf", "acceleration"),
        ("start.v=[0, 0, -5.0, 0, 0, 0, 0]", "panda_joint3 starts with the speed -5, beyond its limit 2.175"),
        ("path.displacement=[3.0, 0.0, 0.0]", "out of reach: the stretched arm is"),
        ("path={kind='circle', radius=0.1, duration=1.0, turns=1e300}", "path.turns is 1e+300, expected a"),
        ("simulation.plant=real", "simulation.plant is 'real', expected one of kinematic, servo"),
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


def urdf_scenario(folder: Path, text: str, tip: str = "tool") -> Path:
    """A scenario with a URDF beside it."""
    (folder / "arm.urdf").write_text(text)
    file = folder / "urdf.toml"
    file.write_text(
        f'[robot]\nurdf = "arm.urdf"\ntip = "{tip}"\nacceleration = 2.0\n[planner.task]\nrows = ["x", "y"]\n'
        '[path]\nkind = "line"\ndisplacement = [-0.01, 0.01, 0.0]\nduration = 0.1\n'
    )
    return file


def test_urdf_beside_the_scenario_is_found(tmp_path: Path) -> None:
    file = urdf_scenario(tmp_path, ARM.format(lower=-1, upper=1, velocity=1))
    result = CliRunner().invoke(app, ["check", str(file), "--set", "start.q=[0.3, 0.5]"])
    assert result.exit_code == 0, result.output


def test_all_errors_are_told_at_once(refused: Callable[..., str], good: Path) -> None:
    said = refused(
        good,
        "robot.name=pandas",
        "planner.scheme=mvm",
        "planner.backend=proxpq",
        "planner.bounds=viabilty",
        "planner.task.rows=['x', 'w']",
    )
    places = [line.strip(" -").partition(":")[0] for line in said.splitlines()[1:]]
    assert places == ["robot", "planner.scheme", "planner.task", "planner.bounds", "planner.backend"]
