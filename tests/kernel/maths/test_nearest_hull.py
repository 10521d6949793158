"""Nearest points of a segment and a hull: against coal, a linear program and the laws of a distance."""

from types import SimpleNamespace

import coal
import numpy as np
import pytest
from scipy.optimize import linprog

from ftqp.checker.link_shapes import hull_of_corners
from ftqp.kernel.maths.nearest_hull import of_segment_and_hull
from ftqp.model.collision_geometry import hull_of

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
    t, d, *n = of_segment_and_hull(room(name), 0, p, u)
    assert 0.0 <= t <= 1.0 and np.linalg.norm(n) == pytest.approx(1.0)
    return t, d, np.array(n)


@pytest.mark.parametrize("name", HULLS)
def test_a_capsule_beside_a_hull_is_as_far_as_coal_says(name):
    rng, body, request, compared = np.random.default_rng(3), None, coal.DistanceRequest(), 0
    request.gjk_tolerance, body = 1e-12, hull_of_corners(HULLS[name].corners)
    for _ in range(300):
        p, u = rng.normal(size=3) * 0.5, rng.normal(size=3) * 0.4
        length = float(np.linalg.norm(u))
        z = u / length
        x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
        x /= np.linalg.norm(x)
        R, result = np.column_stack([x, np.cross(z, x), z]), coal.DistanceResult()
        far = coal.distance(
            coal.Capsule(0.01, length), coal.Transform3s(R, p + 0.5 * u),
            body, coal.Transform3s(np.eye(3), np.zeros(3)), request, result,
        )  # fmt: skip
        if far > 1e-3:
            compared += 1
            assert nearest(name, p, u)[1] - 0.01 == pytest.approx(far, abs=1e-9)
    assert compared > 100


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


def test_a_segment_along_a_face_is_nearest_in_its_middle():
    t, d, n = nearest("wedge", np.array([0.0, 0.0, -0.2]), np.array([0.1, 0.05, 0.0]))
    assert t == 0.5 and d == pytest.approx(0.1)
    np.testing.assert_allclose(n, [0.0, 0.0, -1.0], atol=1e-12)
