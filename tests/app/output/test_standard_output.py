"""Standard output that is closed, or read by somebody who has had enough."""

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.skipif(sys.platform == "win32", reason="needs a shell that closes standard output")
@pytest.mark.parametrize("arguments", ["schemes", "run panda-circle --out never"])
def test_standard_output_that_is_closed_is_said_before_anything_is_done(
    arguments: str, tmp_path: Path
) -> None:
    command = f'"{sys.executable}" -m ftqp {arguments} >&-'
    result = subprocess.run(command, shell=True, stderr=subprocess.PIPE, text=True, check=False, cwd=tmp_path)
    assert result.returncode == 2 and not list(tmp_path.iterdir())
    assert result.stderr.startswith("error: standard output is closed, expected one for results")


def test_reader_who_has_had_enough_is_no_error() -> None:
    command = [sys.executable, "-m", "ftqp", "check", "--keys"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as begun:
        assert begun.stdout is not None and begun.stderr is not None
        begun.stdout.close()
        assert b"Traceback" not in begun.stderr.read()
