"""The study of what leads after a lock: its three leaders."""

from types import SimpleNamespace

import numpy as np
from study_followed_plans import Led


def test_each_leader_gives_its_own_postures():
    q = np.arange(12.0).reshape(6, 2)
    plan = SimpleNamespace(q=q, t=0.5 * np.arange(6), continuation=lambda *_: (3, q[3:] + 1.0))
    assert Led(plan, "plan").continuation(q[2], 1.5, ()) is None
    assert np.array_equal(Led(plan, "continuation").continuation(q[2], 1.5, ())[1], q[3:] + 1.0)
    first, rows = Led(plan, "posture at the lock").continuation(q[2], 1.5, ())
    assert first == 3 and np.array_equal(rows, np.tile(q[2], (3, 1)))
    assert np.array_equal(Led(plan, rows=q + 1.0).q, q + 1.0)
