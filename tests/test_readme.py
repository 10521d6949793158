"""What README and the pages for a beginner show runs as it stands, and their tables name everything once."""

import contextlib
import io
import re
import tomllib
from pathlib import Path

import pytest

import ftqp
from ftqp.app.commands.cli import app
from ftqp.control.task import schemes
from ftqp.control.task.task import MODES
from ftqp.faults.kinds import KINDS

ROOT = Path(__file__).parents[1]
LINK = (
    '<link name="l{}"><inertial><mass value="1"/>'
    '<inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="j{0}" type="revolute"><parent link="l{1}"/><child link="l{0}"/><origin xyz="0 0 .2"/>'
    '<axis xyz="{2}"/><limit lower="{3}" upper="{4}" velocity="2" effort="80"/></joint>'
)
RANGES = ((-2.5, 2.5), (-0.5, 1.5), (-2.5, 2.5), (0.2, 2.2), (-2.5, 2.5), (0.0, 2.0), (-2.5, 2.5))
TIP = '<joint name="end" type="fixed"><parent link="l7"/><child link="tool0"/><origin xyz="0 0 .1"/></joint>'


def seven_joints() -> str:
    """A URDF of a seven-joint arm whose neutral configuration is far from singular."""
    links = "".join(LINK.format(i) for i in range(8))
    joints = "".join(
        JOINT.format(i + 1, i, "0 1 0" if i % 2 else "0 0 1", low, high)
        for i, (low, high) in enumerate(RANGES)
    )
    return f'<robot name="seven">{links}{joints}<link name="tool0"/>{TIP}</robot>'


def a_model_of_mujoco(integrator: str = "implicitfast") -> str:
    """The same kind of arm as an MJCF, with a position actuator for each joint."""
    bodies = "".join(
        f'<body name="l{i}" pos="0 0 .2"><joint name="j{i}" axis="{axis}" range="-2.8 2.8" armature=".05"/>'
        '<geom type="capsule" fromto="0 0 0 0 0 .2" size=".03" mass="1.5" contype="0" conaffinity="0"/>'
        for i, axis in enumerate(("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1"), 1)
    )
    motors = "".join(
        f'<position joint="j{i}" kp="4000" kv="120" forcerange="-200 200"/>' for i in range(1, 8)
    )
    return (
        '<mujoco><compiler angle="radian" autolimits="true"/>'
        f'<option timestep=".001" integrator="{integrator}"/>'
        f'<worldbody>{bodies}<site name="tool" pos="0 0 .1"/>{"</body>" * 7}</worldbody>'
        f"<actuator>{motors}</actuator></mujoco>"
    )


@pytest.fixture
def shown(tmp_path, monkeypatch):
    """Runs the Python of a text, piece after piece, beside a URDF; the lines that it prints."""

    def run(name, integrator="implicitfast"):
        pieces = re.findall(r"```python\n(.*?)```", (ROOT / name).read_text(encoding="utf-8"), re.S)
        (tmp_path / "arm.urdf").write_text(seven_joints())
        (tmp_path / "arm.xml").write_text(a_model_of_mujoco(integrator))
        monkeypatch.chdir(tmp_path)
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            for code in pieces:
                exec(compile(code, name, "exec"), {})
        return said.getvalue().splitlines()

    return run


def test_the_lines_of_readme_see_a_joint_fail_and_the_arm_go_on(shown):
    (line,) = shown("README.md")
    error = re.fullmatch(r"(.*): (\S+) m off; the failed joint moves at 0.0 rad/s", line)
    assert error is not None and error[1] == ftqp.StepStatus.OK.value and float(error[2]) < 1e-4, line


def test_the_lines_for_a_beginner_say_what_happens(shown):
    *said, last = shown("docs/start.md")
    error = re.fullmatch(r"off the path by (\S+) m; the failed joint moves at 0.0 rad/s", last)
    assert error is not None and float(error[1]) < 1e-4, last
    assert said[0] == f"0.000 s: {ftqp.StepStatus.OK.value} "


@pytest.mark.parametrize("integrator", ["implicitfast", "implicit", "Euler", "RK4"])
def test_the_loop_in_mujoco_finds_the_brake_that_nobody_announced(shown, integrator):
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    (line,) = shown("docs/connect-your-robot.md", integrator)
    found = re.fullmatch(r"OK, at most (\S+) mm off; \{'j3': Locked\(joint='j3'.*", line)
    assert found is not None and 1.0 < float(found[1]) < 25.0, line


def test_the_two_functions_of_a_stranger_make_the_first_motion_and_follow(tmp_path, monkeypatch, capsys):
    """With an arm whose joints go a share of the way to what they are sent in each period."""
    monkeypatch.chdir(tmp_path)
    said: dict = {}
    exec(compile(pieces_of("connect-your-robot.md")[0], "connect-your-robot.md", "exec"), said)
    panda = ftqp.robots.load("panda")
    arm, periods = [panda.neutral.copy()], iter(range(7000))

    def send(command):
        arm[0] = arm[0] + 0.15 * (command - arm[0])
        next(periods)

    planner = said["begin"](panda, lambda: arm[0], send)
    assert (tmp_path / "arm.json").is_file() and "panda_joint7 lags by" in capsys.readouterr().out
    pose = panda.pose(panda.neutral)
    pose[:3, 3] += [0.0, 0.03, 0.0]
    with pytest.raises(StopIteration):
        said["follow"](planner, ftqp.Target(pose=pose), lambda: arm[0], send)
    assert abs(panda.pose(arm[0]) - pose).max() < 1e-4
    assert capsys.readouterr().out.splitlines()[-1].strip() == ftqp.StepStatus.OK.value


@pytest.mark.parametrize(
    ("page", "says"),
    [
        ("how-to/pick-and-place.md", [ftqp.GoToStatus.REACHED.value] * 6),
        ("how-to/gripper-and-tool.md", [r"Robot\('panda', .*", r"\[0\.10.* None"]),
        ("how-to/several-tasks.md",
         [r"\[.*\] \[.*\]", "OK True", r"1\.0", r"0\.000 mm off", r"StepStatus.OK .*"]),
        ("teleoperation.md", [ftqp.TargetStatus.STALE.value, f"{ftqp.PathStatus.DONE.value} "]),
        ("batches.md", []),
        ("mujoco-plant.md", [r"StepStatus.OK \{'panda_joint3': Locked.*"]),
        pytest.param("planning.md", [r".*\d"], marks=pytest.mark.slow),
        pytest.param("evidence/zhang2016.md", [".*coverage=0.8832.*", ".*coverage=1.0000.*", ".*"],
                     marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_the_lines_of_a_page_run_and_say_what_it_tells(shown, page, says):
    if page == "mujoco-plant.md":
        pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    lines = shown(f"docs/{page}")
    assert len(lines) == len(says)
    assert all(re.fullmatch(pattern, line) for pattern, line in zip(says, lines, strict=True)), lines


def test_the_lines_that_keep_points_behind_planes_print_what_the_page_says(capsys):
    page = (ROOT / "docs/how-to/obstacle.md").read_text("utf-8")
    scene, code = re.findall(r"```python\n(.*?)```", page, re.S)
    exec(compile(scene, "obstacle.md", "exec"), {})
    assert "RELAXED 0.020 m ('panda_hand', 'post')\nthe task misses" in capsys.readouterr().out
    said: dict = {}
    exec(compile(code, "obstacle.md", "exec"), said)
    assert "RELAXED 0.35 " in capsys.readouterr().out
    assert said["planner"].constraints["elbow off the wall"].distance > 0.0


def pieces_of(page):
    return re.findall(r"```python\n(.*?)```", (ROOT / "docs" / page).read_text("utf-8"), re.S)


def test_the_lines_of_a_goal_reach_it_another_way_and_go_a_way_out(capsys):
    said: dict = {}
    for code in pieces_of("how-to/go-to-a-goal.md"):
        exec(compile(code, "go-to-a-goal.md", "exec"), said)
    lines = capsys.readouterr().out.splitlines()
    assert any("the straight way cannot be gone" in line for line in lines)
    assert lines.count(ftqp.GoToStatus.REACHED.value) == 2 and any(
        line.startswith("clear - ") for line in lines
    )


def test_the_detectors_of_the_page_are_made_and_asked(monkeypatch):
    """With no calibration in the place of an hour's log."""
    panda = ftqp.robots.load("panda")
    monkeypatch.setattr(ftqp.Calibration, "load", staticmethod(lambda file: None))
    monkeypatch.setattr(ftqp.Detector, "calibrate", lambda self, log: self)
    q, target = panda.neutral, ftqp.Target(pose=panda.pose(panda.neutral))
    said = {"ftqp": ftqp, "robot": panda, "q": q, "v": None, "tau": None, "target": target, "log": None}
    for code in pieces_of("detection.md"):
        if "planner" in said:
            said["planner"].reset(q)
        exec(compile(code, "detection.md", "exec"), said)
    assert said["diagnosis"].isolated == {}


def test_the_logs_of_a_long_run_are_read_by_its_lines(tmp_path, monkeypatch):
    """Of a run of a second, whose last half stands for the minute at the end of a day."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs" / "day").mkdir(parents=True)
    panda = ftqp.robots.load("panda")
    path = ftqp.paths.Line(panda.pose(panda.neutral), displacement=(0.0, 0.05, 0.0), duration=1.0)
    ftqp.Simulation(ftqp.Planner(panda, 1e-3), path, q=panda.neutral, log="runs/day/log.npy").run()
    (code,) = pieces_of("real-time.md")
    said: dict = {}
    exec(compile(code.replace("86000.0", "0.5").replace("86060.0", "1.0"), "real-time.md", "exec"), said)
    assert len(said["log"]["t"]) > 100
    (code,) = pieces_of("command-line.md")
    exec(compile(code.replace("runs/circle", "runs/day"), "command-line.md", "exec"), said)
    assert said["log"]["q"].shape[1] == 7 and (tmp_path / "circle.csv").is_file()


def test_the_planner_of_every_choice_is_made():
    page = (ROOT / "docs/choosing.md").read_text("utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.S)
    said = {"ftqp": ftqp, "robot": ftqp.robots.load("panda")}
    exec(compile(code, "choosing.md", "exec"), said)
    assert said["planner"].task.mode == "scaled" and said["planner"].backend == "active_set"


def test_the_lines_of_several_tasks_leave_a_task_out(capsys):
    said: dict = {}
    exec(compile(pieces_of("how-to/several-tasks.md")[0], "several-tasks.md", "exec"), said)
    assert said["planner"].tasks["elbow"].weight == 0.0 and len(capsys.readouterr().out) > 10


def first_column(page, title=None):
    """The code words in the first column of the tables of a page, or of one of its sections."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    section = text if title is None else text.split(f"\n## {title}\n")[1].split("\n## ")[0]
    cells = re.findall(r"^\| (`[^|]*`.*?) \|", section, re.M)
    return [word for cell in cells for word in re.findall(r"`(\w+)", cell)]


def test_the_table_of_statuses_has_every_status_once():
    words = [word for word in first_column("troubleshooting.md") if word.isupper()]
    assert sorted(words) == sorted(ftqp.StepStatus.__members__)


def test_the_table_of_faults_has_every_fault_once():
    title = "What the planner does about each fault"
    assert sorted(first_column("failures.md", title)) == sorted(kind.__name__ for kind in KINDS.values())


def test_the_table_of_schemes_has_every_criterion_once():
    criteria = set(schemes.names()) - set(schemes.closed_forms())
    assert sorted(first_column("choosing.md", "Scheme")) == sorted(criteria)


def test_every_closed_form_is_named():
    text = (ROOT / "docs" / "choosing.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in text for name in schemes.closed_forms())


def test_the_tables_of_modes_and_bounds_name_each_of_them():
    text = (ROOT / "docs" / "choosing.md").read_text(encoding="utf-8")
    modes = re.findall(r"^\| [^|`]* \| `(\w+)`", text.split("## Task mode")[1].split("\n## ")[0], re.M)
    limits = re.findall(r"^\| [^|`]* \| `(\w+)`", text.split("## Bounds")[1].split("\n## ")[0], re.M)
    assert sorted(modes) == sorted(MODES)
    assert sorted(limits) == sorted(ftqp.bounds.names())


def test_the_table_of_backends_names_each_of_them():
    assert set(first_column("choosing.md", "Backend")) >= {
        name for name in ftqp.qp.backend_names() if not name.startswith("qpsolvers:")
    }


def test_the_table_of_extras_has_every_extra_once():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert sorted(first_column("start.md", "Install")) == sorted(extras["optional-dependencies"])


def test_every_command_is_shown_with_an_example():
    text = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8").split("\nA scenario is")[0]
    lines = re.findall(r"^    (ftqp .*?)(?:  |$)", text, re.M)
    assert len(lines) == len(set(lines)) > 15
    text = text.replace(" | ", "\n    ftqp ")
    shown = set(re.findall(r"^    ftqp (\w+)", text, re.M))
    assert shown == {one.name or one.callback.__name__ for one in app.registered_commands}
