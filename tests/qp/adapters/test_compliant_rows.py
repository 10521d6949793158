"""Slacks of a planner's QP are recognised by their structure."""

import numpy as np
from planted import buffers, compliant, planted

from ftqp.qp.adapters.polished_backend import compliance


def test_slacks_are_recognised_and_nothing_else_is():
    qp = buffers(compliant(1, soft=1e-6))
    np.testing.assert_allclose(compliance(qp), 1e-6)
    for part, at in (("g", 8), ("lb", 9), ("A", (0, 8)), ("H", (8, 9))):
        changed = buffers(compliant(1, soft=1e-6))
        getattr(changed, part)[at] = 0.5
        assert compliance(changed) is None, part
    assert compliance(buffers(planted(np.random.default_rng(1)).problem)) is None
