"""What README shows runs as it stands."""

import contextlib
import io
import re
from pathlib import Path

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
