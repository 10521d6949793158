"""What a comparison runs, and what is found wrong with it beforehand."""

from pathlib import Path
from typing import Any

import pytest

from ftqp.app.compare import combinations as module
from ftqp.app.compare.combinations import combinations
from ftqp.core.errors import MissingPackage, ScenarioError


@pytest.fixture
def without_daqp(monkeypatch: pytest.MonkeyPatch) -> None:
    """The package of one backend is missing."""
    real = module.qp_backend

    def fake(spec: Any) -> Any:
        if spec in ("daqp", {"name": "daqp"}):
            raise MissingPackage("backend 'daqp'", "daqp", "pip install daqp")
        return real(spec)

    monkeypatch.setattr(module, "qp_backend", fake)


def test_every_combination_is_run_once(short: Path) -> None:
    found = combinations([str(short)], backends="active_set,osqp", schemes="mvn, rmp")
    assert [(c.scheme, c.backend) for c in found] == [
        ("mvn", "active_set"), ("mvn", "osqp"), ("rmp", "active_set"), ("rmp", "osqp"),
    ]  # fmt: skip
    assert all(c.setup is not None and c.setup.planner.backend == c.backend for c in found)
    assert all(c.setup is not None and c.setup.planner.scheme.name == c.scheme for c in found)
    assert len({c.name for c in found}) == 4


def test_scenarios_keep_their_own_scheme_and_backend(short: Path) -> None:
    found = combinations([str(short), "planar6-square"], backends=None, schemes=None)
    assert [(c.scenario, c.scheme, c.backend) for c in found] == [
        ("short", "mvn", "active_set"),
        ("planar6-square", "dlsm", "active_set"),
    ]


def test_tables_and_profiles_are_taken_and_named(short: Path, tmp_path: Path) -> None:
    profile = tmp_path / "loose.toml"
    profile.write_text('name = "osqp"\ntolerance = 1e-6\n')
    found = combinations(
        [str(short)], backends=f"osqp,{profile}", schemes='{ name = "dlsm", alpha = 0.5 },mvn'
    )
    assert [c.scheme for c in found] == ["dlsm alpha=0.5"] * 2 + ["mvn"] * 2
    assert [c.backend for c in found] == ["osqp", "loose"] * 2
    assert not any(set(" ,:{}") & set(c.name) for c in found)


def test_scenarios_with_the_same_name_are_told_apart(short: Path, tmp_path: Path) -> None:
    other = tmp_path / "other" / "short.toml"
    other.parent.mkdir()
    other.write_text(short.read_text())
    found = combinations([str(short), str(other)], backends=None, schemes=None)
    assert len({c.scenario for c in found}) == 2
    assert len({c.name for c in found}) == 2


def test_every_wrong_name_is_told_at_once(short: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        combinations(
            [str(short), "panda-cirle"], ["planner.dt=0"], backends="dacqp,osqp,osqp,", schemes="mnv"
        )
    summary = "\n".join(caught.value.errors)
    for words in (
        "--schemes: 'mnv' is not a scheme (did you mean 'mvn'?)",
        "--backends: 'dacqp' is not a backend of ftqp (did you mean 'daqp'?)",
        "--backends: 'osqp' is there 2 times, expected once",
        "expected names separated by commas",
        "panda-cirle: panda-cirle is neither a file nor a bundled scenario",
        "short: planner.dt is 0",
    ):
        assert words in summary
    assert len(caught.value.errors) == 6


def test_a_backend_that_is_not_installed_says_why_and_the_rest_runs(short: Path, without_daqp: None) -> None:
    found = combinations([str(short)], backends="active_set,daqp", schemes=None)
    assert [c.setup is None for c in found] == [False, True]
    assert "pip install daqp" in found[1].reason


def test_a_combination_that_the_planner_refuses_is_left_out() -> None:
    found = combinations(["zhang7-short"], backends=None, schemes="rmp,mke")
    assert [c.setup is None for c in found] == [False, True] and "needs inertia" in found[1].reason
    with pytest.raises(ScenarioError, match="needs inertia"):
        combinations(["zhang7-short"], backends=None, schemes="mke")
