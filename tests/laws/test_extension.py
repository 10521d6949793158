"""A stranger adds a kind of fault, rows, a criterion, tasks and constraints, and they hold everywhere."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import ftqp
from ftqp.core.errors import InputError
from ftqp.faults import kinds
from ftqp.kernel.layout.criteria import Criterion, _coefficient

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
REFUSES = (
    "planner", "batch", "kinematic plant", "servo plant", "mujoco plant", "simulation", "scenario",
    "campaign", "coverage", "session", "session that plays", "ftqp run", "ftqp compare", "ftqp campaign",
    "replay", "figures", "summary",
)  # fmt: skip
"""Who has to say that he cannot serve a kind of fault that nobody wrote a case for."""


CAP = '''"""A cap on the speed of every joint."""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import HEALTHY, VELOCITY


@jit
def fill(K: Any, at: int) -> int:
    """-0.05 <= v + dt a <= 0.05, one row a joint from row ``at`` of C on; the next free row."""
    n, qp, state = K.chain.n, K.qp, K.state
    for i in range(n):
        qp.C[at + i, : n + 1] = 0.0
        if K.faults.code[i] != HEALTHY:
            qp.l[at + i], qp.u[at + i] = -inf, inf
            continue
        qp.C[at + i, i] = 1.0
        v, per = (0.0, 1.0) if state.level == VELOCITY else (state.v[i], state.dt)
        qp.l[at + i], qp.u[at + i] = (-0.05 - v) / per, (0.05 - v) / per
    return at + n
'''
"""A kind of rows as a stranger writes it."""


def said_by(*command, source=ROOT / "src"):
    """What a process says as JSON in its last line."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", *map(str, command)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(source), str(ROOT)))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, (done.stdout + done.stderr)[-4000:]
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.long
@pytest.mark.parametrize("how", ["registered", pytest.param("unheard", marks=pytest.mark.slow)])
def test_kind_of_fault_without_a_case_is_refused_by_every_consumer(how, tmp_path):
    for package in ("mujoco", "matplotlib", "rosbags", "viser"):
        pytest.importorskip(package, reason="every consumer needs its extra: pip install 'ftqp[dev]'")
    found = said_by(HERE / "stranger_kind.py", tmp_path, how)
    assert set(REFUSES) <= set(found)
    for who in REFUSES:
        said = found[who]
        assert "SILENT" not in said and "RAISED" not in said and "KeyError" not in said, (who, said)
        remedy = r"does not serve a joint that sticks .*CONTRIBUTING|expected|it has locked, free_swinging"
        assert re.search(remedy, said, re.DOTALL), (who, said)
        assert re.search("[Ss]tick|Unheard|in condition 9", said), (who, said)
    if how == "unheard":
        return
    assert "is not a kind of failure of the checker; it has locked, free, degraded" in found["checker"]
    shown = found["shown"]
    assert shown["described"]["kind"] == shown["condition"] == shown["button"] == "sticky"
    assert shown["words"] == "j2 sticks at 0.05 s; nobody reports it"
    assert shown["colours"] == ["#112233", "#445566"]
    assert all(shown[name] for name in ("moved", "figures", "page", "legend", "bag"))


def test_kind_that_leaves_something_unsaid_is_refused_when_it_enters_the_table():
    with pytest.raises(InputError, match=r"Bare has no happens, number, works, .* expected all of"):
        kinds.table_of(ftqp.Locked, type("Bare", (), {"kind": "bare"}))
    with pytest.raises(InputError, match="Locked and Again have the same number, expected one of each"):
        said = {fact: getattr(ftqp.Degraded, fact) for fact in kinds.FACTS}
        kinds.table_of(ftqp.Locked, type("Again", (), {**said, "number": ftqp.Locked.number}))


@pytest.mark.slow
def test_mypy_names_every_place_that_a_new_kind_has_no_case_in(tmp_path):
    """The kind goes into a copy of the source as CONTRIBUTING says; mypy then finds what is left to write."""
    source = tmp_path / "src"
    shutil.copytree(ROOT / "src", source, ignore=shutil.ignore_patterns("__pycache__"))
    file = source / "ftqp" / "faults" / "kinds.py"
    text = file.read_text()
    stranger = re.search(
        r"@dataclass\(frozen=True, slots=True\)\nclass Locked:.*?(?=\n\n\n@dataclass)", text, re.S
    )
    text = text.replace(
        "\nFault = Locked",
        stranger[0].replace("class Locked", "class Sticky") + "\n\n\nFault = Sticky | Locked",
    )
    file.write_text(text)
    settings = ["--config-file", ROOT / "pyproject.toml", "--cache-dir", tmp_path / "cache"]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *settings, source / "ftqp"],
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": str(source)},
        capture_output=True,
        text=True,
        check=False,
    )
    places = set(
        re.findall(r"(\w+)\.py:\d+: error: Argument 1 to \"not_served\" has incompatible", done.stdout)
    )
    assert places == {"belief", "kinematic_plant", "servo_plant", "mujoco_plant"}, done.stdout[-3000:]


@pytest.mark.long
def test_rows_of_a_stranger_hold_in_step_backend_and_batch_alike(tmp_path):
    """A copy of the source with a new kind of rows as CONTRIBUTING says, run as plain Python."""
    source = tmp_path / "src"
    shutil.copytree(ROOT / "src", source, ignore=shutil.ignore_patterns("__pycache__", "_kernel"))
    kernel = source / "ftqp" / "kernel"
    (kernel / "rows" / "cap_rows.py").write_text(CAP, encoding="utf-8")
    file = kernel / "layout" / "rows.py"
    before = "OWN_ROW, CLEARANCE, "
    assert file.read_text().count(before) == 1
    units = "unit='rad/s', sliding_unit='m/s', symmetric=True, needs_inertia=False"
    cap = f"RowKind(name='cap', {units}, module='cap_rows')"
    file.write_text(file.read_text().replace(before, f"OWN_ROW, {cap}, CLEARANCE, "))
    found = said_by(HERE / "stranger_rows.py", source=source)
    assert set(found) == {"acceleration", "velocity", "no torque limits", "kept point", "daqp", "batch"}
    assert all(0.0499 < fastest <= 0.05 + 1e-9 for fastest in found.values()), found


def test_coefficient_that_declares_nothing_makes_no_promise():
    bare = _coefficient()
    assert not any(bare.metadata.values())
    assert Criterion(norm=1.0, norm_v=2.0, inertia_h=1e-9).has_constant_hessian
    assert not Criterion(norm=1.0, torque=1e-9).has_constant_hessian


@pytest.mark.slow
def test_coefficient_of_a_stranger_is_computed_by_step_backend_and_batch_alike(tmp_path):
    """A copy of the source with a new coefficient as CONTRIBUTING says, built in a folder of its own."""
    pytest.importorskip("osqp", reason='needs the extra "solvers": pip install "ftqp[solvers]"')
    source = tmp_path / "src"
    shutil.copytree(ROOT / "src", source, ignore=shutil.ignore_patterns("__pycache__"))
    edits = {
        "layout/criteria.py": (
            "    manipulability: float = _coefficient(steady=True)\n",
            "    manipulability: float = _coefficient(steady=True)\n    ballast: float = _coefficient()\n",
        ),
        "rows/objective.py": (
            "    if K.settling.gradient_suppressed:\n        _hush(K)\n",
            "    if criteria.ballast != 0.0:\n        for i in range(K.chain.n):\n"
            "            K.qp.g[i] += criteria.ballast * (i + 1.0)\n"
            "    if K.settling.gradient_suppressed:\n        _hush(K)\n",
        ),
    }
    for name, (before, after) in edits.items():
        file = source / "ftqp" / "kernel" / name
        text = file.read_text()
        assert text.count(before) == 1
        file.write_text(text.replace(before, after))
    build = [sys.executable, "-m", "ftqp.kernel.building", "--store", ROOT / "build" / "kernel"]
    subprocess.run(build, env={**os.environ, "PYTHONPATH": str(source)}, check=True)
    found = SimpleNamespace(**said_by(HERE / "stranger_criterion.py", source=source))
    assert found.effect > 1e-3, "the coefficient does something"
    assert found.rollout < 1e-9 and found.backend < 1e-6


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return said_by("-P", "-m", "tests.laws.stranger_task", tmp_path_factory.mktemp("own"))


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
