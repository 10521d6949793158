"""Scripts of benchmarks, studies and solvers, run as a user runs them."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def ran(script: str, *arguments: object) -> "subprocess.CompletedProcess[str]":
    """The script, by its path in the repository, after it has ended."""
    command = [sys.executable, str(ROOT / script), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=900, check=False, cwd=ROOT)


def told(script: str, *arguments: object) -> str:
    """What a script that ends well prints."""
    done = ran(script, *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout
