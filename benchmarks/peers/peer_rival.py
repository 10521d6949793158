"""A peer in its own environment as the rival of a run."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
from steps.environments import PEERS, Peer, python_of

import ftqp
from peers.servant import Charge

HERE = Path(__file__).resolve().parents[1]
OINK = Peer(name="oink", module="peers.with_oink", packages=("roboplan-oink==0.7.*", "numpy"))
"""roboplan's OInK, which leads an arm only here."""


class PeerRival:
    """Leads an arm by a program that runs beside, and is what `ftqp.sim.rival.ride` asks for.

    Args:
        peer: Its name.
        robot: The arm.
        charge: What it is told at first.
        environments: Where those of peers are.

    Raises:
        NotInstalled: Its environment cannot be made.
    """

    def __init__(self, peer: str, robot: ftqp.Robot, charge: Charge, environments: Path) -> None:
        python = python_of(next(one for one in (*PEERS, OINK) if one.name == peer), environments)
        path = os.pathsep.join([str(HERE), str(HERE.parent / "src")])
        self._program = subprocess.Popen(
            [str(python), "-m", f"peers.with_{peer}", "serve"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": path},
        )  # fmt: skip
        self._robot = robot
        self._failed = np.zeros(robot.nv)
        self.brakes, self.tau = np.zeros(robot.nv, dtype=np.bool_), np.zeros(robot.nv)
        self.unsolved = 0
        self._program.stdin.write(charge.line())
        self._program.stdin.flush()
        self.versions = json.loads(self._program.stdout.readline() or b"{}")

    def reset(self, q, v=None) -> None:
        """Begin at q, (nv,), at rest; the program was told so when it was started."""
        self.q, self.v = np.array(q, dtype=float), np.zeros(self._robot.nv)

    def tell(self, joint) -> None:
        """From now on that joint is known to be locked."""
        self._failed[self._robot.joint(joint)] = 1.0

    def step(self, q, pose, twist) -> "PeerRival":
        """One tick; the command is what the rival then holds."""
        n = self._robot.nv
        self._program.stdin.write(np.concatenate([q, np.ravel(pose), twist, self._failed]).tobytes())
        self._program.stdin.flush()
        answer = np.frombuffer(self._program.stdout.read(8 * (2 * n + 1)))
        if len(answer) != 2 * n + 1:
            raise SystemExit("a peer ended in the middle of a run; start its script by hand to see why")
        self.q, self.v = answer[:n], answer[n : 2 * n]
        self.unsolved += int(answer[-1])
        return self

    def __enter__(self) -> "PeerRival":
        return self

    def __exit__(self, *_) -> None:
        self._program.stdin.close()
        self._program.stdout.close()
        self._program.wait()
