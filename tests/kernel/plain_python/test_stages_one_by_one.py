"""The stages of the cascade one by one: which comes next, what is said of it, and what each leaves behind."""

from math import inf, nan

import numpy as np
import pytest
from stages import N, answers, record, stubs

from ftqp.kernel.judge import fallback_cascade, stage_problems
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    CALM_ELASTIC_STAGE,
    CALM_STAGE,
    CLIP_STAGE,
    ELASTIC_STAGE,
    FAILED,
    FALLBACK,
    FIRST_STAGE,
    HARD,
    INFEASIBLE,
    LEAST_EXCESS_STAGE,
    LEXICOGRAPHIC,
    MAIN_STAGE,
    OK,
    PLAIN_STAGE,
    QP_READY,
    RELAX_STAGE,
    RELAXED,
    REST_ELASTIC_STAGE,
    REST_STAGE,
    SCALE,
    SCALED,
    SLACK,
    SOLVE,
    SOLVED,
    STOPPED,
    STOPPED_BY_FALLBACKS,
    STOPPING,
    VELOCITY,
)

STAGES = (
    MAIN_STAGE,
    RELAX_STAGE,
    ELASTIC_STAGE,
    REST_STAGE,
    REST_ELASTIC_STAGE,
    LEAST_EXCESS_STAGE,
    PLAIN_STAGE,
)


BEGUN = dict.fromkeys(
    (
        "begin_second_stage", "begin_relaxed", "begin_relaxed_after_calm", "begin_least_excess",
        "box_excludes_rows", "begin_elastic", "begin_plain", "begin_decay", "begin_elastic_rest",
    )
)  # fmt: skip
"""Parts that pose the QPs of stages, which pose nothing."""


@pytest.mark.parametrize(
    ("stage", "mode", "external", "claim", "part", "after", "says"),
    [
        (MAIN_STAGE, SLACK, 0, FAILED, "begin_least_excess", LEAST_EXCESS_STAGE, FALLBACK),
        (MAIN_STAGE, SLACK, 0, INFEASIBLE, "begin_least_excess", LEAST_EXCESS_STAGE, FALLBACK),
        (MAIN_STAGE, SLACK, 1, INFEASIBLE, "begin_relaxed", RELAX_STAGE, FALLBACK),
        (MAIN_STAGE, HARD, 0, INFEASIBLE, "begin_relaxed", RELAX_STAGE, RELAXED),
        (MAIN_STAGE, HARD, 0, FAILED, "begin_relaxed", RELAX_STAGE, FALLBACK),
        (MAIN_STAGE, HARD, 1, INFEASIBLE, "begin_relaxed", RELAX_STAGE, FALLBACK),
        (MAIN_STAGE, SCALE, 0, INFEASIBLE, "begin_relaxed", RELAX_STAGE, FALLBACK),
        (RELAX_STAGE, HARD, 0, FAILED, "begin_least_excess", LEAST_EXCESS_STAGE, 77),
        (ELASTIC_STAGE, HARD, 0, FAILED, "begin_plain", PLAIN_STAGE, 77),
        (LEAST_EXCESS_STAGE, HARD, 0, FAILED, "begin_decay", REST_STAGE, FALLBACK),
        (PLAIN_STAGE, HARD, 0, FAILED, "begin_decay", REST_STAGE, FALLBACK),
        (REST_STAGE, HARD, 0, FAILED, "begin_elastic_rest", REST_ELASTIC_STAGE, 77),
    ],
)
def test_a_bad_answer_leads_to_the_next_rung(monkeypatch, stage, mode, external, claim, part, after, says):
    K = record(stage, mode, external=external, outcome=77)
    asked = stubs(monkeypatch, check_solution=False, **BEGUN)
    assert fallback_cascade._advance(K, claim) == SOLVE
    assert asked == [part]
    assert (K.cascade.stage, K.cascade.outcome, K.qp.warm) == (after, says, 0)


def test_torque_rows_are_hard_again_in_the_decay_and_give_way_where_even_that_fails(monkeypatch):
    for latched in (0, 1):
        K = record()
        K.qp.soft_rows, K.watch.latched = 0.5, latched
        answers(monkeypatch, stage_problems, begin_rest=None)
        stage_problems.begin_decay(K)
        assert K.qp.soft_rows == 0.0
        asked = answers(monkeypatch, stage_problems, only_brake=None)
        stage_problems.begin_elastic_rest(K)
        assert K.qp.soft_rows == stage_problems.REST_ELASTIC and asked == ["only_brake"] * latched


def test_a_relaxed_task_is_made_compliant_once(monkeypatch):
    for mode, made in ((SLACK, []), (HARD, ["compliance"]), (SCALE, ["compliance"])):
        asked = answers(monkeypatch, stage_problems, compliance=None)
        stage_problems.begin_relaxed(record(MAIN_STAGE, mode))
        assert asked == made


@pytest.mark.parametrize("stage", STAGES)
def test_a_claim_counts_only_where_it_is_solved_and_judged_good(monkeypatch, stage):
    """An answer that is checked already is not checked again."""
    for claim, checked, good, ends in (
        (SOLVED, 0, True, True),
        (SOLVED, 0, False, False),
        (SOLVED, 1, False, True),
        (FAILED, 0, True, False),
    ):
        K = record(stage, outcome=FALLBACK, checked=checked)
        asked = stubs(monkeypatch, check_solution=good, clip_rest=None, joints_outside=0, **BEGUN)
        code = fallback_cascade._advance(K, claim)
        assert ("check_solution" in asked) == (claim == SOLVED and checked == 0)
        if stage == REST_ELASTIC_STAGE:  # the last stage always has a command
            assert "command" in asked and ("clip_rest" in asked) == (not ends)
        elif stage == LEAST_EXCESS_STAGE and ends:
            assert code == SOLVE and "begin_elastic" in asked
        else:
            assert ("command" in asked) == ends and (code == SOLVE) == (not ends)


@pytest.mark.parametrize(
    ("stage", "mode", "external", "missed", "was", "says"),
    [
        (MAIN_STAGE, SLACK, 0, False, FALLBACK, OK),
        (MAIN_STAGE, SLACK, 0, True, FALLBACK, RELAXED),
        (RELAX_STAGE, HARD, 0, True, FALLBACK, RELAXED),
        (RELAX_STAGE, HARD, 0, False, FALLBACK, FALLBACK),
        (RELAX_STAGE, HARD, 1, True, FALLBACK, RELAXED),
        (RELAX_STAGE, SLACK, 1, True, FALLBACK, FALLBACK),
        (RELAX_STAGE, SLACK, 0, True, FALLBACK, RELAXED),
        (ELASTIC_STAGE, SLACK, 0, True, FALLBACK, RELAXED),
        (PLAIN_STAGE, SLACK, 0, True, FALLBACK, RELAXED),
        (REST_STAGE, HARD, 0, True, FALLBACK, FALLBACK),
        (REST_STAGE, HARD, 0, True, STOPPING, STOPPING),
    ],
)
def test_what_is_said_of_a_good_answer(monkeypatch, stage, mode, external, missed, was, says):
    K = record(stage, mode, external=external, outcome=was)
    K.cascade.missed = 1
    stubs(monkeypatch, check_solution=True, joints_outside=0, _misses_task=missed)
    assert fallback_cascade._advance(K, SOLVED) == says
    if stage != REST_STAGE:
        assert K.cascade.missed == missed
    assert K.cascade.claim == (SOLVED if stage == MAIN_STAGE else 0)


def test_the_rate_of_a_path_is_the_last_variable_where_there_is_one(monkeypatch):
    for mode, stage, scale in ((SCALE, MAIN_STAGE, 0.4), (SLACK, MAIN_STAGE, 1.0), (SCALE, REST_STAGE, 0.9)):
        K = record(stage, mode)
        K.task.scale, K.qp.x[N] = 0.9, 0.4
        stubs(monkeypatch, check_solution=True, joints_outside=0, _misses_task=False)
        code = fallback_cascade._advance(K, SOLVED)
        assert K.task.scale == scale
        assert stage == REST_STAGE or code == (SCALED if mode == SCALE else OK)


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [("missed", 1, RELAXED), ("outside", 1, RELAXED), ("jump", 0.99, RELAXED), ("given_up", 1, RELAXED),
     ("scale", 0.9, SCALED), ("scale", 1.0, OK), ("count", 1, RELAXED)],
)  # fmt: skip
def test_a_solved_qp_is_ok_where_nothing_is_left_out(field, value, says):
    K = record()
    if field == "count":  # a further task that is required and missed
        K.terms.missed = 1
    room = {"given_up": K.task, "scale": K.task, "count": K.terms}.get(field, K.cascade)
    room[field] = value
    assert fallback_cascade._outcome_of_solved(K.task, K.cascade, K.terms) == says


def test_a_task_is_missed_beyond_a_thousandth_of_what_is_asked_and_a_tenth_of_a_millimetre():
    for asked, beyond, slack, missed in (
        (0.0, 0.0, 0.99e-4, False), (0.0, 0.0, 1.01e-4, True), (2.0, 0.0, 2.09e-3, False),
        (2.0, 0.0, 2.11e-3, True), (0.0, 3.0, 3.09e-3, False), (0.0, 3.0, 3.11e-3, True),
    ):  # fmt: skip
        for row in range(2):
            for sign in (1.0, -1.0):
                K = record()
                K.task.asked[row], K.task.beyond, K.task.slack[1 - row] = sign * asked, beyond, -sign * slack
                assert fallback_cascade._misses_task(K.task) == missed


def test_torque_rows_are_added_where_an_answer_without_them_is_no_good(monkeypatch):
    for on_demand, has_dynamics, good, keeps, adds in (
        (1, 0, True, False, True), (1, 0, False, True, True), (1, 0, True, True, False),
        (1, 1, True, False, False), (0, 0, True, False, False),
    ):  # fmt: skip
        for stage in (MAIN_STAGE, CALM_STAGE):
            K = record(stage)
            K.limits.on_demand, K.kinematics.has_dynamics = on_demand, has_dynamics
            asked = stubs(
                monkeypatch, check_solution=good, keeps_torque=keeps, add_constraints=None, joints_outside=0,
                **BEGUN,
            )  # fmt: skip
            code = fallback_cascade._advance(K, SOLVED)
            assert ("add_constraints" in asked) == adds and (not adds or K.cascade.stage == stage)
            assert not adds or (code == SOLVE and K.qp.warm == 7)


@pytest.mark.parametrize("stage", [*STAGES, CALM_STAGE, CALM_ELASTIC_STAGE, CLIP_STAGE])
@pytest.mark.parametrize("says", [FALLBACK, RELAXED])
def test_only_fallbacks_without_the_task_are_counted_and_too_many_latch_the_stop(monkeypatch, stage, says):
    stubs(monkeypatch)
    if stage == LEAST_EXCESS_STAGE:
        return  # its answer is no command
    K = record(stage, outcome=says)
    K.watch.fallbacks = 3
    assert fallback_cascade._finish(K) == says == K.cascade.status
    counts = says == FALLBACK and stage in (REST_STAGE, REST_ELASTIC_STAGE, CLIP_STAGE)
    assert K.watch.fallbacks == (4 if counts else 0) and K.watch.latched == int(counts)
    assert K.watch.reason == (STOPPED_BY_FALLBACKS if counts else 0)
    K.watch.fallbacks, K.watch.latched, K.watch.reason = 2, 0, 0
    fallback_cascade._finish(K)
    assert K.watch.latched == 0, "not before there are more than the limit"
    K.watch.fallbacks, K.watch.latched, K.watch.reason = 9, 1, 5
    fallback_cascade._finish(K)
    assert K.watch.reason == 5, "what latched it first is the reason"


@pytest.mark.parametrize(
    ("stage", "external", "warm"),
    [(MAIN_STAGE, 0, 7), (MAIN_STAGE, 1, 7), (CALM_STAGE, 0, 7), (CALM_STAGE, 1, 0), (RELAX_STAGE, 0, 0),
     (REST_STAGE, 0, 0), (FIRST_STAGE, 0, 0)],
)  # fmt: skip
def test_a_working_set_is_kept_for_the_same_qp_only(monkeypatch, stage, external, warm):
    stubs(monkeypatch)
    K = record(stage, external=external, outcome=OK)
    K.qp.soft_rows = 0.5
    fallback_cascade._finish(K)
    assert K.qp.warm == warm and K.qp.soft_rows == 0.0


def test_multipliers_of_a_relaxed_lexicographic_tick_are_those_of_its_first_stage(monkeypatch):
    stubs(monkeypatch)
    for mode, says, first in (
        (LEXICOGRAPHIC, RELAXED, True),
        (LEXICOGRAPHIC, OK, False),
        (SLACK, RELAXED, False),
    ):
        K = record(MAIN_STAGE, mode, outcome=says)
        K.qp.nc = 3
        K.cascade.z_box_first[:N], K.cascade.z_first[:3] = 2.0, 3.0
        fallback_cascade._finish(K)
        assert (K.qp.z_box[:N] == (2.0 if first else 0.0)).all() and (
            K.qp.z[:3] == (3.0 if first else 0.0)
        ).all()


@pytest.mark.parametrize("dense", [0, 1])
def test_lexicographic_stages_put_the_objective_aside_and_take_what_the_first_left(monkeypatch, dense):
    rng = np.random.default_rng(0)
    K = record(FIRST_STAGE, LEXICOGRAPHIC)
    g, H, A, x = rng.normal(size=N), rng.uniform(1.0, 2.0, N), rng.normal(size=(2, N)), rng.normal(size=N)
    K.qp.g[:N], K.qp.H_diagonal[:N], K.qp.dense, K.qp.A[:2, :N], K.qp.nc = g, H, dense, A, 2
    soft = []
    stubs(monkeypatch)
    answers(monkeypatch, stage_problems, compliance=lambda *given: soft.append(given[-1]))
    stage_problems.begin_first_stage(K)
    assert not K.qp.g[:N].any() and (K.qp.H_diagonal[:N] == 1.0).all() and K.qp.dense == 0 == K.qp.warm
    for claim in (SOLVED, FAILED):
        K.qp.x[:N], K.qp.b[:2], K.qp.z_box[:N], K.qp.z[:2], K.qp.warm = x, 9.0, 0.5, 0.25, 7
        K.turned.softness[:2] = 1.0
        K.cascade.stage = FIRST_STAGE
        assert fallback_cascade._advance(K, claim) == QP_READY
        assert (
            np.array_equal(K.qp.g[:N], g) and np.array_equal(K.qp.H_diagonal[:N], H) and K.qp.dense == dense
        )
        assert K.qp.b[:2] == pytest.approx(A @ x if claim == SOLVED else [9.0, 9.0])
        assert (K.cascade.z_box_first[:N] == 0.5).all() and (K.cascade.z_first[:2] == 0.25).all()
        assert K.cascade.stage == MAIN_STAGE and K.qp.warm == 0 and not K.turned.softness[:2].any()
    assert soft == [
        stage_problems.RELAXED_RATIO,
        stage_problems.SECOND_STAGE_RATIO,
        stage_problems.SECOND_STAGE_RATIO,
    ]


@pytest.mark.parametrize("excluded", [True, False])
def test_torque_limits_give_way_and_it_is_said_why(monkeypatch, excluded):
    K = record(LEAST_EXCESS_STAGE, outcome=FALLBACK)
    asked = stubs(monkeypatch, check_solution=True, box_excludes_rows=excluded)
    posed = answers(monkeypatch, stage_problems, make_room=None, compliance=None)
    assert fallback_cascade._advance(K, SOLVED) == SOLVE
    assert K.cascade.stage == ELASTIC_STAGE and K.cascade.outcome == (RELAXED if excluded else FALLBACK)
    assert asked == ["check_solution", "box_excludes_rows"] and posed == ["make_room", "compliance"]


@pytest.mark.parametrize("level", [ACCELERATION, VELOCITY])
def test_the_last_resort_is_the_rest_within_the_box_and_always_a_number(monkeypatch, level):
    K = record(REST_ELASTIC_STAGE, outcome=FALLBACK)
    K.qp.g[:N], K.qp.lb[:N], K.qp.ub[:N] = [-0.5, 2.0, -9.0, nan], [-1, -1, -1, -inf], [1, 1, 1, inf]
    kept = []
    asked = stubs(monkeypatch, check_solution=False, command=lambda K: kept.append("command"))
    answers(monkeypatch, stage_problems, keep_free_rows=lambda *given: kept.append("free rows"))
    assert fallback_cascade._advance(K, FAILED) == FALLBACK
    assert K.qp.x[:N].tolist() == [0.5, -1.0, 1.0, 0.0]
    assert kept == ["free rows", "command"] and K.cascade.stage == CLIP_STAGE and asked


@pytest.mark.parametrize(
    ("stage", "claim", "good", "nc", "after", "says"),
    [
        (CALM_STAGE, SOLVED, True, 3, None, OK),
        (CALM_ELASTIC_STAGE, SOLVED, True, 3, None, 77),
        (CALM_STAGE, INFEASIBLE, True, 3, CALM_ELASTIC_STAGE, RELAXED),
        (CALM_STAGE, FAILED, True, 3, CALM_ELASTIC_STAGE, FALLBACK),
        (CALM_STAGE, SOLVED, False, 3, CALM_ELASTIC_STAGE, FALLBACK),
        (CALM_STAGE, SOLVED, False, 0, RELAX_STAGE, FALLBACK),
        (CALM_ELASTIC_STAGE, SOLVED, False, 3, RELAX_STAGE, 77),
    ],
)
def test_in_calm_torque_limits_give_way_first_and_then_the_task(
    monkeypatch, stage, claim, good, nc, after, says
):
    rng = np.random.default_rng(1)
    K = record(stage, outcome=77)
    A, x, asked_of = rng.normal(size=(2, N)), rng.normal(size=N), rng.normal(size=2)
    K.qp.A[:2, :N], K.qp.x[:N], K.task.asked[:2], K.qp.nc = A, x, asked_of, nc
    if stage == CALM_ELASTIC_STAGE:
        K.qp.soft_rows = stage_problems.CALM_ELASTIC
    stubs(monkeypatch, check_solution=good, joints_outside=0, _misses_task=False)
    posed = answers(monkeypatch, stage_problems, objective=None, compliance=None)
    code = fallback_cascade._advance(K, claim)
    assert (code != SOLVE) == (after is None) and K.cascade.outcome == says
    if stage == CALM_STAGE:
        assert K.cascade.claim == claim
    if after is None:
        assert K.task.slack[:2] == pytest.approx(A @ x - asked_of) and K.task.scale == 1.0
        return
    assert K.cascade.stage == after and K.qp.warm == 0
    if after == CALM_ELASTIC_STAGE:
        assert K.qp.soft_rows == stage_problems.CALM_ELASTIC
    else:
        assert K.qp.soft_rows == 0.0 and posed == ["objective", "compliance"]
        assert (K.qp.meq, K.qp.nx) == (2, N) and K.qp.b[:2] == pytest.approx(asked_of)


def test_in_calm_the_rate_of_a_path_is_the_last_variable(monkeypatch):
    K = record(CALM_STAGE)
    K.qp.nx, K.qp.x[N], K.qp.A[:2, N] = N + 1, 0.3, [1.0, 2.0]
    stubs(monkeypatch, check_solution=True, joints_outside=0)
    fallback_cascade._advance(K, SOLVED)
    assert K.task.scale == 0.3 and K.task.slack[:2] == pytest.approx([0.3, 0.6])


def test_the_solver_is_asked_for_every_qp_but_straight_answers_of_the_main_one(monkeypatch):
    for stage, is_straight, solver in (
        (MAIN_STAGE, True, False),
        (MAIN_STAGE, False, True),
        (RELAX_STAGE, True, True),
        (CALM_STAGE, True, True),
    ):
        K = record(stage, qp_iterations=-5)
        K.qp.iterations = 9
        said = []
        asked = stubs(
            monkeypatch, straight=is_straight, active_set=FAILED,
            _advance=lambda K, claim, said=said: said.append((claim, int(K.cascade.checked))) or OK,
        )  # fmt: skip
        assert fallback_cascade.run_cascade(K, QP_READY, INFEASIBLE) == OK
        assert ("straight" in asked) == (stage == MAIN_STAGE) and ("active_set" in asked) == solver
        assert said == [(FAILED, 0) if solver else (SOLVED, 1)]
        assert K.cascade.qp_iterations == (9 if stage in (MAIN_STAGE, CALM_STAGE) else -5)


def test_the_cascade_goes_on_until_there_is_a_command_and_waits_for_an_external_solver(monkeypatch):
    K = record(MAIN_STAGE, external=1)
    asked = stubs(monkeypatch)
    assert fallback_cascade.run_cascade(K, QP_READY, SOLVED) == QP_READY and asked == []
    codes = [SOLVE, QP_READY, OK]
    for external, first, solved, ends in ((0, SOLVE, 3, OK), (1, SOLVE, 2, QP_READY), (1, 99, 1, QP_READY)):
        left = list(codes)
        K = record(RELAX_STAGE, external=external)
        asked = stubs(monkeypatch, active_set=SOLVED, _advance=lambda K, claim, left=left: left.pop(0))
        assert fallback_cascade.run_cascade(K, first, SOLVED) == ends
        assert asked.count("active_set") == solved


@pytest.mark.parametrize(
    ("v", "v_max", "said"), [(1e-4, 2.0, STOPPED), (-0.1, 2.0, STOPPING), (0.1, inf, STOPPING)]
)
def test_stopped_is_not_said_of_a_tick_that_sets_a_joint_in_motion(monkeypatch, v, v_max, said):
    """As beside a joint that swings freely: ten million corrupted steps had 40 of them."""
    K = record(outcome=STOPPED)
    K.limits.v_max[2] = v_max
    K.state.v_command[2] = v
    stubs(monkeypatch)
    assert fallback_cascade._finish(K) == said
