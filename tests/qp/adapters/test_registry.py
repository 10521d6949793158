"""Backends: found by name, made, called warm and cold, and refused in a sentence."""

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from ftqp import InputError, MissingPackage
from ftqp.core.extras import remedy_for_extra
from ftqp.qp import Backend, Claim, QPBuffers, backend, backends
from ftqp.qp.adapters.backend import settings
from ftqp.qp.adapters.registry import profile


class Scripted(Backend):
    """Answers with the claims it was given, and keeps how it was asked."""

    package = "ftqp"

    def __init__(self, *claims, x=1.0):
        super().__init__("scripted")
        self.claims, self.asked, self.value = list(claims), [], x

    def _prepare(self, qp):
        self.prepared = qp

    def _run(self, qp, cold):
        self.asked.append(cold)
        self.iterations = 3
        qp.x[:] = self.value
        return self.claims.pop(0)


def scripted(*claims, **options):
    solver = Scripted(*claims, **options)
    solver.setup(QPBuffers.zeros(2, 1, 1))
    return solver


def test_the_first_solve_is_cold_whatever_is_asked():
    solver = scripted(Claim.SOLVED, Claim.SOLVED, Claim.SOLVED)
    for cold in (False, False, True):
        assert solver.solve(cold=cold) is Claim.SOLVED
    assert solver.asked == [True, False, True]


def test_a_warm_failure_is_repeated_cold_once_and_counted():
    solver = scripted(Claim.SOLVED, Claim.MAX_ITERATIONS, Claim.SOLVED)
    solver.solve(cold=True)
    assert solver.solve(cold=False) is Claim.SOLVED
    assert solver.asked == [True, False, True]
    assert solver.iterations == 6


def test_an_answer_that_is_not_finite_is_failed():
    assert scripted(Claim.SOLVED, x=np.nan).solve(cold=True) is Claim.FAILED
    assert scripted(Claim.MAX_ITERATIONS, x=np.inf).solve(cold=True) is Claim.FAILED


def test_bad_data_never_reach_the_solver_and_make_the_next_solve_cold():
    solver = scripted(Claim.SOLVED, Claim.SOLVED)
    solver.solve(cold=True)
    qp = solver.prepared
    for part, value, claim in (
        ("g", np.nan, Claim.FAILED),
        ("l", np.nan, Claim.FAILED),
        ("lb", 9.0, Claim.INFEASIBLE),
    ):
        qp.ub[:] = 1.0
        before = getattr(qp, part).copy()
        getattr(qp, part)[0] = value
        assert solver.solve(cold=False) is claim
        getattr(qp, part)[:] = before
    solver.solve(cold=False)
    assert solver.asked == [True, True]


def test_flat_is_the_problem_in_the_documented_order():
    n, m, p = 4, 2, 3
    qp = QPBuffers.zeros(n, m, p)
    qp.flat[:] = np.arange(len(qp.flat))
    order = [qp.H, qp.g, qp.A, qp.C, qp.lb, qp.b, qp.l, qp.ub, qp.upper[n : n + m], qp.u]
    np.testing.assert_array_equal(np.concatenate([part.ravel() for part in order]), qp.flat)
    qp.solution[:] = np.arange(len(qp.solution))
    np.testing.assert_array_equal(np.concatenate([qp.x, qp.z_box, qp.y, qp.z]), qp.solution)


PACKAGES = {
    "daqp": "daqp",
    "osqp": "osqp",
    "proxqp": "proxsuite",
    "quadprog": "quadprog",
    "qpsolvers:daqp": "qpsolvers",
}


def test_a_backend_is_made_from_a_name_a_mapping_or_itself():
    solver = backend({"name": "daqp", "tolerance": 1e-8})
    assert solver.name == "daqp"
    assert backend(solver) is solver
    assert isinstance(backend("qpsolvers:daqp"), Backend)


@pytest.mark.parametrize(
    ("spec", "sentence"),
    [
        ("dqap", "'dqap' is not a backend of ftqp (did you mean 'daqp'?)"),
        ({"tolerance": 1.0}, "has no name"),
        ({"name": 3}, "has no name"),
        (3, "backend is 3, expected a name"),
        ("nothing.toml", "nothing.toml cannot be read (No such file"),
        (Path("/"), "cannot be read"),
        ({"name": "qpsolvers:osqp", "max_iterations": 0}, "qpsolvers:osqp.max_iterations is 0"),
        ({"name": "proxqp", "time_limit": 1e-3}, "backend 'proxqp' has no time_limit"),
        ({"name": "active_set", "time_limit": 1e-3}, "backend 'active_set' has no time_limit"),
    ],
)
def test_a_wrong_spec_is_refused_in_one_sentence(spec, sentence):
    with pytest.raises(InputError) as error:
        backend(spec)
    assert sentence in str(error.value)


@pytest.mark.parametrize(("name", "package"), PACKAGES.items())
def test_a_missing_package_says_how_to_install_it(monkeypatch, name, package):
    backends()  # qpsolvers looks once, when it is imported, at which solvers there are
    for module in list(sys.modules):
        if module.split(".")[0] == package or module.startswith("ftqp.qp.adapters._"):
            monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingPackage) as error:
        backend(name)
    assert error.value.package == package
    assert remedy_for_extra("solvers") in str(error.value)
    rows = {row.name: row for row in backends()}
    row = rows[name if package != "qpsolvers" else "qpsolvers:<name>"]
    assert not row.available
    assert package in row.reason
    assert row.version is None


def test_the_table_names_kind_licence_and_version():
    rows = {row.name: row for row in backends()}
    assert rows["active_set"].kind == "in the kernel"
    assert rows["active_set"].install == ""
    assert rows["daqp"].licence == "MIT"
    assert rows["quadprog"].licence.startswith("GPL")
    assert rows["proxqp"].version
    assert rows["qpsolvers:daqp"].kind == "through qpsolvers"
    assert all(row.available for row in rows.values() if row.version)


def test_importing_the_package_loads_no_solver_and_no_compiler():
    code = (
        "import sys, ftqp.qp; "
        "foreign = ('numba', 'scipy', 'daqp', 'osqp', 'proxsuite', 'quadprog', 'qpsolvers'); "
        "print([m for m in foreign if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_profile_becomes_a_backend(tmp_path):
    path = tmp_path / "tight.toml"
    path.write_text('name = "daqp"\ntolerance = 1e-10\n')
    assert profile(path) == {"name": "daqp", "tolerance": 1e-10}
    assert backend(path).name == backend(str(path)).name == "daqp"


@dataclass(frozen=True, kw_only=True)
class Some:
    tolerance: float = 1e-9
    shift: float = 0.0
    cap: int = 10
    verbose: bool = False


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"tolerence": 1.0}, "'tolerence' is not a setting of backend 'some' (did you mean 'tolerance'?)"),
        ({"tolerance": 0.0}, "some.tolerance is 0, expected a finite number > 0"),
        ({"tolerance": float("nan")}, "some.tolerance is nan"),
        ({"verbose": 1}, "some.verbose is 1, expected true or false"),
    ],
)
def test_a_wrong_setting_is_refused_in_one_sentence(given, sentence):
    with pytest.raises(InputError) as error:
        settings(Some, "some", given)
    assert sentence in str(error.value)


LOADED = "print([m for m in sys.modules if m.startswith('proxsuite.proxsuite_pywrap')])"


def run(code):
    done = subprocess.run(
        [sys.executable, "-c", f"import sys\n{code}\n{LOADED}"], capture_output=True, text=True, check=True
    )
    return done.stdout.strip(), done.stderr


@pytest.mark.long
def test_backend_loads_the_build_that_rounds_steadily():
    loaded, said = run("import ftqp; ftqp.qp.backend('proxqp')")
    assert "'proxsuite.proxsuite_pywrap'" in loaded and "avx" not in loaded
    assert "loaded before" not in said


@pytest.mark.long
def test_build_that_was_loaded_before_stays_and_is_said():
    loaded, said = run("import proxsuite, ftqp; ftqp.qp.backend('proxqp'); ftqp.qp.backend('proxqp')")
    if "avx" not in loaded:
        pytest.skip("this processor has no faster build")
    assert said.count("proxsuite was loaded before ftqp") == 1
