"""What notebooks and consoles show of robots, steps, results, logs and plans."""

import re
from dataclasses import replace

import numpy as np
import pytest

import ftqp

PANDA = ftqp.robots.load("panda")
PNG = b"\x89PNG"


@pytest.fixture(scope="module")
def result():
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=2.0)
    schedule = ftqp.Schedule([ftqp.FaultEvent(1.0, ftqp.Locked("panda_joint3"))])
    planner = ftqp.Planner(PANDA, dt=5e-3)
    return ftqp.Simulation(planner, path, q=PANDA.neutral, schedule=schedule, log="memory").run()


def test_a_result_is_a_few_lines_and_a_table(result):
    lines = repr(result).splitlines()
    assert 5 <= len(lines) <= 10 and all(len(line) < 110 for line in lines)
    assert lines[1] == "  run       completed in 401 steps"
    assert re.search(r"error +at most [\d.e-]+ mm, [\d.e-]+ mm at the end", repr(result))
    assert result._repr_html_().count("<tr>") == len(lines) - 1


def test_a_run_is_drawn_in_memory(result, tmp_path):
    picture = result.plot()
    assert picture._repr_png_().startswith(PNG) and "path of" in repr(picture)
    assert picture.save(tmp_path / "run.png").read_bytes() == picture._repr_png_()
    assert result.log.plot("joints")._repr_png_() != picture._repr_png_()
    with pytest.raises(ftqp.InputError, match="joints, velocities"):
        result.log.plot("pathh")
    with pytest.raises(ftqp.InputError, match="cannot be written"):
        picture.save(tmp_path / "no" / "run.png")


def test_a_result_without_a_log_says_how_to_keep_one(result):
    bare = replace(result, log=None)
    assert "none kept" in repr(bare)
    with pytest.raises(ftqp.InputError, match='log="memory"'):
        bare.plot()


def test_a_robot_is_a_table_and_a_picture():
    table = PANDA._repr_html_()
    assert table.count("<tr>") == 8 and "panda_joint4" in table and "124.6 °/s" in table
    at = PANDA.neutral + 0.3
    assert PANDA.show()._repr_png_().startswith(PNG)
    assert PANDA.show(at)._repr_png_() != PANDA.show()._repr_png_()
    with pytest.raises(ftqp.InputError, match="shape"):
        PANDA.show(np.zeros(3))
    floating = ftqp.robots.load("canadarm2")  # no gravity says what is up
    assert floating.show()._repr_png_().startswith(PNG)


def test_a_step_is_a_table():
    planner = ftqp.Planner(PANDA, dt=1e-3)
    planner.reset(PANDA.neutral)
    step = planner.step(PANDA.neutral, None, ftqp.Target(PANDA.pose(PANDA.neutral)))
    assert step._repr_html_().count("<tr>") == 8 and "Step: OK" in step._repr_html_()


def test_what_a_notebook_shows_has_a_small_picture(result):
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=2.0)
    for thing in (PANDA, ftqp.Planner(PANDA), path, result, result.log):
        assert thing._repr_html_().count("<svg") == 1
    assert "and 82 more" in result.log._repr_html_() and "at most" in result.log.error_svg()
    assert "<svg" not in replace(result, log=None)._repr_html_()


def test_what_a_console_shows_says_what_it_is(result):
    path = ftqp.paths.Line(PANDA.pose(PANDA.neutral), displacement=(0.0, 0.05, 0.0), duration=1.0)
    assert re.fullmatch(
        r"Line\(begins at 0\.3069, 0, 0\.4869 m, lasts 1 s, is long 0\.05 m, .*\)", repr(path)
    )
    sample = path.sample([0.0, 0.5, 1.0])
    targets = ftqp.Targets(sample.pose)
    assert repr(targets.at(2)) == "Targets(3 poses, now number 2)"
    assert repr(sample) == "PathSample(3 poses, twists and accelerations)"
    arms = ftqp.batch.rollout(ftqp.Planner(PANDA), np.repeat(PANDA.neutral[None], 2, axis=0), targets=targets)
    assert repr(arms).startswith("Rollout(2 arms; ticks: ") and "SCALED" not in repr(arms)


def test_a_log_is_a_table_of_pandas(result):
    table = result.log.to_pandas()
    assert table.index.name == "t" and len(table) == len(result.log)
    assert np.array_equal(table["q.panda_joint1"], result.log["q.panda_joint1"])
