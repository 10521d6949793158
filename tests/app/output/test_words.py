"""What happened in a run, in words, and standard output that is closed."""

import subprocess
import sys

import pytest

from ftqp.app.output.words import ending, fault_sentence, further_sentences, limits_sentence


def test_rounding_is_no_exceeded_limit():
    assert limits_sentence({"q": 1e-12, "v": 0.0, "a": 0.0, "tau": 0.0}) == "every joint limit was kept"


def test_every_exceeded_limit_is_named_with_its_excess():
    said = limits_sentence({"q": 0.01, "v": 0.0, "a": 0.0, "tau": 2.0})
    assert said == "limits exceeded: position by 0.01, torque by 2"


@pytest.mark.parametrize(
    ("kind", "announced", "sentence"),
    [
        ("locked", 2.0, "j1 locks at 2 s; reported at once"),
        ("free_swinging", 2.5, "j1 swings freely at 2 s; reported at 2.5 s"),
        ("degraded", None, "j1 is degraded at 2 s; nobody reports it"),
    ],
)
def test_fault_tells_what_when_and_who_knows(kind, announced, sentence):
    assert fault_sentence({"kind": kind, "joint": "j1", "at": 2.0, "announced": announced}) == sentence


def test_ending_tells_interruption_completion_and_stop_apart():
    facts = {
        "status_counts": {"OK": 1, "STOPPED": 2},
        "steps": 3,
        "interrupted": False,
        "completed": False,
        "stopped_at": 1.5,
        "final_status": "STOPPED",
    }
    assert ending(facts | {"interrupted": True}) == "interrupted after 3 steps"
    assert ending(facts | {"completed": True}) == "completed in 3 steps"
    partly = {"completed": True, "status_counts": {"OK": 1, "RELAXED": 2}}
    assert ending(facts | partly) == "completed in 3 steps, 2 of them RELAXED: the task was kept in part"
    assert ending(facts) == "stopped at 1.50 s: the task could not go on"


def test_soft_tasks_and_kept_points_are_told_in_their_units():
    tasks = {
        "elbow": {"final_error": 0.014, "max_error": 0.1, "unit": "m"},
        "look": {"final_error": None, "max_error": 0.76, "unit": "rad"},
    }
    kept = {
        "table": {"min_distance": 0.002}, "wall": {"min_distance": -3e-6}, "door": {"min_distance": None},
        "cell": {"min_distance": 0.03, "shape": "box"}, "gate": {"min_distance": -0.03, "shape": "box"},
        "cup": {"min_distance": 0.1, "shape": "cone"}, "can": {"min_distance": -0.1, "shape": "cone"},
        "jug": {"min_distance": None, "shape": "cone"},
    }  # fmt: skip
    assert further_sentences({"tasks": tasks, "constraints": kept}) == [
        "the task elbow was 14 mm off at the end, and 100 mm at most",
        "the task look was an unknown amount off at the end, and 0.76 rad at most",
        "table stayed on its side of its plane, 2 mm away at the nearest",
        "wall was up to 3 um beyond its plane",
        "how near door came to its plane is unknown",
        "cell stayed inside its box, 30 mm from its boundary at the nearest",
        "gate was up to 30 mm outside its box",
        "cup stayed inside its cone, 5.7 deg from its boundary at the nearest",
        "can was up to 5.7 deg outside its cone",
        "how near jug came to its cone is unknown",
    ]
    assert further_sentences({}) == []


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (0.002, "servos were found to lag by up to 42 ms"),
        (0.03, "no servo was found to lag"),
        (0.07, "nothing of the servos was estimated, because no joint moved enough"),
    ],
)
def test_lags_that_were_learned_are_said(error, sentence):
    joints = {"j1": {"lag": [0.021, error]}, "j2": {"lag": [0.042, error]}}
    assert further_sentences({"learned": {"robot": "arm", "joints": joints}}) == [sentence]


@pytest.mark.skipif(sys.platform == "win32", reason="needs a shell that closes standard output")
@pytest.mark.parametrize("arguments", ["schemes", "run panda-circle --out never"])
def test_standard_output_that_is_closed_is_said_before_anything_is_done(arguments, tmp_path):
    command = f'"{sys.executable}" -m ftqp {arguments} >&-'
    result = subprocess.run(command, shell=True, stderr=subprocess.PIPE, text=True, check=False, cwd=tmp_path)
    assert result.returncode == 2 and not list(tmp_path.iterdir())
    assert result.stderr.startswith("error: standard output is closed, expected one for results")


def test_reader_who_has_had_enough_is_no_error():
    command = [sys.executable, "-m", "ftqp", "check", "--keys"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as begun:
        assert begun.stdout is not None and begun.stderr is not None
        begun.stdout.close()
        assert b"Traceback" not in begun.stderr.read()
