"""Other units pose the same QP."""

import numpy as np
from planted import buffers, compliant

from ftqp.qp import Claim, backend
from ftqp.qp.adapters.polished_backend import EasedQP, compliance


def test_other_units_pose_the_same_qp():
    qp = buffers(compliant(3, 1e-5, 20.0))
    eased = EasedQP(10, 3, 0)
    qp.upper[10:13] = qp.b
    eased.pose(qp, compliance(qp))
    exact = backend("active_set")
    exact.setup(eased.buffers)
    assert exact.solve(cold=True) is Claim.SOLVED
    eased.answer(qp)
    answer = qp.solution.copy()
    exact.setup(qp)
    exact.solve(cold=True)
    np.testing.assert_allclose(answer, qp.solution, rtol=1e-8, atol=1e-8)
    assert np.abs(eased.buffers.y).max() < 1e3 < np.abs(qp.y).max()
    np.testing.assert_allclose(eased.soft, compliance(eased.buffers))
