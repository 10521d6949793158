"""Constraints of which the checker has no law are named when a campaign is loaded."""

import logging
from types import SimpleNamespace

import ftqp
from ftqp.app.campaign.episode_study import _say_what_is_not_judged

PANDA = ftqp.robots.load("panda")
KEPT = ftqp.Keep("panda_joint7", above=(-2.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0))


def fill(state, C, l, u):
    """The speed of the first joint."""
    C[0, 0], l[0], u[0] = 1.0, -1.0, 1.0


def said(caplog, *constraints):
    """What is said of a planner with these."""
    planner = ftqp.Planner(PANDA, 0.002, constraints=[*constraints, ftqp.TorqueLimits()])
    with caplog.at_level(logging.WARNING, logger="ftqp"):
        _say_what_is_not_judged(SimpleNamespace(planner=planner))
    return [record.getMessage() for record in caplog.records]


def test_a_constraint_without_a_law_is_named(caplog):
    (sentence,) = said(caplog, KEPT, ftqp.Rows(1, fill, name="slow"))
    assert sentence == (
        "no law of the checker is about the constraint 'slow': whether the arm keeps to it is not judged"
    )


def test_what_has_a_law_is_not_named(caplog):
    assert said(caplog, KEPT) == []
