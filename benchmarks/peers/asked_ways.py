"""A motion planner answers questions for ways from its own environment, over its standard input and output.

A question is a line of JSON: the boxes and cylinders around, a start, a goal posture, and which joints stand
still. The answer is one, too: the places of the way, none if there is no way, and the seconds of the
processor until it was there.
"""

import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
from steps.environments import Peer, python_of

HERE = Path(__file__).resolve().parents[1]
MESHES = ("pin==4.*", "coal==3.*", "example-robot-data==4.*", "numpy")
ROBOPLAN = Peer(
    name="roboplan",
    module="peers.with_roboplan",
    packages=("roboplan-rrt==0.7.*", "roboplan-core==0.7.*", *MESHES),
)
OMPL = Peer(name="ompl", module="peers.with_ompl", packages=("ompl==2.0.*", *MESHES))
LONGEST = 5.0
"""So long a peer may think about one question [s]."""


class AskedPlanner:
    """A motion planner that runs beside.

    Args:
        peer: Which.
        environments: Where those of peers are.

    Raises:
        NotInstalled: Its environment cannot be made.
    """

    def __init__(self, peer, environments):
        python = python_of(peer, environments)
        self._program = subprocess.Popen(
            [str(python), "-m", peer.module], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": str(HERE)}, text=True,
            start_new_session=True,  # Ctrl-C is for the script alone
        )  # fmt: skip
        self.versions = self._answer()

    def ask(self, bodies, start, goal, failed=()):
        """The places of a way, (k, n), or None, and the seconds of the processor."""
        question = [bodies, list(start), list(goal), list(failed)]
        self._program.stdin.write(json.dumps(question) + "\n")
        self._program.stdin.flush()
        places, seconds = self._answer()
        return (np.array(places) if places else None), seconds

    def _answer(self):
        line = self._program.stdout.readline()
        if not line:
            raise SystemExit("a planner ended in the middle of a run; start its script by hand to see why")
        return json.loads(line)

    def close(self):
        """Let the program end."""
        self._program.stdin.close()
        self._program.wait()


def answer_all(ask, packages):
    """Answer the questions of the standard input; ``ask`` takes one and gives places and seconds."""
    print(json.dumps({name: version(name) for name in packages}), flush=True)
    for line in sys.stdin:
        bodies, start, goal, failed = json.loads(line)
        places, seconds = ask(bodies, np.array(start), np.array(goal), failed)
        print(json.dumps([None if places is None else np.asarray(places).tolist(), seconds]), flush=True)
