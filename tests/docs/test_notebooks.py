"""The notebooks are those that are made, and run."""

import json
import subprocess
import sys

import pytest
from tests.docs.making import ROOT, module

for name in ("nbclient", "ipykernel"):
    pytest.importorskip(name, reason=f'needs {name}: pip install -e ".[dev]"')
FILES = sorted((ROOT / "notebooks").glob("*.ipynb"))


def cells(file):
    return json.loads(file.read_text(encoding="utf-8"))["cells"]


def test_each_notebook_is_as_it_is_made():
    known = module("notebooks").NOTEBOOKS
    assert [file.stem for file in FILES] == sorted(known) and len(FILES) == 6
    for file in FILES:
        assert ["".join(cell["source"]) for cell in cells(file)] == list(known[file.stem])


def test_each_has_run_without_an_error_and_shows_something():
    pictures = 0
    for file in FILES:
        outputs = [output for cell in cells(file) for output in cell.get("outputs", [])]
        assert outputs and not [one for one in outputs if one["output_type"] == "error"], file.name
        pictures += sum("image/png" in one.get("data", {}) for one in outputs)
        assert file.stat().st_size < 400_000
        assert not any(place in file.read_text(encoding="utf-8") for place in (str(ROOT), "/tmp/"))
    assert pictures >= 4


@pytest.mark.slow
@pytest.mark.parametrize("number", [f"0{k}" for k in range(1, 7)])
def test_it_runs(number):
    command = [sys.executable, "-W", "ignore", "docs/making/notebooks.py", "--check", number]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0 and "runs" in done.stdout, done.stderr[-2000:]
