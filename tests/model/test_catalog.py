"""The catalog against published figures, pinocchio and the URDFs of the extra ``robots``."""

import sys
from pathlib import Path

import numpy as np
import pytest
from tests.arm_at import arm_at

from ftqp.core.errors import InputError
from ftqp.model import catalog
from ftqp.model.audit import Severity
from ftqp.model.robot import Robot

ROBOT_DATA = next(Path(sys.prefix).glob("**/share/example-robot-data/robots"), None)
needs_robot_data = pytest.mark.skipif(
    ROBOT_DATA is None, reason="example-robot-data is not installed: pip install -e '.[robots]'"
)
INCH = 0.0254


@pytest.mark.parametrize("name", catalog.names())
def test_robot_of_the_catalog_is_sound(name):
    robot = catalog.load(name)
    assert not [f for f in robot.findings if f.severity is not Severity.NOTE]
    assert (robot.limits.q_min < robot.neutral).all()
    assert (robot.neutral < robot.limits.q_max).all()
    assert np.isfinite(robot.limits.v_max).all()
    assert np.isfinite(robot.limits.a_max).all()
    rows = [("x", "y", "z", "rx", "ry", "rz").index(row) for row in robot.default_rows]
    singular = np.linalg.svd(robot.jacobian(robot.neutral)[rows], compute_uv=False)
    assert singular[-1] > 1e-3


def test_planar6_has_the_published_check_values():
    robot = catalog.load("planar6")
    q, v = robot.neutral, np.array([0.1, -0.2, 0.3, -0.1, 0.2, 0.05])
    assert q == pytest.approx(np.full(6, np.pi / 12))
    assert robot.pose(q)[:2, 3] == pytest.approx([0.87241288, 0.89010293], abs=5e-9)
    singular = np.linalg.svd(robot.jacobian(q)[:2], compute_uv=False)
    assert singular == pytest.approx([1.844142, 0.311927], abs=5e-7)
    M = robot.mass_matrix(q)
    expected = [4.94955e-4, 1.87633e-3, 5.70791e-3, 2.25443e-2, 0.235669, 5.139285]
    assert np.linalg.eigvalsh(M) == pytest.approx(expected, rel=2e-6)
    assert M[0] == pytest.approx([3.07087, 2.071825, 1.164001, 0.581081, 0.193268, 0.018158], abs=6e-7)
    assert robot.bias(q, v) == pytest.approx(
        [-0.013853, -0.003590, 0.001927, 0.003077, 0.002007, 0.000383], abs=6e-7
    )
    assert arm_at(robot, q, v).drift[:2] == pytest.approx([-0.01803415, -0.04190422], abs=5e-9)
    assert robot.default_rows == ("x", "y")


@pytest.mark.parametrize(
    ("degrees", "tip", "singular"),
    [
        (
            [45, -60, 0, -45, 0, 45, 90, 45, 0, 0, 0],
            [113.213489, 53.213489, 73.448632],
            [6.464817, 5.288295, 2.152394, 1.223836, 0.588324, 0.348837],
        ),
        (
            [0, -50, 0, -30, 0, 70, 0, 30, 0, 0, 0],
            [37.213803, 0.0, 140.418863],
            [6.326615, 4.088023, 2.003008, 1.645697, 0.606653, 0.518691],
        ),
    ],
)
def test_modular11_has_the_published_check_values(degrees, tip, singular):
    robot = catalog.load("modular11")
    q = np.deg2rad(degrees)
    assert robot.pose(q)[:3, 3] / INCH == pytest.approx(tip, abs=1e-6)
    J = robot.jacobian(q)
    J[:3] /= robot.length
    assert np.linalg.svd(J, compute_uv=False) == pytest.approx(singular, abs=1e-6)


def test_canadarm2_is_as_long_as_its_maker_says_and_keeps_its_task_without_any_one_joint():
    robot = catalog.load("canadarm2")
    stretched = robot.pose(np.zeros(7))
    assert stretched[:3, :3] == pytest.approx(np.eye(3), abs=1e-12)
    assert stretched[:3, 3] == pytest.approx([2 * 1.3589 + 2 * 7.11, -0.475 - 2 * 0.5692, 0.0], abs=1e-12)
    assert np.linalg.norm(stretched[:3, 3]) == pytest.approx(17.0, abs=0.05)
    J = robot.jacobian(np.zeros(7))
    axes = [(1, 0, 0), (0, 0, 1), (0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)]
    assert pytest.approx(np.array(axes, float), abs=1e-12) == J[3:].T
    J = robot.jacobian(robot.neutral)
    J[:3] /= robot.length
    assert min(np.linalg.svd(np.delete(J, i, 1), compute_uv=False)[-1] for i in range(7)) > 0.1
    said = [finding.sentence for finding in robot.findings]
    assert any("a_max" in one for one in said) and any("without centres of mass" in one for one in said)


def test_zhang7_has_the_published_check_values():
    robot = catalog.load("zhang7")
    J = robot.jacobian(robot.neutral)
    assert robot.pose(robot.neutral)[:3, 3] == pytest.approx([6.261403, -4.253646, 5.447147], abs=1e-6)
    minors = [(-1) ** i * np.linalg.det(np.delete(J, i, 1)) for i in range(7)]
    expected = [-61.52766, 5.045367, 42.348167, 21.20657, -64.809035, 2.456275, 62.862455]
    assert minors == pytest.approx(expected, rel=1e-6)
    assert np.linalg.svd(J, compute_uv=False)[-1] == pytest.approx(0.346779, abs=1e-6)


def test_panda_has_the_modified_table_of_its_maker():
    half = np.pi / 2
    table = [
        (0.0, 0.333, 0.0, 0.0),
        (0.0, 0.0, 0.0, -half),
        (0.0, 0.316, 0.0, half),
        (0.0, 0.0, 0.0825, half),
        (0.0, 0.384, -0.0825, -half),
        (0.0, 0.0, 0.0, half),
        (0.0, 0.0, 0.088, half),
    ]
    flange = np.eye(4)
    flange[2, 3] = 0.107
    arm = Robot.from_dh(table, "modified", tool=flange)
    robot = catalog.load("panda", hand=False)
    assert robot.tip == "panda_link8"
    for q in np.random.default_rng(5).uniform(-2.0, 2.0, (10, 7)):
        assert np.abs(robot.pose(q) - arm.pose(q)).max() < 1e-12


@needs_robot_data
def test_xarm7_equals_its_urdf_with_exact_right_angles():
    assert ROBOT_DATA is not None
    path = ROBOT_DATA / "xarm_description/urdf/xarm7.urdf"
    exact = path.read_text(encoding="utf-8").replace("1.5708 ", f"{np.pi / 2!r} ")
    robot, urdf, rounded = (
        catalog.load("xarm7", rotors=False),
        Robot.from_urdf(exact, "link7"),
        Robot.from_urdf(path, "link7"),
    )
    assert urdf.joints == robot.joints
    for field in ("q_min", "q_max", "v_max", "tau_max"):
        assert getattr(urdf.limits, field).tolist() == getattr(robot.limits, field).tolist()
    for field in ("mass", "com", "inertia"):
        assert np.abs(getattr(urdf.chain, field) - getattr(robot.chain, field)).max() < 1e-12
    for q in np.random.default_rng(5).uniform(robot.limits.q_min, robot.limits.q_max, (20, 7)):
        assert np.abs(urdf.pose(q) - robot.pose(q)).max() < 1e-9
        assert np.abs(rounded.pose(q) - robot.pose(q)).max() < 3e-5


def test_unknown_robot_names_the_nearest():
    with pytest.raises(
        InputError,
        match=r"'pandas' is not a robot of the catalog \(did you mean 'panda'\?\).*from_urdf",
    ):
        catalog.load("pandas")
    with pytest.raises(InputError, match=r"; others are read by ftqp\.Robot\.from_urdf"):
        catalog.load("gen3")


def test_unknown_option_names_the_valid_ones():
    with pytest.raises(InputError, match="'tool' is not an option of the robot panda; it has hand"):
        catalog.load("panda", tool=False)
    with pytest.raises(InputError, match="'hand' is not an option of the robot iiwa14; it has no options"):
        catalog.load("iiwa14", hand=True)


def test_xarm7_has_the_rotor_inertia_that_its_text_states_and_without_it_a_light_wrist():
    with_rotors, without = catalog.load("xarm7"), catalog.load("xarm7", rotors=False)
    assert with_rotors.chain.armature.tolist() == [0.1] * 7
    assert arm_at(without, without.neutral).M[6, 6] == pytest.approx(1.4e-4, rel=0.1)
    assert arm_at(with_rotors, without.neutral).M[6, 6] == pytest.approx(0.1, rel=0.01)
