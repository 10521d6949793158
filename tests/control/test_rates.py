"""Closed forms without a planner: the same formulas, and one sentence for every wrong argument."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError

rng = np.random.default_rng(0)
J, XDOT = rng.normal(size=(6, 8)), rng.normal(size=6)


def test_pinv_is_numpys_and_locked_joints_keep_their_rates():
    assert ftqp.resolve_rates(J, XDOT) == pytest.approx(np.linalg.pinv(J) @ XDOT, abs=1e-12)
    x = ftqp.resolve_rates(J, XDOT, (1, 4), (0.2, -0.1))
    assert np.array_equal(x[[1, 4]], [0.2, -0.1])
    assert J @ x == pytest.approx(XDOT, abs=1e-12)
    assert np.array_equal(ftqp.resolve_rates(J, XDOT, []), ftqp.resolve_rates(J, XDOT))


def test_weights_and_length_mean_what_they_say():
    w = rng.uniform(0.5, 5.0, 8)
    root = np.diag(1.0 / np.sqrt(w))
    assert ftqp.resolve_rates(J, XDOT, weights=w) == pytest.approx(
        root @ np.linalg.pinv(J @ root) @ XDOT, abs=1e-12
    )
    scale = np.array([0.5] * 3 + [1.0] * 3)
    by_length = ftqp.damping_factor(J, XDOT, 0.1, "row", characteristic_length=2.0)
    assert by_length == pytest.approx(
        ftqp.damping_factor(scale[:, None] * J, scale * XDOT, 0.1, "row"), rel=1e-12
    )


def test_limits_a_joint_scale_the_columns():
    limits = np.array([0.1, 0.2, 0.3, 0.4, 0.1, 0.2, 0.3, 0.4])
    x = ftqp.resolve_rates(J, XDOT, method="dls", damping=ftqp.Damping(rule="exact_inf"), limits=limits)
    assert np.abs(x / limits).max() == pytest.approx(1.0, abs=1e-10)
    kappa = ftqp.damping_factor(J, XDOT, limits, "exact_inf")
    W2 = kappa * np.diag((limits.max() / limits) ** 2)
    assert x == pytest.approx(np.linalg.solve(J.T @ J + W2, J.T @ XDOT), abs=1e-10)


def test_arrays_of_the_caller_are_left_alone_and_results_are_the_callers():
    first = ftqp.resolve_rates(J, XDOT)
    kept = first.copy()
    ftqp.resolve_rates(2.0 * J, XDOT)
    assert np.array_equal(first, kept)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"J": np.ones((7, 8))}, r"J has shape \(7, 8\), expected \(m, n\) with at most 6 rows"),
        ({"J": np.full((6, 8), np.nan)}, "J contains NaN at index 0, 0"),
        ({"locked": ("j2",)}, "locked holds 'j2', but a Jacobian has no joint names"),
        ({"locked": (-1,)}, "locked holds -1"),
        ({"locked": (1, 1)}, "locked holds 1 twice"),
        ({"locked": range(8)}, "all 8 joints are locked; nothing is left to move"),
        ({"method": "dsl"}, r"method is 'dsl' \(did you mean 'dls'\?\), expected one of pinv, dls"),
        ({"method": "dls"}, "method='dls' needs limits"),
        ({"limits": 1.0}, "limits and damping go with method='dls' only"),
        ({"method": "dls", "limits": 0.0}, "the rate limit is 0, expected a finite number > 0 rad/s"),
        ({"method": "dls", "limits": 1.0, "weights": np.ones(8)}, "weights go with method='pinv' only"),
        ({"weights": np.ones(7)}, "weights have 7 entries, expected one a joint: 8"),
    ],
)
def test_wrong_argument_is_refused_with_one_sentence(change, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.resolve_rates(**{"J": J, "xdot": XDOT, **change})
