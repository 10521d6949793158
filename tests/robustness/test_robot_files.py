"""Robot files that nobody would write on purpose, and some that somebody would."""

from pathlib import Path

import pytest

from ftqp.core.errors import FtqpError, InputError
from ftqp.model.robot import Robot

BOMB = """<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa">
<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]>
<robot name="&c;"><link name="base"/></robot>"""

FILES = [
    (b"", "is not well-formed XML"),
    (b" \n\t ", "is not well-formed XML"),
    (b"\x00\x01\x02\x03", "is not well-formed XML"),
    (b"\xff\xfe<\x00r\x00o\x00b\x00o\x00t\x00", "is not text in UTF-8"),
    (bytes(range(256)), "is not text in UTF-8"),
    (b"hello", "is not well-formed XML"),
    (b"<robot>", "is not well-formed XML"),
    (b"<robot></robt>", "is not well-formed XML"),
    (b"<robot>&x;</robot>", "is not well-formed XML"),
    (b"{'robot': 1}", "is not well-formed XML"),
    (b"<mujoco/>", "expected <robot>; such a file is read by ftqp.Robot.from_mjcf"),
    (b"<html><body/></html>", "has the root element <html>, expected <robot>"),
    (BOMB.encode(), "declares a document type or an entity, which no URDF needs"),
    (b'<!DOCTYPE robot SYSTEM "file:///etc/passwd"><robot/>', "declares a document type or an entity"),
    (
        b'<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="a"/></robot>',
        "is a xacro that was not expanded",
    ),
    (b'<robot name="r"><link name="${prefix}base"/></robot>', "is a xacro that was not expanded"),
]


@pytest.mark.parametrize(("content", "message"), FILES)
def test_file_that_is_no_urdf_is_one_clear_sentence(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "robot.urdf"
    path.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        Robot.from_urdf(path)
    assert "\n" not in str(caught.value)
    assert "robot.urdf" in str(caught.value)


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


@pytest.mark.parametrize(
    "text",
    [
        "<mujoco><worldbody><body/></worldbody></mujoco>",
        "<mujoco><include file='nothere.xml'/><worldbody/></mujoco>",
        "<mujoco><worldbody><body name='b'><freejoint/><geom size='.1'/></body></worldbody></mujoco>",
        "<mujoco><worldbody><body name='b'><joint/><joint/><geom size='.1'/></body></worldbody></mujoco>",
        "<mujoco><asset><mesh name='m' file='no.stl'/></asset><worldbody><body name='b'><joint name='j'/>"
        "<inertial pos='0 0 0' mass='-1' diaginertia='1 1 1'/></body></worldbody></mujoco>",
    ],
)
def test_mjcf_that_is_no_arm_is_refused(text: str) -> None:
    with pytest.raises(FtqpError):
        Robot.from_mjcf(text)


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
