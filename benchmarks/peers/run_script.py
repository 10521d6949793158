"""A script of this folder along cases, in the environment of its peer."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from steps.environments import PEERS, python_of

from peers.motion_case import write

HERE = Path(__file__).resolve().parents[1]


def run_script(script: str, way: str, peer: str | None, cases, folder: Path, environments: Path):
    """Joints, times, errors and versions of a program along cases.

    Args:
        script: Of this folder.
        way: Its third argument.
        peer: Whose environment it needs; None is this one.
        cases: The cases.
        folder: Where they are exchanged.
        environments: Where those of peers are.

    Raises:
        NotInstalled: Its environment cannot be made.
    """
    python = Path(sys.executable)
    if peer is not None:
        python = python_of(next(one for one in PEERS if one.name == peer), environments)
    given, out = folder / "cases.json", folder / "done.npz"
    write(cases, given)
    path = os.pathsep.join([str(HERE), str(HERE.parent / "src")])
    done = subprocess.run(
        [str(python), "-m", f"peers.{script}", str(given), str(out), way],
        env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(f"{script} {way} failed:\n{done.stderr[-2000:]}")
    with np.load(out) as data:
        return (
            [data[f"q_{i}"] for i in range(len(cases))],
            data["us"],
            data["failed"],
            json.loads(str(data["versions"])),
        )
