"""A kind of task and of constraint that one file and one line add work everywhere or are refused."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("own")
    done = subprocess.run(
        [sys.executable, "-P", "-W", "ignore", "-m", "tests.laws.stranger_task", str(folder)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT / "src"), str(ROOT)))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, (done.stdout + done.stderr)[-4000:]
    return json.loads(done.stdout.splitlines()[-1])


def test_a_scenario_has_them_with_their_settings_and_the_usual_kind_needs_no_word(found):
    assert "distance = 0.47" in found["check"] and 'kind = "speed_of"' in found["check"]
    assert "distanc" in found["wrong key"] and "did you mean" in found["wrong key"]
    assert "weight of Distance is -1" in found["wrong"]


def test_a_run_does_what_they_ask_logs_it_and_says_it(found):
    assert found["columns"] == ["task_error.Distance", "distance.panda_joint4", "distance.SpeedOf"]
    assert found["units"] == ["m", "m", "rad"]
    assert found["error"] < 0.02 and found["fastest"] < 0.0501
    assert found["summary"]["tasks"]["Distance"]["unit"] == "m"
    tasks, constraints = found["metadata"]
    assert tasks[0]["kind"] == "distance" and tasks[0]["distance"] == 0.47
    assert {one["kind"] for one in constraints} == {"rows", "plane"}
    assert "Distance" in found["run"] and "report.html" in found["report"] and found["names it"]


def test_they_work_in_a_step_and_batches_refuse_them_in_a_sentence(found):
    assert found["step"] == ["OK", None, ["SpeedOf"]]
    live, kept, truth = found["own error"]
    assert live == kept == truth and truth[0] > 0.0
    both = "InputError: task 'Distance', constraint 'SpeedOf' ask a Python function in every step, which"
    assert found["batch"] == f"{both} a batch does not; make a planner without them"
    assert found["library"] == f"{both} a library in C does not; leave them out"
    assert found["ahead"].startswith("InputError: n_minus_one looks ahead in a batch: task 'Distance' asks")
    assert "frame is 'nose'" in found["frame"]


def test_the_page_shows_them(found):
    shown = {name: (value, has_place) for name, value, has_place in found["page"]}
    assert shown["Distance"][1] and shown["Distance"][0] < 0.2 and "SpeedOf" in shown
