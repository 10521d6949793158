"""Corrupted steps keep every promise, and who judges them sees a promise that is broken."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fuzz import episode, judging, workers
from tests.scripts import told

ARMS = ("panda", "planar(4)", "srs7", "turning")
SEED = 14


@pytest.mark.parametrize("number", range(4))
def test_sample_of_corrupted_steps_keeps_every_promise(number: int) -> None:
    outcome = episode.run(SEED, number, ticks=150, arms=ARMS)
    assert outcome.wrong == [], outcome.sentence
    assert outcome.corrupted > 100


@pytest.mark.slow
@pytest.mark.parametrize("number", range(8, 200))
def test_corrupted_steps_keep_every_promise(number: int) -> None:
    outcome = episode.run(SEED, number)
    assert outcome.wrong == [], outcome.sentence


def test_arm_that_moves_again_beside_a_joint_that_swings_is_not_called_stopped() -> None:
    outcome = episode.run(SEED, 352)  # STOPPED was said for good once all had been at rest
    assert outcome.wrong == [], outcome.sentence


@pytest.fixture
def ended():
    """An episode whose planner promises that every joint can brake; what came of it is not judged yet."""
    for number in range(100):
        run = episode._Run(SEED, number, 60, ("panda",))
        run.busy = 0.0
        if run.case.viable and run.case.latency == 0 and not run.case.watched:
            run.run()
            assert run.outcome.wrong == []
            return run
    raise AssertionError("no such episode was drawn")


def spoil_finite(account, case):
    account.sent_q[30, 2] = np.nan


def spoil_speed(account, case):
    account.v[30, 2] = 1.01 * case.arm.v_max[2]


def spoil_acceleration(account, case):
    account.v[30, 2] = account.v[29, 2] + 1.01 * case.dt * case.arm.a_max[2]


def spoil_position(account, case):
    account.q[30:, 2] = case.arm.q_max[2] + 0.01


def spoil_honesty(account, case):
    account.status[30] = "OK"
    account.sound[30] = False


def spoil_tip(account, case):
    account.status[30] = "OK"
    account.sound[30], account.has_tip[30] = True, False
    account.target[30, :3, 3] += 1.0


def spoil_stop(account, case):
    account.asked[30] = True
    account.status[30] = "SCALED"


def spoil_rest(account, case):
    account.status[30] = "STOPPED"
    account.v[30, 2] = 0.1 * case.arm.v_max[2]


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (spoil_finite, "sent_q is not finite"),
        (spoil_speed, "speed: joint 2"),
        (spoil_acceleration, "acceleration: joint 2"),
        (spoil_position, "position: joint 2"),
        (spoil_honesty, "OK is said although what was handed in is not finite"),
        (spoil_tip, "OK is said although the tip that was measured is"),
        (spoil_stop, "a stop was asked for, and the status is SCALED"),
        (spoil_rest, "STOPPED is said of an arm that moves"),
    ],
)
def test_judge_sees_a_promise_that_is_broken(ended, spoil, said) -> None:
    spoil(ended.account, ended.case)
    assert any(said in sentence for sentence in judging.broken(ended.case, ended.account, ended.world))


def test_process_that_crashes_is_counted_and_the_next_episode_is_run(tmp_path: Path) -> None:
    script = tmp_path / "crashes.py"
    script.write_text(
        "import json, os, sys\n"
        "first = int(sys.argv[3].partition('=')[2])\n"
        "for number in range(first, 7):\n"
        "    print(number, flush=True)\n"
        "    if number == 5:\n"
        "        os.abort()\n"
        "    print(json.dumps({'number': number, 'wrong': []}), flush=True)\n"
    )
    given, total = SimpleNamespace(seed=1, first=4, ticks=10), workers.nothing(("crashed",), ())
    found = list(workers.episodes(str(script), given, total, 7))
    assert [outcome["number"] for outcome in found] == [4, 5, 6]
    assert (total["episodes"], total["crashed"], total["failing"]) == (3, 1, 1)
    assert found[1]["crashed"] == 1 and "SIGABRT" in found[1]["wrong"][0]


@pytest.mark.slow
def test_script_counts_and_reports_without_compilation(tmp_path: Path) -> None:
    given = ("--episodes=2", "--ticks=30", "--plain", "--json", "--out", tmp_path)
    total = json.loads(told("studies/fuzz_step.py", *given))["total"]
    assert total["episodes"] == 2 and total["failing"] == total["crashed"] == 0
    assert "python studies/fuzz_step.py" in (tmp_path / "fuzz.md").read_text(encoding="utf-8")
