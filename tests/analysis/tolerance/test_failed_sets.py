"""What is left of an arm without some joints."""

import numpy as np
import pytest

from ftqp.analysis.tolerance import null_vector, relative_manipulability, velocity_jump, worst_case
from ftqp.core.errors import InputError

RANDOM = np.random.default_rng(3).normal(size=(300, 6, 7))


def manipulability(J):
    return np.sqrt(np.linalg.det(J @ np.swapaxes(J, -1, -2)))


def test_relative_manipulability_is_the_ratio_of_both() -> None:
    share = relative_manipulability(RANDOM)
    for j in range(7):
        without = manipulability(np.delete(RANDOM, j, axis=2))
        assert np.allclose(share[:, j], without / manipulability(RANDOM))
    assert np.allclose(share, np.abs(null_vector(RANDOM)))
    wide = RANDOM[:, :4]
    pairs = [(0, 1), (2, 5), (1, 3, 6)]
    for share, failed in zip(relative_manipulability(wide, pairs).T, pairs, strict=True):
        assert np.allclose(share, manipulability(np.delete(wide, failed, axis=2)) / manipulability(wide))
    assert (relative_manipulability(RANDOM, [(0, 1)]) == 0.0).all()


def test_worst_case_is_at_most_that_of_equal_entries() -> None:
    assert (worst_case(RANDOM) <= 1.0 / np.sqrt(7.0)).all()
    assert (worst_case(RANDOM[:, :4]) <= np.sqrt(3.0 / 7.0)).all()
    assert (worst_case(RANDOM, [(2,)]) == relative_manipulability(RANDOM)[:, 2]).all()


def test_singular_values_without_a_joint_interlace() -> None:
    sigma = np.linalg.svd(RANDOM, compute_uv=False)[:, -1]
    share = relative_manipulability(RANDOM)
    for j in range(7):
        without = np.linalg.svd(np.delete(RANDOM, j, axis=2), compute_uv=False)[:, -1]
        assert (share[:, j] * sigma <= without * (1 + 1e-9)).all() and (without <= sigma * (1 + 1e-9)).all()


def test_jump_stops_the_joint_and_keeps_the_task() -> None:
    rng = np.random.default_rng(5)
    for J in (*RANDOM[:20], *RANDOM[:20, :4]):
        v, j = rng.normal(size=7), int(rng.integers(7))
        jump = velocity_jump(J, v, j)
        assert abs(v[j] + jump[j]) < 1e-9 and np.abs(J @ jump).max() < 1e-9
        assert np.isclose(np.linalg.norm(jump), abs(v[j]) / relative_manipulability(J)[j], rtol=1e-8)
        if len(J) == 6:
            assert np.allclose(jump, -v[j] / null_vector(J)[j] * null_vector(J), atol=1e-8)


def test_joint_that_is_needed_has_no_jump_unless_it_stands() -> None:
    J = np.eye(3, 4)
    assert np.isinf(velocity_jump(J, (1.0, 0.0, 0.0, 0.0), 0)).all()
    assert (velocity_jump(J, (0.0, 1.0, 0.0, 0.0), 0) == 0.0).all()


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: relative_manipulability(RANDOM, [()]), "the set"),
        (lambda: relative_manipulability(RANDOM, [(7,)]), "from 0 to 6"),
        (lambda: velocity_jump(RANDOM, np.zeros(7), 0), r"expected \(m, n\)"),
        (lambda: velocity_jump(RANDOM[0], np.zeros(6), 0), r"v has shape \(6,\)"),
        (lambda: worst_case(np.ones((3, 2))), "as many columns as rows"),
    ],
)
def test_wrong_sets_and_shapes_are_refused(call, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        call()
