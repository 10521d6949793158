"""Every example runs by itself, says what it shows, and ends with three numbers."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "examples"
EXAMPLES = sorted(FOLDER.glob("[0-9]*.py"))
HUMANOID = "15_humanoid_loses_an_elbow.py"
ROBOT_DATA = next(Path(sys.prefix).glob("**/share/example-robot-data/robots"), None)
HERE = [e for e in EXAMPLES if e.name != HUMANOID or ROBOT_DATA is not None]
"""The examples that can be run: the humanoid needs the extra ``robots``."""


ALL = """import contextlib, io, json, runpy, sys
printed = {}
for example, *arguments in json.loads(sys.argv[1]):
    sys.argv[:] = [example, "--headless", *arguments]
    with contextlib.redirect_stdout(io.StringIO()) as out:
        try:
            runpy.run_path(example, run_name="__main__")
        except SystemExit as end:
            if end.code:
                raise
    printed[example] = out.getvalue().strip().splitlines()
print(json.dumps(printed))
"""
"""Runs them one after the other: loading what all of them need takes longer than most of them."""


def lines_of(*commands):
    """What each example prints, by its name; a command is its file and more arguments."""
    asked = json.dumps([[str(part) for part in command] for command in commands])
    done = subprocess.run([sys.executable, "-c", ALL, asked], capture_output=True, text=True, timeout=480)
    assert done.returncode == 0, done.stderr
    return {Path(name).name: lines for name, lines in json.loads(done.stdout).items()}


def number(line):
    """The first number after the label of a line."""
    return float(re.search(r"-?\d+(\.\d+)?(e[+-]?\d+)?", re.split(r": | ends ", line, maxsplit=1)[1])[0])


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    return tmp_path_factory.mktemp("pictures")


@pytest.fixture(scope="module")
def printed(pictures):
    return lines_of(*((e, "--figure", pictures / f"{e.stem}.png") for e in HERE))


def test_examples_are_numbered_without_a_gap():
    assert [int(e.name[:2]) for e in EXAMPLES] == list(range(1, len(EXAMPLES) + 1)) and len(EXAMPLES) >= 6


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda e: e.stem)
def test_example_is_short_and_says_what_it_shows(example):
    text = example.read_text(encoding="utf-8")
    title, _, shows = text.split('"""')[1].partition("\n\n")
    assert len(text.splitlines()) < 60 and title.endswith(".") and 10 < len(shows.split()) < 60


@pytest.mark.parametrize("name", [e.name for e in HERE])
def test_example_prints_three_numbers(printed, name):
    assert len(printed[name]) == 3 and all(number(line) == number(line) for line in printed[name])


@pytest.mark.parametrize("example", HERE, ids=lambda e: e.stem)
def test_example_saves_one_picture(printed, pictures, example):
    assert len(printed) == len(list(pictures.iterdir()))
    assert (pictures / f"{example.stem}.png").read_bytes().startswith(b"\x89PNG")


def test_arm_that_loses_a_joint_finishes_its_circle(printed):
    worst, speed, distance = (number(line) for line in printed["01_lose_a_joint.py"])
    assert worst < 1.0 and speed == 0.0 and distance < 0.1


def test_arm_of_a_urdf_holds_its_tip(printed):
    joints, error, torque = (number(line) for line in printed["02_your_own_urdf.py"])
    assert joints == 7 and error < 0.1 and 0.0 < torque <= 80.0


def test_urdf_is_taken_from_the_command_line(tmp_path):
    file = tmp_path / "mine.urdf"
    inertia = '<mass value="1"/><inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/>'
    links = [f'<link name="a{i}"><inertial>{inertia}</inertial></link>' for i in range(9)]
    joints = [
        f'<joint name="m{i}" type="revolute"><parent link="a{i}"/><child link="a{i + 1}"/>'
        f'<origin xyz="0 0 .15"/><axis xyz="{"0 0 1" if i % 2 else "0 1 0"}"/>'
        '<limit lower="-2" upper="2" velocity="2" effort="90"/></joint>'
        for i in range(8)
    ]
    file.write_text(f'<robot name="mine">{"".join(links + joints)}</robot>', encoding="utf-8")
    own = FOLDER / "02_your_own_urdf.py"
    first, error, _ = lines_of((own, file, "--tip", "a8"))[own.name]
    assert first == "joints of mine: 8" and number(error) < 0.1


def test_solvers_end_where_the_built_in_one_ends(printed):
    assert all(number(line) < 1e-6 for line in printed["03_swap_the_backend.py"])


def test_free_swinging_joint_gets_no_torque_and_the_tip_stays(printed):
    worst, torque, swing = (number(line) for line in printed["04_free_swinging.py"])
    assert worst < 25.0 and torque == 0.0 and swing > 0.2


def test_scaled_task_stays_on_its_line(printed):
    slack, scaled, lexicographic = (number(line) for line in printed["05_task_modes.py"])
    assert scaled < 1.0 < min(slack, lexicographic)


def test_qp_has_the_solution_found_by_hand(printed):
    """x0 = 1/2; x1 + x2 = 1/2 and 2 x1 - 1 = 3 x2 - 1/4 = -y give (0.45, 0.05), y = 0.1, z0 = 1 - x0 - y."""
    cost, residual, multiplier = (number(line) for line in printed["06_qp_alone.py"])
    assert residual < 1e-9 and cost == pytest.approx(-0.63125) and multiplier == pytest.approx(0.4)


def test_tool_on_a_moving_base_stays_where_it_is(printed):
    carried, worst, speed = (number(line) for line in printed["07_moving_base.py"])
    assert carried > 100.0 and worst < 0.01 and speed == 0.0


def test_path_that_waits_goes_through_a_singularity_on_its_line(printed):
    waiting, by_the_clock, time = (number(line) for line in printed["08_through_a_singularity.py"])
    assert waiting < 1.27 < 5.0 < by_the_clock and 20.0 < time < 21.0


def test_arm_that_loses_a_joint_under_the_joystick_goes_home_with_the_others(printed):
    *lines, said = printed["09_ways_to_a_goal.py"]
    stale, miss = (number(line) for line in lines)
    joint, tip = said.split("off their goal are ")[1].split("; ")  # the reason goes before what it does
    assert stale == pytest.approx(1.18) and miss <= 1e-6
    assert joint == "panda_joint4 (locked) by 0.179 rad"
    assert tip == "the end effector is 87.4 mm and 0.179 rad from it"


def test_arm_that_loses_a_joint_on_its_way_round_a_wall_finds_another_way(printed):
    thought, time, wall = (number(line) for line in printed["18_round_an_obstacle.py"])
    assert 0.0 < thought < 1.0 and 1.2 < time < 20.0 and wall >= 20.0
    assert printed["18_round_an_obstacle.py"][1].startswith("the arm rests at its goal")


@pytest.mark.skipif(ROBOT_DATA is None, reason="example-robot-data is missing: pip install -e '.[robots]'")
def test_waist_of_a_humanoid_makes_up_for_its_elbow(printed):
    healthy, elbow, stiff = (number(line) for line in printed[HUMANOID])
    assert healthy < 0.1 and elbow < 0.1 and 40.0 < stiff < 100.0
    assert [line.rsplit(", ", 1)[1] for line in printed[HUMANOID]] == ["OK", "OK", "RELAXED"]


def test_humanoid_whose_files_are_missing_says_so_in_one_sentence(tmp_path):
    bare = f"import runpy, sys; sys.prefix = {str(tmp_path)!r}; sys.argv = ['15', '--headless']; "
    bare += f"runpy.run_path({str(FOLDER / HUMANOID)!r}, run_name='__main__')"
    done = subprocess.run([sys.executable, "-c", bare], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and done.stdout == ""
    assert done.stderr == 'the files of Talos are not installed; pip install -e ".[robots]"\n'
