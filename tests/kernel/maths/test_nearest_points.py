"""Nearest points of segments and bodies: against a minimiser, coal and the laws of a distance."""

from types import SimpleNamespace

import coal
import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from ftqp.checker.model_file import hull_of_corners
from ftqp.kernel.layout.scene_room import BOX, CYLINDER, HALF_SPACE
from ftqp.kernel.maths.nearest_points import of_segment_and_body, of_segment_and_hull, of_segments, to_body
from ftqp.model.collision_geometry import hull_of

EXTENTS = {BOX: (0.3, 0.1, 0.2), CYLINDER: (0.25, 0.12, 0.0), HALF_SPACE: (0.0, 0.0, 0.0)}


def gap(ends, s, t):
    a, b, c, d = ends
    return float(np.linalg.norm(a + s * (b - a) - c - t * (d - c)))


@pytest.mark.parametrize("seed", range(16))
def test_segments_are_nearest_where_a_minimiser_says(seed):
    rng = np.random.default_rng(seed)
    ends = rng.normal(size=(4, 3)) * rng.choice([0.05, 0.3, 1.0], size=(4, 1))
    if seed % 4 == 0:
        ends[1] = ends[0]  # a point
    if seed % 8 == 1:
        ends[3] = ends[2] + 0.7 * (ends[1] - ends[0])  # parallel
    s, t = of_segments(*ends)
    best = min(
        minimize(lambda x: gap(ends, *x), start, bounds=[(0, 1), (0, 1)], tol=1e-15).fun
        for start in ((0.1, 0.9), (0.9, 0.1), (0.5, 0.5), (0.0, 0.0), (1.0, 1.0))
    )
    assert 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0
    assert gap(ends, s, t) <= best + 1e-12


def test_parallel_segments_meet_in_the_middle_of_their_overlap():
    a, b = np.zeros(3), np.array([1.0, 0.0, 0.0])
    s, t = of_segments(a, b, np.array([0.4, 0.2, 0.0]), np.array([1.8, 0.2, 0.0]))
    assert s == pytest.approx(0.7) and t == pytest.approx(0.3 / 1.4)
    assert of_segments(a, b, np.array([2.0, 0.1, 0.0]), np.array([3.0, 0.1, 0.0])) == (1.0, 0.0)


def nearest_on(kind, p, u):
    t = of_segment_and_body(kind, EXTENTS[kind], p, u)
    assert 0.0 <= t <= 1.0
    return t, to_body(kind, EXTENTS[kind], p + t * u)[0]


def as_coal_says(body, radius, distance):
    """Whether the distance of segments (p, u) from a body is that of coal, less the radius of a capsule."""
    rng, request, compared = np.random.default_rng(3), coal.DistanceRequest(), 0
    request.gjk_tolerance = 1e-12
    for _ in range(300):
        p, u = rng.normal(size=3) * 0.5, rng.normal(size=3) * 0.4
        length = float(np.linalg.norm(u))
        z = u / length
        x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
        x /= np.linalg.norm(x)
        R, result = np.column_stack([x, np.cross(z, x), z]), coal.DistanceResult()
        far = coal.distance(
            coal.Capsule(radius, length), coal.Transform3s(R, p + 0.5 * u),
            body, coal.Transform3s(np.eye(3), np.zeros(3)), request, result,
        )  # fmt: skip
        if far > 1e-3:
            compared += 1
            assert distance(p, u) - radius == pytest.approx(far, abs=1e-9)
    return compared > 100


@pytest.mark.parametrize(
    ("kind", "body"), [(BOX, coal.Box(0.6, 0.2, 0.4)), (CYLINDER, coal.Cylinder(0.12, 0.5))]
)
def test_a_capsule_beside_a_body_is_as_far_as_coal_says(kind, body):
    assert as_coal_says(body, 0.05, lambda p, u: nearest_on(kind, p, u)[1])


@pytest.mark.parametrize("kind", [BOX, CYLINDER, HALF_SPACE])
def test_no_point_of_a_segment_is_nearer_inside_and_outside(kind):
    rng = np.random.default_rng(4)
    for _ in range(200):
        p, u = rng.normal(size=3) * 0.3, rng.normal(size=3) * 0.4
        shares = np.linspace(0.0, 1.0, 201)
        least = min(to_body(kind, EXTENTS[kind], p + t * u)[0] for t in shares)
        assert nearest_on(kind, p, u)[1] <= least + 1e-10


@pytest.mark.parametrize("kind", [BOX, CYLINDER])
def test_the_distance_grows_along_its_direction(kind):
    rng, h = np.random.default_rng(5), 1e-7
    for _ in range(200):
        p, w = rng.normal(size=3) * 0.4, rng.normal(size=3)
        d, n = to_body(kind, EXTENTS[kind], p)
        after = to_body(kind, EXTENTS[kind], p + h * w)[0]
        assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-12)
        assert (after - d) / h == pytest.approx(float(n @ w), abs=2e-4)


def test_a_segment_along_a_face_is_nearest_in_its_middle():
    t, d = nearest_on(BOX, np.array([-0.2, 0.0, 0.3]), np.array([0.4, 0.0, 0.0]))
    assert t == pytest.approx(0.5, abs=1e-6) and d == pytest.approx(0.1)
    assert of_segment_and_body(BOX, EXTENTS[BOX], np.zeros(3), np.zeros(3)) == 0.0


WEDGE = np.array([[0, 0, 0], [0.4, 0, 0], [0, 0.3, 0], [0.4, 0.3, 0], [0, 0, 0.2], [0, 0.3, 0.2]]) - 0.1
BALL = np.random.default_rng(1).normal(size=(40, 3)) * [0.2, 0.15, 0.1]
HULLS = {"wedge": hull_of(WEDGE), "stone": hull_of(BALL), "simplex": hull_of(BALL[:4])}


def room(name):
    corners, edges, faces = HULLS[name]
    return SimpleNamespace(
        corner=corners, edge=edges, face=faces, edges_of=np.array([[0, len(edges)]]),
        faces_of=np.array([[0, len(faces)]]),
    )  # fmt: skip


def nearest(name, p, u):
    t, d, n = of_segment_and_hull(room(name), 0, p, u)
    assert 0.0 <= t <= 1.0 and np.linalg.norm(n) == pytest.approx(1.0)
    return t, d, np.array(n)


@pytest.mark.parametrize("name", HULLS)
def test_a_capsule_beside_a_hull_is_as_far_as_coal_says(name):
    assert as_coal_says(hull_of_corners(HULLS[name].corners), 0.01, lambda p, u: nearest(name, p, u)[1])


@pytest.mark.parametrize("name", HULLS)
def test_inside_a_hull_a_segment_is_as_deep_as_a_linear_program_says(name):
    rng, faces, inside = np.random.default_rng(4), HULLS[name].faces, 0
    for _ in range(200):
        p, u = rng.normal(size=3) * 0.1, rng.normal(size=3) * 0.3
        rows = np.column_stack([faces[:, :3] @ u, -np.ones(len(faces))])  # height of p + t u above each <= h
        best = linprog([0.0, 1.0], rows, faces[:, 3] - faces[:, :3] @ p, bounds=[(0, 1), (None, None)])
        t, d, n = nearest(name, p, u)
        if best.fun > -1e-9:
            continue
        inside += 1
        assert d == pytest.approx(best.fun, abs=1e-12)
        assert n @ (p + t * u) - d == pytest.approx((HULLS[name].corners @ n).max(), abs=1e-9)
    assert inside > 5


@pytest.mark.parametrize("name", HULLS)
def test_the_distance_goes_on_where_a_segment_enters_and_grows_along_its_normal(name):
    rng, corners = np.random.default_rng(5), HULLS[name].corners
    for _ in range(100):
        p, u = rng.normal(size=3) * 0.4, rng.normal(size=3) * 0.3
        _, d, n = nearest(name, p, u)
        if d > 1e-6:  # outside the normal is that of the plane that parts them
            assert min(n @ p, n @ (p + u)) - (corners @ n).max() == pytest.approx(d, abs=1e-9)
        for h in (1e-7, -1e-7):
            assert abs(nearest(name, p + h * n, u)[1] - d) <= 1e-7 + 1e-12


def test_a_segment_along_a_face_of_a_hull_is_nearest_in_its_middle():
    t, d, n = nearest("wedge", np.array([0.0, 0.0, -0.2]), np.array([0.1, 0.05, 0.0]))
    assert t == 0.5 and d == pytest.approx(0.1)
    np.testing.assert_allclose(n, [0.0, 0.0, -1.0], atol=1e-12)
