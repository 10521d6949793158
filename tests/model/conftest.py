"""Robots that several tests of the model need, written here so that no file is needed."""

from collections.abc import Callable

import pytest

INERTIAL = (
    '<inertial><origin xyz="0.01 0 {com}"/><mass value="{mass}"/>'
    '<inertia ixx="{ixx}" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.015"/></inertial>'
)


@pytest.fixture
def two_joints() -> Callable[..., str]:
    """A URDF of two joints; keywords replace figures of joint ``a`` or of its link, or add elements."""

    def text(
        *,
        axis: str = "0 0 1",
        limit: str = 'lower="-1" upper="2" velocity="1.5" effort="20"',
        kind: str = "revolute",
        mass: str = "2",
        ixx: str = "0.02",
        joint: str = "",
        more: str = "",
        origin: str = "0 0 0.3",
    ) -> str:
        body = INERTIAL.format(com="0.1", mass=mass, ixx=ixx)
        other = INERTIAL.format(com="0.1", mass="1", ixx="0.02")
        limits = f"<limit {limit}/>" if limit else ""
        return f"""<robot name="two"><link name="base"/>
        <link name="one">{body}</link><link name="two">{other}</link>
        <joint name="a" type="{kind}"><origin xyz="{origin}"/><parent link="base"/><child link="one"/>
        <axis xyz="{axis}"/>{limits}{joint}</joint>
        <joint name="b" type="revolute"><origin xyz="0.1 0 0.4" rpy="0.3 0 0"/><parent link="one"/>
        <child link="two"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="2" effort="10"/></joint>
        {more}</robot>"""

    return text
