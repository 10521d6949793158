"""The URDFs of the extra ``robots``: each loads in one line with its tips, or says why it does not."""

import sys
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import pytest

from ftqp.core.errors import FtqpError
from ftqp.model.robot import Robot

ROBOT_DATA = next(Path(sys.prefix).glob("**/share/example-robot-data/robots"), None)
pytestmark = pytest.mark.skipif(
    ROBOT_DATA is None, reason="example-robot-data is not installed: pip install -e '.[robots]'"
)
MOVING = ("revolute", "continuous", "prismatic")
NO_ARM = "no joint that moves|there are no links"
ZERO = "cannot move: both limits are 0", "position limit that is missing", "zero velocity limit"
"""What files hold that is refused: no joints, nothing at all, or limits that are zero or missing."""
PARTLY = "joints move; expected 1 to", "mimics", "not positive definite", "negative principal moment"
"""Other reasons why not all ends of a file can be tips at once."""


def ends(file: Path) -> list[str]:
    """Links at the end of a file's tree that a joint moves."""
    joints = ElementTree.parse(file).getroot().findall("joint")
    above = {joint.find("child").get("link"): joint for joint in joints}
    inner = {joint.find("parent").get("link") for joint in joints}

    def moves(link: str) -> bool:
        joint = above.get(link)
        return joint is not None and (joint.get("type") in MOVING or moves(joint.find("parent").get("link")))

    return [link for link in above if link not in inner and moves(link)]


def loaded(file: Path, tips: list[str]) -> tuple[Robot | None, str]:
    try:
        return Robot.from_urdf(file, tips=tips), ""
    except FtqpError as error:
        return None, str(error)


@pytest.mark.slow
def test_all_but_eight_load_in_one_line_and_the_others_say_why_not() -> None:
    assert ROBOT_DATA is not None
    found: Counter[str] = Counter()
    for file in sorted(ROBOT_DATA.glob("**/*.urdf")):
        tips = ends(file)
        if not tips:
            with pytest.raises(FtqpError, match=NO_ARM):
                Robot.from_urdf(file)
            found["no joints"] += 1
            continue
        robot, why = loaded(file, tips)
        if robot is not None:
            assert robot.tips == tuple(tips)
            found["all tips"] += 1
        elif any(loaded(file, [tip])[0] for tip in tips):
            assert any(reason in why for reason in (*PARTLY, *ZERO)), (file.name, why)
            found["one tip"] += 1
        else:
            assert any(reason in why for reason in ZERO), (file.name, why)
            found["zero limits"] += 1
    assert found["all tips"] >= 54
    assert found["all tips"] + found["one tip"] == 61
    assert found["zero limits"] + found["no joints"] == 8
