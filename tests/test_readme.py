"""What README shows runs as it stands."""

import contextlib
import io
import re
from pathlib import Path

import ftqp
from ftqp.app.output.console import ExitCode
from ftqp.control.task import schemes
from ftqp.faults.kinds import KINDS

README = (Path(__file__).parents[1] / "README.md").read_text()
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


def test_the_twenty_lines_see_a_joint_fail_and_the_arm_go_on(tmp_path, monkeypatch):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.S)
    (tmp_path / "arm.urdf").write_text(seven_joints())
    monkeypatch.chdir(tmp_path)
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(compile(code, "README.md", "exec"), {})
    last = said.getvalue().splitlines()[-1]
    error = re.fullmatch(r"off the path by (\S+) m; the failed joint moves at 0.0 rad/s", last)
    assert error is not None and float(error[1]) < 1e-4, said.getvalue()


def test_every_file_that_is_linked_exists():
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (Path(__file__).parents[1] / target).exists(), target


def first_column(title):
    """The code words in the first column of the table of a section."""
    section = README.split(f"\n## {title}\n")[1].split("\n## ")[0]
    cells = re.findall(r"^\| (`[^|]*`.*?) \|", section, re.M)
    return [word for cell in cells for word in re.findall(r"`(\w+)", cell)]


def test_the_table_of_statuses_has_every_status_once():
    assert sorted(first_column("What a step gives back")) == sorted(ftqp.StepStatus.__members__)


def test_the_table_of_faults_has_every_fault_once():
    assert sorted(first_column("Faults")) == sorted(kind.__name__ for kind in KINDS.values())


def test_the_table_of_schemes_has_every_criterion_once():
    criteria = set(schemes.names()) - set(schemes.closed_forms())
    assert sorted(first_column("Schemes")) == sorted(criteria)


def test_every_closed_form_is_named():
    section = README.split("\n## Schemes\n")[1].split("\n## ")[0]
    assert all(f"`{name}`" in section for name in schemes.closed_forms())


def test_every_exit_code_is_in_the_table():
    (cells,) = re.findall(r"\| exit code \|.*\n\|-.*\n((?:\|.*\n)+)", README)
    codes = [int(code) for cell in re.findall(r"^\| ([\d, ]+) \|", cells, re.M) for code in cell.split(",")]
    assert codes == [int(code) for code in ExitCode]
