"""Files of arms and scenarios with other words, numbers and lines are read or refused in a sentence."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from ftqp.app.campaign.episode_study import load_campaign
from ftqp.app.commands.cli import app
from ftqp.app.commands.mapping import load_study
from ftqp.app.scenario.setup import load
from ftqp.core.errors import FtqpError, InputError
from ftqp.faults.calibration import Calibration
from ftqp.model.robot import Robot
from ftqp.qp import QP, solve
from ftqp.sim.number_files import recorded_motion, waypoint_table

SCENARIO = load("planar3-line").toml
CAMPAIGN = """
[campaign]
episodes = 3
[scenario]
robot = { name = "planar" }
path = { kind = "circle", radius = 0.05, duration = 0.4 }
[vary]
"path.radius" = { uniform = [0.01, 0.1] }
"planner.level" = { one_of = ["velocity", "acceleration"], weights = [1, 2] }
"start.q" = { start = 0.1 }
"""
STUDY = """
[robot]
name = "planar"
[map]
goal = [1.0, 0.5]
grid = 8
configurations = 4
steps = 5
"""
PROFILE = 'name = "daqp"\ntolerance = 1e-9\nmax_iterations = 500\n'
WAYPOINTS = "t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0.01,0,0,0,0,0,1\n2,0.02,0.01,0,0,0,0,1\n"
MOTION = "t,track,x,y,z,rx,ry,rz\n0,0,0,0,0,0,0,0\n1,0.1,0,0,0,0,0,0.1\n2,0,0,0,0,0,0,0\n"
CALIBRATION = json.dumps(
    {
        "format": 1, "joints": ["a", "b"], "drive": "position", "dt": 1e-3, "bandwidths": [5.0, 50.0],
        "delay": 0, "room": [[1.0, 1.0]] * 9, "sigma": 1e-4, "quantum": 0.0, "coulomb": [0.0, 0.0],
        "viscous": [0.0, 0.0], "hours": 1.0, "rate": 0.1, "alarms": 0, "rate_low": 0.0, "rate_high": 3.0,
        "extrapolated": False,
    },
    indent=1,
)  # fmt: skip
SMALL = QP(np.eye(2), np.array([-1.0, 2.0]), lb=np.zeros(2), ub=np.ones(2))


def run_four_ticks(file):
    setup = load(str(file))
    replace(setup, duration=4 * setup.planner.dt).simulation().run()


KINDS = {
    "scenario.toml": (SCENARIO, run_four_ticks),
    "campaign.toml": (CAMPAIGN, lambda file: [load_campaign(str(file)).setup(k) for k in range(2)]),
    "study.toml": (STUDY, lambda file: load_study(str(file))),
    "profile.toml": (PROFILE, lambda file: solve(SMALL, file)),
    "way.csv": (WAYPOINTS, waypoint_table),
    "motion.csv": (MOTION, lambda file: recorded_motion(file, ("track", "x", "y", "z", "rx", "ry", "rz"))),
    "calibration.json": (CALIBRATION, Calibration.load),
}
"""Of each kind of file a right one, and what a user does with it."""
TOKEN = re.compile(r"[-+\w.]+|[^\s\w]")
WORDS = (
    "nan", "inf", "-inf", "1e308", "-1e308", "1e999", "5e-324", "0", "-1", "1e-9", "2147483648", "9" * 400,
    "true", '"a"', '""', "[]", "{}", "[1.0]", "[[", "]", "=", ",", "\uff11", "1_000", "0x10", "\x1b[31m",
    "\0", "x" * 300, "2026-01-01", "planar", "velocity", "",
)  # fmt: skip


@st.composite
def changed(draw):
    """A kind of file, and its text with one to three words exchanged, or lines left out or repeated."""
    name = draw(st.sampled_from(sorted(KINDS)))
    lines = KINDS[name][0].splitlines()
    for _ in range(draw(st.integers(1, 3))):
        k = draw(st.integers(0, len(lines) - 1))
        tokens = list(TOKEN.finditer(lines[k]))
        if tokens and draw(st.integers(0, 9)) < 8:
            found = draw(st.sampled_from(tokens))
            lines[k] = lines[k][: found.start()] + draw(st.sampled_from(WORDS)) + lines[k][found.end() :]
        else:
            lines[k : k + 1] = draw(st.sampled_from([[""], [lines[k]] * 2]))
    return name, "\n".join(lines)


def use(drawn, folder):
    """Use the file, or see it refused in words without control characters; it stays as it is."""
    name, text = drawn
    file = folder / name
    file.write_text(text, encoding="utf-8")
    try:
        KINDS[name][1](file)
    except FtqpError as error:
        said = str(error)
        assert 10 < len(said) < 5000 and said.replace("\n", "").isprintable(), said
    assert file.read_text(encoding="utf-8") == text


FEW = settings(
    max_examples=80, deadline=None, derandomize=True, phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)  # fmt: skip


@pytest.mark.parametrize("name", sorted(KINDS))
def test_right_file_is_used(name, tmp_path):
    (tmp_path / name).write_text(KINDS[name][0], encoding="utf-8")
    KINDS[name][1](tmp_path / name)


@FEW
@given(changed())
def test_changed_file_is_used_or_refused_in_a_sentence(tmp_path_factory, drawn):
    use(drawn, tmp_path_factory.getbasetemp())


@pytest.mark.slow
@settings(FEW, max_examples=5000, derandomize=False)
@given(changed())
def test_many_changed_files_are_used_or_refused_in_a_sentence(tmp_path_factory, drawn):
    use(drawn, tmp_path_factory.getbasetemp())


BOMB = """<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa">
<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]>
<robot name="&c;"><link name="base"/></robot>"""


def test_missing_file_folder_and_wrong_types_are_named(tmp_path):
    with pytest.raises(InputError, match=r"^URDF 'nowhere.urdf' does not exist; expected a file or XML text"):
        Robot.from_urdf("nowhere.urdf")
    with pytest.raises(InputError, match="is a folder, expected a file"):
        Robot.from_urdf(tmp_path)
    for source in (None, 3, b"<robot/>", ["a"]):
        with pytest.raises(InputError, match="a URDF is given by its path or as XML text, got"):
            Robot.from_urdf(source)
    for source in ("a\0b", "x" * 5000, ""):
        with pytest.raises(InputError):
            Robot.from_urdf(source)


def test_bomb_in_a_text_is_refused():
    with pytest.raises(InputError, match="declares a document type or an entity"):
        Robot.from_urdf(BOMB)
    with pytest.raises(InputError, match="declares a document type or an entity"):
        Robot.from_mjcf(BOMB.replace("robot", "mujoco"))


def test_mjcf_in_several_files_is_read_with_all_of_them(tmp_path):
    pytest.importorskip("mujoco")
    path = tmp_path / "arm.xml"
    path.write_text(
        '<mujoco><include file="limits.xml"/><worldbody><body name="a"><joint name="j" axis="0 0 1"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>'
    )
    with pytest.raises(InputError, match=r"'limits.xml' .*; put that file where the MJCF looks for it$"):
        Robot.from_mjcf(path)
    limits = tmp_path / "limits.xml"
    limits.write_text(
        '<mujocoinclude><compiler angle="radian"/><default><joint range="-1.5 1.5"/></default>'
        "</mujocoinclude>"
    )
    robot = Robot.from_mjcf(path)
    assert (robot.limits.q_min, robot.limits.q_max) == (-1.5, 1.5)


GOOD = """
[robot]
name = "panda"

[path]
kind = "line"
displacement = [0.05, 0.0, 0.0]
duration = 1.0
"""


@pytest.fixture
def refused(tmp_path):
    """Runs a scenario that must be refused; returns what is said."""

    def run(source, *overrides):
        out = tmp_path / "out"
        before = sorted(tmp_path.rglob("*"))
        arguments = ["run", str(source), "--out", str(out)]
        for override in overrides:
            arguments += ["--set", override]
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code == 2, (result.exit_code, result.output, result.exception)
        assert result.stdout == ""
        assert sorted(tmp_path.rglob("*")) == before
        assert "Traceback" not in result.stderr
        assert "pydantic" not in result.stderr
        return str(result.stderr)

    return run


@pytest.fixture
def good(tmp_path):
    """A scenario that can be run."""
    file = tmp_path / "good.toml"
    file.write_text(GOOD, encoding="utf-8")
    return file


def test_missing_file_names_the_nearest_file(refused, good):
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
def test_one_fault_gives_one_clear_sentence(refused, good, override, sentence):
    assert sentence in refused(good, override)


def test_start_outside_its_limits_names_every_joint_and_its_limit(refused, good):
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
def test_fault_that_the_arm_cannot_have_is_refused(refused, good, robot, fault, said):
    good.write_text(GOOD.replace("panda", robot) + f"\n[[faults]]\n{fault}\nat = 0.5\n")
    assert said in refused(good)
