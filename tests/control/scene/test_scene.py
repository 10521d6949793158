"""Scenes: what can be put into one, and what is said of what cannot."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError


def test_a_scene_is_a_mapping_of_what_stands_there():
    scene = ftqp.Scene()
    scene.add("table", ftqp.Box((1.0, 0.6, 0.04), (0.5, 0.0, 0.3)))
    scene.add("post", ftqp.Cylinder(0.05, 1.2, (0.0, 0.8, 0.6)))
    assert list(scene) == ["table", "post"] and "table" in scene and len(scene) == 2
    np.testing.assert_array_equal(scene["table"].place[:3, 3], [0.5, 0.0, 0.3])
    turned = np.eye(4)
    turned[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    scene.move("table", turned, (0.1, 0.0, 0.0, 0.0, 0.0, 0.2))
    scene.move("table", (1.0, 2.0, 3.0))
    np.testing.assert_array_equal(scene["table"].place[:3, :3], turned[:3, :3])
    assert not scene["table"].twist.any()
    scene.remove("table")
    assert "table" not in scene and repr(scene) == "Scene(post)"


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: ftqp.Box((0.1, 0.2), (0, 0, 0)), r"size has shape \(2,\), expected \(3,\)"),
        (lambda: ftqp.Box((0.1, 0.2, 0.0)), "size is 0"),
        (lambda: ftqp.Box((400.0, 200.0, 10.0)), "are these millimetres"),
        (lambda: ftqp.Sphere(0.1, (0.0, np.nan, 0.0)), "place"),
        (lambda: ftqp.Sphere(0.1, np.diag([1.0, 2.0, 1.0, 1.0])), "not a rotation"),
        (lambda: ftqp.HalfSpace((0, 0, 0), (0, 0, 0)), "expected a direction"),
        (lambda: ftqp.Hull(), "expected one of them"),
        (lambda: ftqp.Hull(np.eye(3)), "have no body between them"),
        (lambda: ftqp.Hull(200.0 * np.eye(4)[:, :3]), "are these millimetres"),
        (lambda: ftqp.Hull(mesh="nowhere.stl"), "'nowhere.stl' is no file"),
        (lambda: ftqp.Hull(mesh=3), "mesh '3' is no file"),
        (lambda: ftqp.Hull(mesh=__file__), r"or is no mesh \([^\n]*\)"),
        (lambda: ftqp.Hull(np.eye(4)[:, :3], scale=2.0), "scale is 2.0 together with corners"),
        (lambda: ftqp.Capsule((0, 0, 0), (0, 0, 500.0), 0.1), "are these millimetres"),
        (lambda: ftqp.Capsule((0, 0, 0), (0, 0, 1.0), 0.1, frame=3), "frame is 3"),
        (lambda: ftqp.Clearance(keep=0.01, stop=0.02), "expected stop < keep"),
        (lambda: ftqp.Clearance(keep=-1.0), "keep"),
        (lambda: ftqp.Clearance(share=1.5), "share"),
        (lambda: ftqp.Clearance(ignore=["hand"]), "expected pairs of names"),
        (lambda: ftqp.Clearance(ignore=[("a", "b", "c")]), "expected pairs of names"),
        (lambda: ftqp.Scene().add("", ftqp.Sphere(0.1)), "expected a word"),
        (lambda: ftqp.Scene().remove("ball"), "there is no 'ball' in the scene"),
        (lambda: ftqp.Scene().move("ball", (0, 0, 0)), "there is no 'ball' in the scene"),
    ],
)
def test_what_is_no_scene_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()


def test_a_move_that_is_refused_leaves_the_thing_where_it_was():
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(0.1, (1.0, 0.0, 0.0)))
    for place, twist in (((np.nan, 0, 0), None), ((0, 0, 0), (1.0, 2.0)), (np.zeros((3, 3)), None)):
        with pytest.raises(InputError):
            scene.move("ball", place, twist)
    with pytest.raises(InputError, match="'ball' is in the scene already"):
        scene.add("ball", ftqp.Sphere(0.1))
    np.testing.assert_array_equal(scene["ball"].place[:3, 3], [1.0, 0.0, 0.0])


def test_a_full_scene_says_so():
    scene = ftqp.Scene()
    for k in range(64):
        scene.add(f"{k}", ftqp.Sphere(0.01, (3.0, 0.0, 0.1 * k)))
    with pytest.raises(InputError, match="no room for 'one more'"):
        scene.add("one more", ftqp.Sphere(0.01))


URDF = """<robot name="cell">
<link name="world"/>
<link name="table">
<collision><origin xyz="0 0 0.4"/><geometry><box size="1.0 0.6 0.8"/></geometry></collision>
<collision><origin xyz="0.2 0 0.9"/><geometry><cylinder radius="0.05" length="0.2"/></geometry></collision>
</link>
<link name="lamp"><collision><geometry><sphere radius="0.1"/></geometry></collision>
<collision><origin xyz="0 0 0.5" rpy="0 1.5707963267948966 0"/>
<geometry><capsule radius="0.03" length="0.4"/></geometry></collision></link>
<joint name="a" type="fixed"><parent link="world"/><child link="table"/><origin xyz="0.8 0 0"/></joint>
<joint name="b" type="revolute"><parent link="world"/><child link="lamp"/><origin xyz="0 1 1" rpy="0 0 1.57"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
</robot>"""


def test_a_cell_is_read_from_a_urdf():
    scene = ftqp.Scene.from_urdf(URDF)
    assert list(scene) == ["table", "table 2", "lamp", "lamp 2"]
    np.testing.assert_allclose(scene["table"].place[:3, 3], [0.8, 0.0, 0.4])
    assert scene["table"].shape.size == (1.0, 0.6, 0.8)
    np.testing.assert_allclose(scene["table 2"].place[:3, 3], [1.0, 0.0, 0.9])
    ends = scene["lamp 2"].shape.a, scene["lamp 2"].shape.b
    np.testing.assert_allclose(np.mean(ends, axis=0), [0.0, 1.0, 1.5], atol=1e-9)
    np.testing.assert_allclose(
        np.abs(np.subtract(*ends)), [0.4 * np.cos(1.57), 0.4 * np.sin(1.57), 0.0], atol=1e-9
    )


@pytest.mark.parametrize("is_open", [False, True])
def test_a_mesh_stands_for_its_hull(tmp_path, is_open):
    corners = [(0, 0, 0), (0.3, 0, 0), (0, 0.1, 0), (0, 0, 0.2)]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    text = "".join(
        "facet normal 0 0 0 outer loop "
        + "".join("vertex {} {} {} ".format(*corners[k]) for k in face)
        + "endloop endfacet "
        for face in faces[is_open:]
    )
    (tmp_path / "thing.stl").write_text(f"solid t {text}endsolid t")
    origin = '<origin xyz="1 0 0"/>'
    mesh = origin + '<geometry><mesh filename="thing.stl" scale="{0} {0} {0}"/></geometry>'
    mesh = f"<collision>{mesh}</collision>"
    for scale, said in ((2.0, None), (1000.0, "are these millimetres")):
        (tmp_path / "cell.urdf").write_text(
            f'<robot name="cell"><link name="thing">{mesh.format(scale)}</link></robot>'
        )
        if said is not None:
            with pytest.raises(InputError, match=said):
                ftqp.Scene.from_urdf(tmp_path / "cell.urdf")
            continue
        scene = ftqp.Scene.from_urdf(tmp_path / "cell.urdf")
        found = scene["thing"].shape.corners
        np.testing.assert_allclose(
            sorted(map(tuple, found)), sorted(map(tuple, 2.0 * np.array(corners))), atol=1e-6
        )
        np.testing.assert_allclose(scene["thing"].place[:3, 3], [1.0, 0.0, 0.0], atol=1e-12)
    alone = ftqp.Hull(mesh=str(tmp_path / "thing.stl"), scale=0.5, place=(0.0, 1.0, 0.0), rpy=(0.0, 0.0, 1.0))
    assert alone.extent == pytest.approx((0.15, 0.05, 0.1))
    (tmp_path / "thing.stl").unlink()
    with pytest.raises(InputError, match=r"thing.stl' of link 'thing' was not found"):
        ftqp.Scene.from_urdf(tmp_path / "cell.urdf")


MJCF = """<mujoco model="cell"><compiler angle="degree"/>
<default><default class="visual"><geom contype="0" conaffinity="0"/></default></default>
<asset><mesh name="wedge" vertex="0 0 0  0.3 0 0  0 0.1 0  0 0 0.2"/></asset>
<worldbody>
<geom name="floor" type="plane" size="2 2 .1" pos="0 0 -0.05" euler="0 20 0"/>
<geom class="visual" type="box" size=".4 .6 .02"/>
<body name="post" pos=".45 .3 .6" euler="0 0 30"><geom type="cylinder" size=".05 .6" pos="0.1 0 0"/>
<geom type="capsule" fromto="0 0 0 0 0 .5" size=".03"/>
<body name="door" pos="0 0 .1"><joint type="hinge" axis="0 0 1" pos="0.3 0 0"/>
<geom name="leaf" type="box" size=".07 .1 .2" pos="0 0.2 0"/>
<geom name="wedge" type="mesh" mesh="wedge"/></body>
</body></worldbody></mujoco>"""


def test_a_cell_is_read_from_an_mjcf_as_mujoco_sees_it():
    mujoco = pytest.importorskip("mujoco")
    scene = ftqp.Scene.from_mjcf(MJCF)
    assert list(scene) == ["floor", "post", "post 2", "leaf", "wedge"]
    model = mujoco.MjModel.from_xml_string(MJCF)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    collide = [at for at in range(model.ngeom) if model.geom_contype[at]]
    for at, name in list(zip(collide, scene, strict=True))[:4]:
        np.testing.assert_allclose(scene[name].place[:3, 3], data.geom_xpos[at], atol=1e-9)
        np.testing.assert_allclose(
            scene[name].place[:3, 2], data.geom_xmat[at].reshape(3, 3)[:, 2], atol=1e-9
        )
    assert scene["leaf"].shape.size == (0.14, 0.2, 0.4) and scene["post"].shape.length == 1.2
    corner = data.body("door").xpos + data.body("door").xmat.reshape(3, 3) @ [0.3, 0.0, 0.0]
    wedge = scene["wedge"]
    inside = wedge.place[:3, :3].T @ (corner - wedge.place[:3, 3])
    assert np.linalg.norm(wedge.shape.corners - inside, axis=1).min() < 1e-6


def test_pairs_that_an_srdf_lets_touch_are_those_of_the_capsules_of_their_links():
    robot = ftqp.robots.load("panda")
    srdf = """<robot name="panda"><disable_collisions link1="panda_link5" link2="panda_hand" reason="Never"/>
    <disable_collisions link1="panda_link1" link2="camera" reason="User"/></robot>"""
    found = robot.allowed_pairs(srdf)
    assert found == (("panda_link5", "panda_hand"),)
    pairs = [
        set(ftqp.Planner(robot, clearance=ftqp.Clearance(ignore=ignore)).distances(robot.neutral))
        for ignore in ((), found)
    ]
    assert pairs[0] - pairs[1] == {pair for pair in pairs[0] if set(pair) in map(set, found)} != set()
    with pytest.raises(InputError, match="expected link1 and link2"):
        robot.allowed_pairs('<robot name="x"><disable_collisions link1="a"/></robot>')


def test_many_hulls_are_simpler_ones_around_them_so_that_all_have_room():
    rng, scene, panda = np.random.default_rng(2), ftqp.Scene(), ftqp.robots.load("panda")
    points = rng.normal(size=(200, 3))
    points *= 0.05 / np.linalg.norm(points, axis=1)[:, None]
    for k in range(30):
        scene.add(f"stone {k}", ftqp.Hull(points, place=(0.6, 0.1 * k - 1.5, 0.1)))
    crowd = ftqp.Planner(panda, scene=scene).distances(panda.neutral)
    for name in [f"stone {k}" for k in range(29)]:
        scene.remove(name)
    alone = ftqp.Planner(panda, scene=scene).distances(panda.neutral)
    assert len(scene["stone 29"].shape.corners) > 50
    for pair in alone.keys() & crowd.keys():
        assert alone[pair] - 0.06 < crowd[pair] <= alone[pair] + 1e-9


PANDA = ftqp.robots.load("panda")
KEEP = 0.02


def cloud(rng, count=1000, radius=0.02):
    """Balls all over the room but where the arm begins."""
    balls = np.column_stack(
        [rng.uniform((-0.9, -0.9, 0.0), (0.9, 0.9, 1.2), (4 * count, 3)), np.full(4 * count, radius)]
    )
    return balls[truth(PANDA.neutral, balls).min(axis=0) > 0.06][:count]


def truth(q, balls):
    """The distance of every capsule that moves from every ball, (C, K) [m]."""
    found = []
    for one in PANDA.capsules:
        if one.frame == "universe":
            continue
        T = PANDA.pose(q, one.frame)
        a, b = (T[:3, :3] @ end + T[:3, 3] for end in (one.a, one.b))
        way = b - a
        s = np.clip((balls[:, :3] - a) @ way / max(way @ way, 1e-12), 0.0, 1.0)
        found.append(np.linalg.norm(a + s[:, None] * way - balls[:, :3], axis=1) - one.radius - balls[:, 3])
    return np.array(found)


def test_the_nearest_ball_of_each_body_is_found_at_any_posture():
    rng = np.random.default_rng(3)
    scene = ftqp.Scene()
    balls = cloud(rng)
    scene.update(balls)
    planner = ftqp.Planner(PANDA, scene=scene, clearance=ftqp.Clearance(keep=KEEP, self_pairs=False))
    labels = [one.label for one in PANDA.capsules if one.frame != "universe"]
    for _ in range(20):
        q = rng.uniform(PANDA.limits.q_min, PANDA.limits.q_max)
        seen, true = planner.distances(q), truth(q, balls).min(axis=1)
        for label, d in zip(labels, true, strict=True):
            if (label, "cloud") in seen:  # one that turns about its own axis stays where it is
                assert seen[label, "cloud"] == pytest.approx(d, abs=1e-12)
    assert len(seen) >= 7


def test_an_arm_among_a_thousand_balls_keeps_clear_of_all_although_a_joint_locks():
    hit, kept = 0, []
    for seed in range(2):
        rng = np.random.default_rng(seed)
        balls = cloud(rng)
        scene = ftqp.Scene()
        way = rng.normal(size=3)
        line = ftqp.paths.Line(
            PANDA.pose(PANDA.neutral), tuple(0.3 * way / np.linalg.norm(way)), duration=2.0
        )
        for seeing in (False, True):
            planner = ftqp.Planner(
                PANDA, 2e-3, scene=scene if seeing else None, emergency=None,
                clearance=ftqp.Clearance(keep=KEEP, stop=0.001) if seeing else None,
            )  # fmt: skip
            if seeing:
                scene.update(balls)
            planner.reset(PANDA.neutral)
            q, v, least = PANDA.neutral.copy(), np.zeros(7), np.inf
            for k in range(1250):
                if k == 300:
                    planner.report(ftqp.Locked(int(rng.integers(7))))
                if seeing and k % 50 == 0:
                    scene.update(balls[rng.permutation(len(balls))])  # as the next picture has them
                at = line.sample(np.array([min(k * 2e-3, 2.0)]))
                target = ftqp.Target(pose=at.pose[0], twist=at.twist[0], acceleration=at.acceleration[0])
                step = planner.step(q, v, target)
                q, v = step.q.copy(), step.v.copy()
                if k % 10 == 0:
                    least = min(least, truth(q, balls).min())
            if seeing:
                kept.append(least)
            else:
                hit += least < 0.0
    assert hit >= 1
    assert min(kept) > KEEP - 5e-3, kept


@pytest.mark.parametrize(
    ("balls", "said"),
    [
        (np.zeros((3, 3)), r"shape \(3, 3\), expected \(K, 4\)"),
        (np.full((2, 4), np.nan), "contains NaN"),
        (np.ones((5000, 4)), "balls are 5000, expected at most 4096"),
        (np.array([[0.0, 0.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.0]]), "ball 1 has the radius 0"),
        ("balls", "balls"),
    ],
)
def test_what_is_no_cloud_is_refused_and_changes_nothing(balls, said):
    scene = ftqp.Scene()
    scene.update([[1.0, 0.0, 0.0, 0.1]])
    with pytest.raises(InputError, match=said):
        scene.update(balls)
    assert scene.balls.tolist() == [[1.0, 0.0, 0.0, 0.1]]
    with pytest.raises(InputError, match="give this another name"):
        scene.add("cloud", ftqp.Sphere(0.1))
