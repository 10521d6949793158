"""Planners and paths as tables of notebooks."""

import ftqp

BODY = ftqp.robots.load("dual_panda")


def test_a_planner_says_its_tasks_constraints_and_what_it_believes():
    planner = ftqp.Planner(
        BODY,
        tasks=[
            ftqp.PoseTask("left_hand"),
            ftqp.RelativeTask("right_hand", "left_hand", level=0, name="<grip>"),
        ],
        constraints=[ftqp.Keep("left_joint4", above=[0.0, 0.0, 0.2])],
    )
    planner.reset(BODY.neutral)
    assert "every joint works" in planner._repr_html_() and repr(planner).endswith("failed: none)")
    planner.report(ftqp.Locked("left_joint3"))
    said = planner._repr_html_()
    for word in (
        "dual_panda, 14 joints",
        "RelativeTask, level 0",
        "&lt;grip&gt;",
        "Keep",
        "left_joint3 locks",
    ):
        assert word in said


def test_a_path_says_where_it_begins_and_how_long_and_fast_it_is():
    said = ftqp.paths.Line(BODY.pose(BODY.neutral), displacement=(0.0, 0.0, 0.2), duration=2.0)._repr_html_()
    assert "Line" in said and "0.2 m" in said and "2 s" in said and "0.1" in said
