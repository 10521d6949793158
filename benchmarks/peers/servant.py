"""A peer leads an arm from its own environment, tick by tick, over its standard input and output.

The first line it reads is a `Charge` as JSON, and it answers with its versions, also a line. A tick then is
q measured, pose, twist and which joints are known to be locked, as doubles; the answer is q and v to send and
whether the program found a solution. It needs numpy only.
"""

import json
import sys
from dataclasses import asdict, dataclass
from importlib.metadata import version

import numpy as np

from peers.motion_case import read, run_all, turn, vector_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Charge:
    """What a peer is to lead.

    Attributes:
        urdf: The arm, as text.
        tip: The frame that moves.
        joints: Names from base to tip, (n,).
        q: Where they are, at rest, (n,).
        limits: q_min, q_max, v_max and a_max, (4, n).
        dt: Sampling period [s].
        gain: Feedback of the tip's error [1/s].
        length: What one radian of the tip's error weighs as [m].
        fed_back: Whether it solves at the measured joints, or at its own integral as examples do.
        rods: The arm's bodies as in `MotionCase`.
        box: Edges and middle of a box in the way, (6,), or nothing.
        keep: How far to stay away from it [m].
    """

    urdf: str
    tip: str
    joints: list
    q: list
    limits: list
    dt: float
    gain: float
    length: float
    fed_back: bool
    rods: list
    box: list
    keep: float

    def line(self) -> bytes:
        """As one line."""
        return (json.dumps(asdict(self)) + "\n").encode()


def aimed(T, pose, twist, gain: float, dt: float):
    """Where the tip at T should be one tick later: the target's twist and gain times the error, for dt."""
    aim = T.copy()
    aim[:3, 3] += dt * (twist[:3] + gain * (pose[:3, 3] - T[:3, 3]))
    aim[:3, :3] = turn(dt * (twist[3:] + gain * vector_of(pose[:3, :3] @ T[:3, :3].T))) @ T[:3, :3]
    return aim


def serve(make, packages) -> None:
    """Answer ticks until the input ends.

    Args:
        make: From a `Charge` to ``velocity(q, pose, twist, failed, v)``, the joints' next speeds, (n,), where
            v is what was sent last, or None where the program found none.
        packages: Whose versions are told.
    """
    given, told = sys.stdin.buffer, sys.stdout.buffer
    charge = Charge(**json.loads(given.readline()))
    velocity = make(charge)
    told.write((json.dumps({name: version(name) for name in packages}) + "\n").encode())
    told.flush()
    n = len(charge.joints)
    low, high, _, _ = (np.array(row) for row in charge.limits)
    q, v = np.array(charge.q), np.zeros(n)
    size = 8 * (2 * n + 22)
    while len(tick := given.read(size)) == size:
        measured, T, twist, flags = np.split(np.frombuffer(tick), (n, n + 16, n + 22))
        failed = flags > 0.0
        v[failed] = 0.0
        q[failed] = measured[failed]
        at = np.clip(measured if charge.fed_back else q, low, high)
        found = velocity(at, T.reshape(4, 4), twist, failed, v.copy())
        change = np.where(failed, 0.0, (np.zeros(n) if found is None else found) - v)
        change /= max(1.0, float(np.max(np.abs(change) / (np.array(charge.limits[3]) * charge.dt))))
        to = np.clip(q + charge.dt * (v + change), low, high)
        v, q = (to - q) / charge.dt, to
        told.write(np.concatenate([q, v, [float(found is None)]]).tobytes())
        told.flush()


def main(of_case, of_charge, packages) -> None:
    """Lead an arm with ``serve``, else go along cases; what makes a step gets a case and the way of going."""
    if sys.argv[1:] == ["serve"]:
        serve(of_charge, packages)
    else:
        given, out, way = sys.argv[1:]
        run_all(lambda case: of_case(case, way), read(given), out, {name: version(name) for name in packages})
