"""Times are taken in turns, set-up apart, and the script says them; no figure of it is judged here."""

import json
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from bench.contenders import Contender
from bench.isolation import Apart
from comparison import speed_report
from comparison.recorded import Recorded
from comparison.speed import DISCARD, EMPTY, Runner, Settings, measured
from tests.scripts import ran
from tests.solvers.stand_ins import SOLVABLE, Scripted, sequence

from ftqp.qp import Claim

SCRIPT = "solvers/compare_speed.py"
BACKENDS = ["active_set", "daqp-fast", "proxqp-fast", "qpsolvers:daqp"]
SEQUENCES = ["panda-healthy", "panda-infeasible"]
SETTINGS = Settings(samples=20, seconds=60.0, turn=7, turn_seconds=60.0, setups=2)


def runner(solver: Scripted, start: str, tape: Recorded) -> Runner:
    qp = tape.buffers()
    solver.setup(qp)
    return Runner(name="scripted", start=start, solver=solver, qp=qp, sequence=tape)


def test_the_first_solves_of_a_turn_do_not_count() -> None:
    solver = Scripted(Claim.SOLVED)
    one = runner(solver, "cold", sequence(*[SOLVABLE] * 5))
    one.turn(SETTINGS)
    assert len(one.ns) == 7
    assert len(solver.colds) == DISCARD + 7
    assert all(solver.colds)


def test_a_warm_run_does_not_count_the_cold_solve_at_the_head_of_each_pass() -> None:
    solver = Scripted(Claim.SOLVED)
    one = runner(solver, "warm", sequence(*[SOLVABLE] * 5))
    one.turn(SETTINGS)  # 10 solves, two passes; the one at position 5 is cold and beyond those discarded
    assert solver.colds == [True, False, False, False, False] * 2
    assert len(one.ns) == 6


def test_a_turn_ends_early_when_its_time_is_over() -> None:
    one = runner(Scripted(Claim.SOLVED), "cold", sequence(SOLVABLE))
    one.turn(Settings(samples=20, seconds=1.0, turn=1000, turn_seconds=0.0, setups=1))
    assert len(one.ns) == 1


def test_only_right_answers_that_were_claimed_count_as_solved() -> None:
    for claim, x, share in (
        (Claim.SOLVED, (1.0, -1.0), 100.0),
        (Claim.MAX_ITERATIONS, (1.0, -1.0), 0.0),
        (Claim.SOLVED, (0.0, 0.0), 0.0),
    ):
        one = runner(Scripted(claim, x=x), "cold", sequence(SOLVABLE, SOLVABLE))
        one.first_pass()
        one.turn(SETTINGS)
        assert one.row(2)["solved"] == share


def test_contenders_take_turns_and_one_that_cannot_says_why() -> None:
    wanted = [
        Contender(name="active_set", settings={"name": "active_set"}),
        Contender(name="nobody", settings={"name": "qpsolvers:gurobi"}),
    ]
    with ExitStack() as stack:
        processes = {name: stack.enter_context(Apart()) for name in (EMPTY, "active_set", "nobody")}
        cells, left_out = measured(wanted, processes, sequence(*[SOLVABLE] * 4), SETTINGS, 4)
    assert {(cell["contender"], cell["start"]) for cell in cells} == {
        (name, start) for name in ("empty", "active_set") for start in ("cold", "warm")
    }
    assert all(cell["samples"] >= SETTINGS.samples for cell in cells)
    assert "pip install" in left_out["nobody"]


def test_ratios_are_those_of_medians_on_the_same_qps() -> None:
    cells = [
        {"contender": who, "sequence": "s", "start": "warm", "p50": p50}
        for who, p50 in (("active_set", 4.0), ("daqp", 6.0))
    ]
    assert speed_report.ratio({"cells": cells}, "daqp", "s", "warm") == 1.5
    assert speed_report.ratio({"cells": cells[1:]}, "daqp", "s", "warm") is None


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """The object printed by a quick run of some contenders, and the folder of its results."""
    out = tmp_path_factory.mktemp("speed")
    done = ran(SCRIPT, 
        "--quick", "--json", "--backends", ",".join(BACKENDS), "--sequences", ",".join(SEQUENCES),
        "--out", str(out), "--name", "mine",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), out


def test_every_contender_is_timed_on_every_sequence_cold_and_warm(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    found = {(cell["contender"], cell["sequence"], cell["start"]) for cell in result["cells"]}
    assert found == {(a, b, c) for a in ("empty", *BACKENDS) for b in SEQUENCES for c in ("cold", "warm")}
    for cell in result["cells"]:
        assert 0.0 < cell["p50"] <= cell["worst"]
        assert cell["setup"] > 0.0
        assert cell["samples"] >= 1


def test_solved_shares_tell_which_times_count(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    for cell in result["cells"]:
        assert cell["solved"] == (0.0 if cell["contender"] == "empty" else 100.0)
