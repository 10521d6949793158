"""URDF is read and written, and tables of Denavit and Hartenberg are read."""

from collections.abc import Callable
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest

from ftqp.core.errors import InputError, ModelError
from ftqp.core.pose import rotation_x, rotation_z, transform
from ftqp.model import catalog
from ftqp.model.audit import Severity
from ftqp.model.limits import RISE_TIME
from ftqp.model.robot import Robot
from ftqp.model.serial import Inertial
from ftqp.model.urdf_text import link_names

Urdf = Callable[..., str]

BROKEN = [
    ('<link name="two"/>', "a link has the name 'two' again"),
    ("<link/>", "a link has no name"),
    ('<link name="loose"/>', r"there are 2 links without a parent \['base', 'loose'\], expected one base"),
    (
        '<joint name="c" type="fixed"><parent link="base"/><child link="nowhere"/></joint>',
        "joint 'c' has the child link 'nowhere', which does not exist",
    ),
    (
        '<joint name="c" type="fixed"><parent link="base"/><child link="two"/></joint>',
        "link 'two' is the child of both 'b' and 'c'; expected a tree",
    ),
    (
        '<link name="three"/><joint name="c" type="hinge"><parent link="base"/><child link="three"/></joint>',
        "joint 'c' has the type 'hinge', expected one of revolute",
    ),
]


@pytest.mark.parametrize(("more", "message"), BROKEN)
def test_links_that_are_not_a_tree_are_refused(two_joints: Urdf, more: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        Robot.from_urdf(two_joints(more=more), "two")


LOOP = """<robot name="loop"><link name="one"/><link name="two"/>
<joint name="a" type="fixed"><parent link="one"/><child link="two"/></joint>
<joint name="b" type="fixed"><parent link="two"/><child link="one"/></joint></robot>"""


@pytest.mark.parametrize(
    ("text", "message"), [(LOOP, "0 links without a parent"), ("<robot name='empty'/>", "there are no links")]
)
def test_loop_and_nothing_are_refused(text: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        Robot.from_urdf(text, "two")


def test_figures_of_the_file_arrive_to_the_last_bit(two_joints: Urdf) -> None:
    text = two_joints(origin="0.1 0.2 0.30000000000000004", mass="2.0000000000000004")
    robot = Robot.from_urdf(text)
    assert robot.chain.translation[0].tolist() == [0.1, 0.2, 0.30000000000000004]
    assert robot.chain.mass[0] == 2.0000000000000004


PLAIN = 'lower="-1" upper="2" velocity="1.5" effort="20"'
DRAKE = 'xmlns:drake="http://drake.mit.edu"'


def read(two_joints: Urdf, more: str, **given: object) -> Robot:
    text = two_joints(limit=f"{PLAIN} {more}").replace('name="two">', f'name="two" {DRAKE}>', 1)
    return Robot.from_urdf(text, **given)


@pytest.mark.parametrize(
    ("more", "least"),
    [
        ('acceleration="3"', 3.0),
        ('deceleration="2.5"', 2.5),
        ('acceleration="3" deceleration="3"', 3.0),
        ('acceleration="3" deceleration="2"', 2.0),
        ('acceleration="3" deceleration="5"', 3.0),
        ('acceleration="3" drake:acceleration="4"', 3.0),
        ('acceleration="5" drake:acceleration="4" deceleration="6"', 4.0),
        ('acceleration="inf" deceleration="6"', 6.0),
    ],
)
def test_smallest_of_what_bounds_the_acceleration_is_taken(two_joints: Urdf, more: str, least: float) -> None:
    robot = read(two_joints, more)
    assert robot.limits.a_max.tolist() == [least, 2.0 / RISE_TIME]  # joint b has none
    said = [f for f in robot.findings if f.sentence.startswith("joint 'a' has limits of")]
    values = {float(word.split("=")[1].strip('"')) for word in more.split()}
    assert len(said) == (len(values) > 1)
    assert all(f"the smallest, {least:g}, is taken" in f.sentence for f in said)


@pytest.mark.parametrize("key", ["acceleration", "deceleration", "drake:acceleration", "jerk"])
@pytest.mark.parametrize("value", ["0", "-1", "nan", "fast", "", "1_000", "٣"])
def test_limit_that_is_none_is_refused_with_its_joint_and_attribute(
    two_joints: Urdf, key: str, value: str
) -> None:
    message = rf"joint 'a' has the limit {key}='{value}', expected a number > 0"
    with pytest.raises(ModelError, match=message):
        read(two_joints, f'{key}="{value}"')


def test_guess_that_the_torques_cannot_keep_up_with_is_a_warning(two_joints: Urdf) -> None:
    """Joint b: M = 0.02 + 1 kg (0.1 m)^2 = 0.03 kg m2 and gravity up to 1 N m."""
    robot = read(two_joints, 'acceleration="3"', limits={"tau_max": [20.0, 1.1]})
    (guess,) = (f for f in robot.findings if f.about == "a_max")
    assert guess.severity is Severity.WARNING
    assert ", which b cannot keep up everywhere: b 10 (torque allows" in str(guess)
    figure = float(str(guess).partition("torque allows ")[2].partition(")")[0])
    assert (1.1 - 9.81 * 0.1) / 0.03 <= figure <= 1.1 / 0.03
    assert not any(f.about == "a_max" for f in robot.with_limits(a_max=2.0).findings)


TABLE = np.random.default_rng(3).uniform(-1.5, 1.5, (5, 4))
LIMITS = {"q_min": -3.0, "q_max": 3.0, "v_max": 1.0}


def matrices(q: np.ndarray, convention: str, prismatic: tuple[int, ...] = ()) -> list[np.ndarray]:
    frames = [np.eye(4)]
    for i, (theta, d, a, alpha) in enumerate(TABLE):
        slide = q[i] if i in prismatic else 0.0
        turn = transform(rotation_z(theta + q[i] - slide), np.array([0.0, 0.0, d + slide]))
        twist = transform(rotation_x(alpha), np.array([a, 0.0, 0.0]))
        frames.append(frames[-1] @ (turn @ twist if convention == "standard" else twist @ turn))
    return frames[1:]


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("prismatic", [(), (2,), (0, 4)])
def test_tip_is_the_product_of_the_matrices(convention: str, prismatic: tuple[int, ...]) -> None:
    robot = Robot.from_dh(TABLE, convention, limits=LIMITS, prismatic=prismatic)
    q = np.random.default_rng(1).uniform(-1.0, 1.0, 5)
    assert robot.chain.prismatic.nonzero()[0].tolist() == list(prismatic)
    assert np.abs(robot.pose(q) - matrices(q, convention, prismatic)[-1]).max() < 1e-12


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_masses_are_given_in_the_frames_of_the_table(convention: str) -> None:
    masses = [
        Inertial(mass=1.0 + i, com=np.array([0.1, -0.2, 0.3]), inertia=np.diag([1.0, 1.1, 1.2]))
        for i in range(5)
    ]
    robot = Robot.from_dh(TABLE, convention, limits=LIMITS, inertials=masses)
    q = np.linspace(-1.0, 1.0, 5)
    total = sum(m.mass for m in masses)
    expected = sum(
        m.mass * (T[:3, :3] @ m.com + T[:3, 3]) for m, T in zip(masses, matrices(q, convention), strict=True)
    )
    assert robot.has_inertia
    com = pin.centerOfMass(robot.model, robot.model.createData(), q)
    assert np.abs(np.asarray(com) - expected / total).max() < 1e-12


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"table": []}, "expected rows"),
        ({"table": [[0.0, 1.0]]}, r"table has shape \(1, 2\)"),
        ({"table": "table"}, "expected rows"),
        ({"table": [[0.0, float("nan"), 0.0, 0.0]]}, "contains NaN"),
        ({"convention": "standart"}, "did you mean 'standard'"),
        ({"joints": ["a", "a", "b", "c", "d"]}, "4 different names, expected 5"),
        ({"prismatic": [7]}, "0-based indices below 5"),
        ({"inertials": [None]}, "1 entries, expected 5"),
        ({"tool": np.zeros((4, 4))}, "tool has a rotation part that is not a rotation"),
    ],
)
def test_wrong_tables_are_named(keywords: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Robot.from_dh(**{"table": TABLE, "limits": LIMITS, **keywords})  # type: ignore[arg-type]


ALL = [*catalog.names(), "planar(3)"]


def postures(robot: Robot, count: int = 5) -> np.ndarray:
    low = np.maximum(robot.limits.q_min, -2.0)
    return np.random.default_rng(3).uniform(low, np.minimum(robot.limits.q_max, 2.0), (count, robot.nv))


@pytest.mark.parametrize("name", ALL)
def test_pinocchio_reads_the_same_arm(name: str) -> None:
    robot = catalog.load(name)
    model = pin.buildModelFromXML(robot.to_urdf())
    model.gravity = robot.model.gravity
    model.armature = robot.chain.armature
    assert list(model.names)[1:] == list(robot.joints)
    data, tip = model.createData(), model.getFrameId(link_names(robot.joints, robot.tips)[robot.nv + 1])
    for q in postures(robot):
        at = np.concatenate(
            [[np.cos(x), np.sin(x)] if model.joints[i + 1].nq == 2 else [x] for i, x in enumerate(q)]
        )
        pin.framesForwardKinematics(model, data, at)
        np.testing.assert_allclose(data.oMf[tip].homogeneous, robot.pose(q), rtol=0.0, atol=1e-12)
        if robot.has_inertia:
            M = pin.crba(model, data, at)
            M = np.triu(M) + np.triu(M, 1).T
            np.testing.assert_allclose(M, robot.mass_matrix(q), rtol=0.0, atol=1e-12 * np.abs(M).max())


@pytest.mark.parametrize("name", ["panda", "iiwa14", "xarm7"])
def test_mujoco_reads_the_same_arm(name: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    robot = catalog.load(name)
    kept = '<mujoco><compiler fusestatic="false" discardvisual="false"/></mujoco></robot>'
    model = mujoco.MjModel.from_xml_string(robot.to_urdf().replace("</robot>", kept))
    data = mujoco.MjData(model)
    assert model.nv == robot.nv
    assert model.ngeom >= robot.nv  # cylinders to look at
    for q in postures(robot):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        tip = data.body(link_names(robot.joints, robot.tips)[robot.nv + 1])
        np.testing.assert_allclose(tip.xpos, robot.pose(q)[:3, 3], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(tip.xmat.reshape(3, 3), robot.pose(q)[:3, :3], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["bell\a", "null\0", "half \ud800", ""])
def test_name_that_xml_cannot_hold_is_refused(name: str) -> None:
    robot = catalog.load("planar(3)")
    chain = robot.chain
    odd = replace(robot, chain=replace(chain, names=(name, *chain.names[1:])))
    with pytest.raises(InputError, match="cannot stand in a URDF"):
        odd.to_urdf()


def test_rotors_and_accelerations_stand_where_drake_reads_them() -> None:
    robot = catalog.load("panda")
    root = ElementTree.fromstring(robot.to_urdf())
    drake = "{http://drake.mit.edu}"
    limit = root.findall("joint/limit")
    assert [float(x.get(f"{drake}acceleration", "")) for x in limit] == robot.limits.a_max.tolist()
    rotors = root.findall(f"transmission/actuator/{drake}rotor_inertia")
    assert [float(x.get("value", "")) for x in rotors] == [x for x in robot.chain.armature if x]


def test_shapes_without_all_their_sizes_are_left_out_aloud(caplog) -> None:
    """A box of two edges is none, and who scales a mesh by two numbers does not mean 1."""
    text = (
        '<robot name="a"><link name="b"><collision><geometry><box size="1 1"/></geometry></collision></link>'
        '<joint name="j" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" velocity="1" effort="9"/></joint>'
        '<link name="c"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<collision><geometry><mesh filename="x.stl" scale="1 1"/></geometry></collision></link></robot>'
    )
    Robot.from_urdf(text, tip="c")
    assert "the box of link 'b' has the sizes [1.0, 1.0], expected 3 finite numbers" in caplog.text
    assert "the mesh of link 'c' has the sizes [1.0, 1.0], expected 3 finite numbers" in caplog.text
