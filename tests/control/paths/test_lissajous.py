import numpy as np

from ftqp.control.paths import Lissajous


def test_whole_cycles_close_the_figure(start):
    end = Lissajous(start, (0.1, 0.07), duration=5.0, cycles=(3, 2), phase=0.7).sample(5.0).pose[0]
    np.testing.assert_allclose(end, start, atol=1e-15)


def test_figure_stays_inside_its_amplitudes(start):
    pose = Lissajous(start, (0.1, 0.05), duration=5.0).sample(np.linspace(0, 5, 999)).pose
    way = pose[:, :3, 3] - start[:3, 3]
    np.testing.assert_allclose(np.abs(way).max(axis=0), [0.1, 0.05, 0.0], atol=1e-5)
