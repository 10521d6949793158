"""Robot files that nobody would write on purpose, and some that somebody would."""

from pathlib import Path

import pytest

from ftqp.core.errors import InputError
from ftqp.model.robot import Robot

BOMB = """<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa">
<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]>
<robot name="&c;"><link name="base"/></robot>"""


def test_missing_file_folder_and_wrong_types_are_named(tmp_path: Path) -> None:
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


def test_bomb_in_a_text_is_refused() -> None:
    with pytest.raises(InputError, match="declares a document type or an entity"):
        Robot.from_urdf(BOMB)
    with pytest.raises(InputError, match="declares a document type or an entity"):
        Robot.from_mjcf(BOMB.replace("robot", "mujoco"))


def test_mjcf_in_several_files_is_read_with_all_of_them(tmp_path: Path) -> None:
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
