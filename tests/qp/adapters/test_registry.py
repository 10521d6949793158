import subprocess
import sys

import pytest

from ftqp import InputError, MissingPackage
from ftqp.core.extras import remedy_for_extra
from ftqp.qp import Backend, backend, backends

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
        ({"name": "osqp", "eps_abs": 1.0}, "'eps_abs' is not a setting of backend 'osqp'"),
        ({"name": "proxqp", "max_iteration": 3}, "did you mean 'max_iterations'?"),
        ({"name": "active_set", "tolerance": 1.0}, "'tolerance' is not a setting of backend 'active_set'"),
        ({"tolerance": 1.0}, "has no name"),
        ({"name": 3}, "has no name"),
        (3, "backend is 3, expected a name"),
        ("qpsolvers:dapq", "'dapq' is not a solver of qpsolvers (did you mean 'daqp'?)"),
        ("qpsolvers:", "'' is not a solver of qpsolvers"),
        ({"name": "qpsolvers:osqp", "max_iterations": 0}, "qpsolvers:osqp.max_iterations is 0"),
    ],
)
def test_a_wrong_spec_is_refused_in_one_sentence(spec, sentence):
    with pytest.raises(InputError) as error:
        backend(spec)
    assert sentence in str(error.value)


@pytest.mark.parametrize(("name", "package"), PACKAGES.items())
def test_a_missing_package_says_how_to_install_it(monkeypatch, name, package):
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


def test_a_solver_that_qpsolvers_knows_but_does_not_find_is_a_missing_package(monkeypatch):
    import qpsolvers

    monkeypatch.setattr(qpsolvers, "available_solvers", ["daqp"])
    with pytest.raises(MissingPackage, match="gurobi"):
        backend("qpsolvers:gurobi")


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
