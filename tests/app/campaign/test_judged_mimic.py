"""An arm whose joints follow others is judged from its file, which says nothing of what the planner folds."""

from pathlib import Path

from tests.telescope import telescope

from ftqp.app.campaign.judged_scenario import broken_laws

SCENARIO = """
[robot]
urdf = "{file}"
tip = "tool"
[planner]
dt = 0.001
task = {{ rows = "position" }}
[start]
q = [0.3, 0.2, 0.12, 0.5, -0.05, 0.2, 0.9, 0.3]
[path]
kind = "circle"
radius = 0.05
duration = 3.0
[[faults]]
kind = "locked"
joint = "elbow"
at = 1.0
"""


def test_an_arm_with_mimic_joints_breaks_no_law_when_one_locks(tmp_path: Path) -> None:
    file = tmp_path / "telescope.urdf"
    file.write_text(telescope(), encoding="utf-8")
    assert broken_laws(SCENARIO.format(file=file)) == {}
