"""A load at the tip, as a part of the body that moves with it."""

from typing import Any

from ftqp.kernel.arm.joined_bodies import join
from ftqp.kernel.jit import jit


@jit
def load(chain: Any, given: Any, payload: Any) -> None:
    """The body at the tip with a load instead of the last one; mass 0 is none.

    The load's own inertia, R I R' along the axes of the body, is added to what its mass makes of the body's;
    of its principal moments none is larger than half their sum.
    """
    body, R, t, c = given.body, given.tip_rotation, given.tip_translation, payload.com
    join(
        chain, body, given.body_mass, given.body_com, given.body_inertia, given.body_stoutness, payload.mass,
        t[0] + R[0] * c[0] + R[1] * c[1] + R[2] * c[2],
        t[1] + R[3] * c[0] + R[4] * c[1] + R[5] * c[2],
        t[2] + R[6] * c[0] + R[7] * c[1] + R[8] * c[2],
    )  # fmt: skip
    I, own = payload.inertia, chain.inertia[body]
    k = 0
    for r in range(3):
        for s in range(r, 3):
            for a in range(3):
                for b in range(3):
                    own[k] += R[3 * r + a] * I[3 * a + b] * R[3 * s + b]
            k += 1
    chain.stoutness[body] += 0.5 * (I[0] + I[4] + I[8])


@jit
def carry(K: Any, A: Any, given: Any, payload: Any) -> None:
    """The arm by itself and the record's with a load; what was learned of it before is learned anew."""
    load(A.chain, given, payload)
    learned, chain = K.learned, K.chain
    if learned.based:
        for i in range(chain.n):
            chain.armature[i] = learned.base_armature[i]
    load(chain, given, payload)
    learned.based = 0
    for k in range(4):
        learned.load[k] = 0.0
