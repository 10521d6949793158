"""Bodies as capsules: estimated, read from a URDF, fitted to meshes, given."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import ftqp
from ftqp.core.errors import InputError
from ftqp.model.capsules import Collision
from ftqp.model.catalog.arms import published
from ftqp.model.collision_geometry import CORNERS, around, hull_of, vertices
from ftqp.model.serial import Inertial
from ftqp.viz.live.meshes import read_mesh

LINK = """
<link name="{name}"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0"
iyz="0"/></inertial>{collision}</link>"""
JOINT = """
<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{next}"/><origin xyz="0 0 0.3"/>
<axis xyz="{axis}"/><limit lower="-2" upper="2" velocity="2" effort="50"/></joint>"""


def urdf(collisions):
    links = [LINK.format(name=f"l{k}", collision=collisions.get(k, "")) for k in range(4)]
    axes = ("0 0 1", "0 1 0", "0 1 0")
    joints = [JOINT.format(k=k, next=k + 1, axis=axis) for k, axis in enumerate(axes)]
    return f"<robot name='stick'>{''.join(links)}{''.join(joints)}</robot>"


def shape(inner, origin="0 0 0.1"):
    return f"<collision><origin xyz='{origin}' rpy='0 0 0'/><geometry>{inner}</geometry></collision>"


def outside(points, capsules):
    """By how much points stick out of all of some capsules [m]."""
    far = []
    for a, b, r, *_ in capsules:
        way = b - a
        t = np.clip((points - a) @ way / max(float(way @ way), 1e-18), 0.0, 1.0)
        far.append(np.linalg.norm(points - a - t[:, None] * way, axis=1) - r)
    return float(np.min(far, axis=0).max())


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 6))]
)
def test_a_fit_contains_every_corner_and_is_no_balloon(seed):
    rng = np.random.default_rng(seed)
    stretch = np.array([1.0, rng.uniform(0.2, 1.0), rng.uniform(0.1, 1.0)])
    points = rng.normal(size=(80, 3)) * 0.05 * stretch + rng.normal(size=3)
    made = around(points)
    assert outside(points, made) < 1e-9
    volume = sum(np.pi * r * r * (np.linalg.norm(b - a) + 4 / 3 * r) for a, b, r, _ in made)
    assert volume < 4.0 * ConvexHull(points).volume


def test_primitives_of_a_urdf_are_contained():
    robot = ftqp.Robot.from_urdf(
        urdf(
            {
                1: shape("<sphere radius='0.07'/>"),
                2: shape("<cylinder radius='0.05' length='0.2'/>"),
                3: shape("<box size='0.1 0.1 0.3'/>") + shape("<capsule radius='0.02' length='0.1'/>"),
            }
        ),
        tip="l3",
    )
    by = {capsule.label: capsule for capsule in robot.capsules}
    assert set(by) == {"l1", "l2", "l3", "l3 2"} and not by["l1"].estimated
    np.testing.assert_allclose(by["l1"].a, [0.0, 0.0, 0.1])
    assert by["l1"].radius == 0.07 and by["l2"].radius == 0.05
    np.testing.assert_allclose([by["l2"].a, by["l2"].b], [[0, 0, 0.0], [0, 0, 0.2]], atol=1e-12)
    assert by["l3"].radius == pytest.approx(0.05 * np.sqrt(2.0))
    np.testing.assert_allclose([by["l3"].a, by["l3"].b], [[0, 0, -0.05], [0, 0, 0.25]], atol=1e-12)


def tetrahedron(file, scale=1.0):
    corners = scale * np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    text = ["solid t"]
    for face in faces:
        text += ["facet normal 0 0 0", "outer loop"]
        text += [f"vertex {x} {y} {z}" for x, y, z in corners[list(face)]]
        text += ["endloop", "endfacet"]
    file.write_text("\n".join([*text, "endsolid t"]))
    return corners


def test_meshes_are_found_beside_the_urdf_and_contained(tmp_path):
    (tmp_path / "stick" / "meshes").mkdir(parents=True)
    corners = tetrahedron(tmp_path / "stick" / "meshes" / "link.stl")
    file = tmp_path / "stick" / "stick.urdf"
    mesh = "<mesh filename='package://stick/meshes/link.stl' scale='2 2 2'/>"
    file.write_text(urdf({2: shape(mesh, "0 0 0"), 3: shape("<sphere radius='0.05'/>")}))
    robot = ftqp.Robot.from_urdf(file, tip="l3")
    made = [(c.a, c.b, c.radius) for c in robot.capsules if c.frame == "l2"]
    assert made and outside(2.0 * corners, made) < 1e-9
    assert robot.capsules is robot.capsules


def test_a_mesh_that_is_missing_or_empty_is_named(tmp_path):
    file = tmp_path / "stick.urdf"
    file.write_text(urdf({2: shape("<mesh filename='package://stick/none.stl'/>")}))
    robot = ftqp.Robot.from_urdf(file, tip="l3")  # a robot without its meshes plans as ever
    with pytest.raises(InputError, match=r"none.stl' of link 'l2' was not found .*with_capsules"):
        assert robot.capsules
    (tmp_path / "none.stl").write_text("solid nothing\nendsolid nothing")
    with pytest.raises(InputError, match="link 'l2' holds no body"):
        assert ftqp.Robot.from_urdf(file, tip="l3").capsules


def test_without_geometry_capsules_are_estimated_and_say_so():
    robot = ftqp.Robot.from_urdf(urdf({}), tip="l3")
    assert [capsule.frame for capsule in robot.capsules] == ["j0", "j1", "j2"]
    assert all(capsule.estimated for capsule in robot.capsules)
    np.testing.assert_allclose(robot.capsules[0].b, [0.0, 0.0, 0.3], atol=1e-12)


def test_own_capsules_take_their_place_and_wrong_ones_are_refused():
    robot = ftqp.robots.load("planar6")
    own = robot.with_capsules([ftqp.Capsule((0, 0, 0), (1, 0, 0), 0.05, frame=robot.joints[0])])
    assert len(own.capsules) == 1 and own.with_limits(v_max=1.0).capsules == own.capsules
    for wrong, said in (
        ("capsule", "expected a list"),
        ([1], "has int"),
        ([ftqp.Capsule((0, 0, 0), (1, 0, 0), 0.05)], "has no frame"),
    ):
        with pytest.raises(InputError, match=said):
            robot.with_capsules(wrong)


ROBOT_DATA = next(Path(sys.prefix).glob("**/share/example-robot-data/robots"), None)


@pytest.mark.skipif(ROBOT_DATA is None, reason="example-robot-data is not installed")
@pytest.mark.parametrize(
    ("table", "folder"),
    [
        (published("panda")["capsules"], "panda_description/meshes/collision"),
        (published("xarm7")["capsules"], "xarm_description/meshes/xarm7/visual"),
    ],
)
def test_the_capsules_of_the_catalog_contain_the_maker_s_meshes(table, folder):
    for name, _, a, b, r in table:
        file = str(ROBOT_DATA / folder / f"{name.removeprefix('panda_')}.stl")
        points = vertices(Collision(link=name, kind="mesh", size=(1, 1, 1), place=np.eye(4), file=file))
        assert outside(points, [(np.array(a), np.array(b), r)]) < 1e-4


def test_bodies_of_another_model_of_the_arm_are_taken_to_the_joints_that_move_them():
    boxes = {k: shape('<box size="0.05 0.06 0.2"/>') for k in range(4)}
    bare, maker = (ftqp.Robot.from_urdf(urdf(given), tip="l3") for given in ({}, boxes))
    taken = bare.with_capsules(maker)
    assert {one.frame for one in taken.capsules} == {"universe", *bare.joints}
    assert all(len(one.corners) == 8 for one in taken.capsules)
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(0.05, (0.3, 0.1, 0.2)))
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (20, bare.nv))
    one, two = (ftqp.Planner(robot, scene=scene).distances(q) for robot in (maker, taken))
    assert len(one) == len(two) > 0
    for far, same in zip(one.values(), two.values(), strict=True):
        assert np.allclose(far, same, atol=1e-9)


def test_bodies_of_another_arm_are_refused_by_the_joint():
    panda = ftqp.robots.load("panda")
    with pytest.raises(ftqp.InputError, match="moves with 'iiwa_joint_1', which panda has not"):
        panda.with_capsules(ftqp.robots.load("iiwa14"))
    moved = urdf({1: shape('<sphere radius="0.1"/>')})
    longer = moved.replace('xyz="0 0 0.3"', 'xyz="0 0 0.4"')
    assert longer != moved
    with pytest.raises(ftqp.InputError, match="off that of"):
        ftqp.Robot.from_urdf(moved, tip="l3").with_capsules(ftqp.Robot.from_urdf(longer, tip="l3"))


def test_bodies_go_along_with_a_base_and_two_arms_have_two_of_each():
    inertial = Inertial(mass=60.0, com=np.zeros(3), inertia=np.eye(3))
    robot = ftqp.robots.load("panda").on_planar_base(v_max=1.0, a_max=1.0, inertial=inertial)
    assert robot.capsules[0].label == "panda_link0" and robot.capsules[0].frame == "base_yaw"
    both = ftqp.robots.load("dual_panda")
    q = both.neutral
    frames = {one.label: (both.pose(q, one.frame), one.a) for one in both.capsules}
    ends = {name: T[:3, :3] @ a + T[:3, 3] for name, (T, a) in frames.items()}
    for name in ("link0", "link3", "hand", "leftfinger"):
        np.testing.assert_allclose(ends[f"left_{name}"] - ends[f"right_{name}"], [0.0, 0.6, 0.0], atol=1e-9)
    planner = ftqp.Planner(both, clearance=ftqp.Clearance())
    assert planner.distances(q)["right_hand", "left_hand"] > 0.3


def directions(count):
    found = np.random.default_rng(0).normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1)[:, None]


def test_a_box_has_eight_corners_twelve_edges_and_six_faces():
    points = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], dtype=float)
    hull = hull_of(np.vstack([points, 0.5 * points + 0.2]))
    assert (len(hull.corners), len(hull.edges), len(hull.faces)) == (8, 12, 6)
    lengths = np.linalg.norm(np.diff(hull.corners[hull.edges], axis=1)[:, 0], axis=1)
    assert sorted(lengths.round(9).tolist()) == [1.0] * 4 + [2.0] * 4 + [3.0] * 4


@pytest.mark.long
@pytest.mark.parametrize("count", [5, 30, 2000])
@pytest.mark.parametrize("size", [1e-3, 1.0])
def test_every_point_is_within_and_every_corner_on_the_hull(count, size):
    points = size * directions(count) * [1.0, 0.6, 0.3] + size
    hull = hull_of(points)
    assert len(hull.corners) <= CORNERS
    assert len(hull.corners) - len(hull.edges) + len(hull.faces) == 2  # Euler
    above = points @ hull.faces[:, :3].T - hull.faces[:, 3]
    assert above.max() < 1e-11 * size
    own = hull.corners @ hull.faces[:, :3].T - hull.faces[:, 3]
    assert own.max() < 1e-9 * size and (np.abs(own) < 1e-9 * size).sum(axis=1).min() >= 3


@pytest.mark.parametrize(
    "points", [np.zeros((0, 3)), np.zeros((5, 3)), np.eye(3), np.ones((9, 3)) * [1, 2, 0]]
)
def test_points_without_a_body_are_refused(points):
    with pytest.raises(InputError, match="have no body between them"):
        hull_of(points)


TETRAHEDRON = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in TETRAHEDRON) + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    + "".join(f"{x} {y} {z}\n" for x, y, z in TETRAHEDRON)
    + "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
)
READERS = {"hull": lambda file: ftqp.Hull(mesh=str(file)), "page": read_mesh}


@pytest.fixture(params=list(READERS))
def read(request):
    if request.param == "page":
        pytest.importorskip("trimesh")
    return READERS[request.param]


@pytest.mark.parametrize(("name", "text"), [("part.obj", OBJ), ("part.OBJ", OBJ), ("part.ply", PLY)])
def test_a_mesh_is_read(tmp_path, read, name, text):
    (tmp_path / name).write_text(text, encoding="utf-8")
    read(tmp_path / name)
