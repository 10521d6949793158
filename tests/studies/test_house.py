"""`studies/house.py` counts what a small tree holds."""

import subprocess
from pathlib import Path

from tests.scripts import told

FILES = {
    "src/ftqp/__init__.py": "",
    "src/ftqp/core/sums.py": "HALF = 0.5\n",
    "src/ftqp/control/planner/planner.py": (
        "from ftqp.control.planner import ways\nfrom ftqp.core.sums import HALF\n"
    ),
    "src/ftqp/control/planner/ways.py": (
        "import ftqp.core.sums\n\nRATE = 2.0 * 3.0\n'''A guess.'''\n"
        "SLOW = -0.1\n'''[1/s]'''\nCOUNT = 3\nNAMES = ('a', 0.5)\n"
    ),
    "tests/core/test_sums.py": "\n\n",
    "studies/one.py": "#\n",
    "docs/page.md": "three words here\n",
    "CHANGELOG.md": "one\n",
}


def test_house_counts_lines_words_imports_and_constants(tmp_path: Path) -> None:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    subprocess.run(["git", "add", "."], cwd=tmp_path, check=True)
    (tmp_path / "src/ftqp/not_followed.py").write_text("\n\n\n")
    lines = told("studies/house.py", "--root", tmp_path).splitlines()
    expected = (
        "| source (src) | 11 | 4 |",
        "| tests | 2 | 1 |",
        "| studies + benchmarks + solvers + bench | 1 | 1 |",
        "| docs and changelog [words] | 4 | 2 |",
        "| what planner.py imports: directly / in all | 2 | 2 |",
        "| files that one other imports alone: core / outside | 1 | 0 |",
        "| tuned constants of kernel, control and faults / called a guess | 2 | 1 |",
        "| control/planner | 10 | 2 |",
        "| tests/core | 2 | 1 |",
    )
    for row in expected:
        assert row in lines, (row, lines)
