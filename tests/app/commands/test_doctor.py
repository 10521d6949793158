"""What ``ftqp doctor`` finds, and what it says to do."""

import json

from tests.app.conftest import invoke

from ftqp.app.commands import doctor
from ftqp.kernel.compiled import library


def found():
    result = invoke("doctor", "--json")
    facts = json.loads(result.stdout)
    return result.exit_code, facts, {one["name"]: one for one in facts["checks"]}


def test_this_installation_is_sound():
    code, facts, checks = found()
    assert code == 0 and facts["sound"]
    assert checks["kernel"]["found"].startswith("built for ") and checks["trial"]["state"] == "ok"
    assert "numpy" in checks["needs"]["found"]


def test_a_person_reads_a_line_for_each():
    result = invoke("doctor")
    assert "this installation is sound" in result.stdout and "WRONG" not in result.stdout


def test_an_extra_that_is_missing_is_no_fault_and_its_remedy_is_said(monkeypatch):
    known = doctor.version_of
    monkeypatch.setattr(doctor, "version_of", lambda name: None if name == "mujoco" else known(name))
    code, facts, checks = found()
    assert code == 0 and facts["sound"] and checks["[sim]"]["state"] == "missing"
    assert checks["[sim]"]["remedy"].startswith("for physics: pip install")


def test_a_dependency_that_is_missing_is_a_fault(monkeypatch):
    known = doctor.version_of
    monkeypatch.setattr(doctor, "version_of", lambda name: None if name == "osqp" else known(name))
    code, facts, checks = found()
    assert code == 1 and not facts["sound"] and checks["needs"]["found"] == "without osqp"


def test_a_kernel_that_is_not_built_is_a_fault_with_a_remedy(monkeypatch, tmp_path):
    monkeypatch.setattr(doctor, "BUILT", tmp_path)
    code, _, checks = found()
    assert code == 1 and checks["kernel"]["found"].startswith("plain Python: ")
    assert checks["kernel"]["remedy"]
    monkeypatch.setattr(library, "PLAIN", True)
    assert "NUMBA_DISABLE_JIT" in found()[2]["kernel"]["found"]
