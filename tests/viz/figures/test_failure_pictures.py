"""Pictures of motions after failures."""

import numpy as np

from ftqp.viz.figures.failure_pictures import SignPanel, draw_basins, draw_error_signs, draw_motions


def is_picture(path):
    return path.read_bytes()[:4] == b"\x89PNG" and path.stat().st_size > 10_000


def test_motions_are_drawn_and_one_that_stands_still_too(tmp_path):
    t, q = np.linspace(0.0, 5.0, 30), np.linspace([0.1, 0.2, 0.3], [1.0, 0.2, -0.4], 30)
    still = np.tile(q[0], (30, 1))
    motions = {"moves": (t, q, np.exp(-t)), "stands": (t, still, np.full(30, 0.5))}
    assert is_picture(draw_motions(tmp_path / "m.png", "way", np.ones(3), motions, np.array([1.5, 1.5])))


def test_basins_are_drawn_with_ways_that_leave_the_square(tmp_path):
    angles = -np.pi + 2.0 * np.pi * (np.arange(20) + 0.5) / 20
    label = np.zeros((20, 20), np.int64)
    label[:5], label[5:7], label[7:8] = 1, -1, -2
    way = np.linspace([0.0, 0.0], [9.0, -7.0], 200)
    ends = np.array([[0.5, 0.5], [-1.0, 2.0]])
    path = draw_basins(
        tmp_path / "b.png", "basins", ("j1", "j3"), angles, label, ends, ("correct", "erroneous"),
        np.array([[2.0, 2.0]]), [way],
    )  # fmt: skip
    assert is_picture(path)


def test_signs_of_an_error_are_drawn(tmp_path):
    phi = theta = np.linspace(-np.pi, np.pi, 41)
    rest = np.sin(phi)[:, None] - np.sin(theta)[None, :]
    panel = SignPanel(phi=phi, theta=theta, falls=rest > 0, rate=rest, rest=rest, taken_in=np.abs(phi) < 1.0)
    assert is_picture(draw_error_signs(tmp_path / "s.png", "signs", {"one": panel}))
