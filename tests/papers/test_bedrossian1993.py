"""Bedrossian 1993, "Fault tolerant kinematic control of hyper-redundant manipulators": its closed forms.

``docs/evidence/bedrossian1993.md`` has them beside the published ones; chaotic ones (start N without a rule
that keeps the arm in its plane) are not tested.
"""

import numpy as np
import pytest
from tests.papers.bedrossian1993 import (
    DEG,
    INCH,
    LENGTH,
    LIMIT,
    LOCKS_1,
    LOCKS_2,
    MANOEUVRE_1,
    MANOEUVRE_2,
    Q1,
    Q2,
    REFERENCE,
    START_R,
    jacobian,
    progress,
    run,
    scaled,
)

import ftqp

ROBOT = ftqp.robots.load("modular11")
RULES = ("bound", "bound_2", "tight", "row", "exact_inf", "exact_2")


def robust(rule, limit=LIMIT):
    """The scheme of a scenario."""
    return {"name": "singularity_robust", "rule": rule, "limit": float(limit)}


def free(locks, n=11):
    return [i for i in range(n) if i not in locks]


def random_case(rng):
    """A posture of the arm, a lock set of up to five joints and a task, linear rows in lengths."""
    q = rng.uniform(-np.pi, np.pi, 11)
    locks = tuple(sorted(rng.choice(11, int(rng.integers(0, 6)), replace=False)))
    return scaled(jacobian(ROBOT, q)), locks, rng.normal(size=6)


# Section 2 and 3: the literal forms of the paper


def test_equation_3_is_the_reduced_pseudoinverse():
    rng = np.random.default_rng(0)
    worst = 0.0
    for _ in range(300):
        J, locks, xdot = random_case(rng)
        B = np.eye(11)
        B[list(locks), list(locks)] = 0.0
        literal = B @ J.T @ np.linalg.solve(J @ B @ J.T, xdot)
        x = ftqp.resolve_rates(J, xdot, locks)
        if np.linalg.cond(J[:, free(locks)]) < 1e3:
            worst = max(worst, np.abs(x - literal).max() / np.abs(literal).max())
        assert not x[list(locks)].any()
    assert 0.0 < worst < 1e-8


def test_equation_8_is_the_damped_reduced_inverse():
    rng = np.random.default_rng(1)
    for _ in range(300):
        J, locks, xdot = random_case(rng)
        undamped = np.abs(ftqp.resolve_rates(J, xdot, locks)).max()
        limit = undamped * rng.uniform(0.05, 0.9)
        x = ftqp.resolve_rates(J, xdot, locks, method="dls", damping=ftqp.Damping(rule="bound"), limits=limit)
        kappa = ftqp.damping_factor(J, xdot, limit, "bound", locks)
        A = np.eye(11)[list(locks)]
        Pinv = np.linalg.inv(J.T @ J + kappa * np.eye(11))
        held = A.T @ np.linalg.solve(A @ Pinv @ A.T, A @ Pinv) if locks else 0.0
        literal = Pinv @ (np.eye(11) - held) @ J.T @ xdot
        assert np.abs(x - literal).max() < 1e-8 * np.abs(literal).max()
        assert not x[list(locks)].any()


def test_equation_8_loses_digits_at_tiny_kappa_and_the_reduced_form_does_not():
    J, xdot = scaled(jacobian(ROBOT, Q1)), MANOEUVRE_1 / LENGTH
    U, s, Vt = np.linalg.svd(J[:, free(LOCKS_1)], full_matrices=False)
    kappa = 3e-12 * s[0] ** 2
    A = np.eye(11)[list(LOCKS_1)]
    Pinv = np.linalg.inv(J.T @ J + kappa * np.eye(11))
    literal = Pinv @ (np.eye(11) - A.T @ np.linalg.solve(A @ Pinv @ A.T, A @ Pinv)) @ J.T @ xdot
    reduced = Vt.T @ (s / (s * s + kappa) * (U.T @ xdot))
    lost = np.abs(literal[free(LOCKS_1)] - reduced).max() / np.abs(reduced).max()
    assert lost > 1e-8  # about 1e-6; how much exactly is up to rounding in LAPACK
    assert ftqp.resolve_rates(J, xdot, LOCKS_1)[free(LOCKS_1)] == pytest.approx(
        np.linalg.pinv(J[:, free(LOCKS_1)]) @ xdot, abs=1e-11
    )


def test_a_joint_that_drifts_is_made_up_for_by_the_others():
    J, xdot = scaled(jacobian(ROBOT, Q1)), MANOEUVRE_1 / LENGTH
    x = ftqp.resolve_rates(J, xdot, LOCKS_1, locked_rates=[0.1, -0.2, 0.05])
    assert J @ x == pytest.approx(xdot, abs=1e-12)
    assert np.array_equal(x[list(LOCKS_1)], [0.1, -0.2, 0.05])


# Section 4: kappa


PSTAR = {  # limit [deg/s]: rule: kappa, largest rate [deg/s], relative residual
    20.0: {
        "bound": (0.127048, 4.1425, 0.131021),
        "bound_2": (0.0569932, 4.5923, 0.093305),
        "tight": (0.0934629, 4.3336, 0.112961),
        "row": (2.64077e-4, 17.6849, 0.028964),
        "exact_inf": (1.83955e-4, 20.0, 0.022833),
        "exact_2": (3.68477e-4, 15.3703, 0.035094),
    },
    5.0: {
        "bound": (2.03277, 1.9841, 0.387877),
        "bound_2": (0.911891, 2.5383, 0.319008),
        "tight": (1.88912, 2.0292, 0.382075),
        "row": (0.128966, 4.1325, 0.132024),
        "exact_inf": (0.02202, 5.0, 0.077656),
        "exact_2": (0.184825, 3.8745, 0.159424),
    },
}


@pytest.mark.parametrize("limit", PSTAR)
@pytest.mark.parametrize("rule", RULES)
def test_reference_posture(rule, limit):
    J = jacobian(ROBOT, REFERENCE)
    kappa, largest, residual = PSTAR[limit][rule]
    found = ftqp.damping_factor(J, MANOEUVRE_2, limit * DEG, rule, LOCKS_2, characteristic_length=LENGTH)
    assert found == pytest.approx(kappa, rel=1e-4)
    x = ftqp.resolve_rates(
        J, MANOEUVRE_2, LOCKS_2, method="dls", damping=ftqp.Damping(rule=rule), limits=limit * DEG,
        characteristic_length=LENGTH,
    )  # fmt: skip
    assert np.abs(x).max() / DEG == pytest.approx(largest, rel=1e-4)
    left = scaled(MANOEUVRE_2) - scaled(J) @ x
    assert np.linalg.norm(left) / np.linalg.norm(scaled(MANOEUVRE_2)) == pytest.approx(residual, rel=1e-4)


def test_reference_posture_has_its_pseudoinverse_and_its_thin_norm():
    J = jacobian(ROBOT, REFERENCE)
    x = ftqp.resolve_rates(J, MANOEUVRE_2, LOCKS_2, characteristic_length=LENGTH) / DEG
    assert x == pytest.approx([0, 0, 0, 0, 0, 19.0724, 0, -28.6217, 0, 9.5493, 0], abs=1e-4)
    kappa = ftqp.damping_factor(J, MANOEUVRE_2, 1.0, "bound", LOCKS_2, characteristic_length=LENGTH)
    assert 2.0 * np.sqrt(kappa) == pytest.approx(1.667216 * 0.1492553, rel=1e-6)


def test_thin_v_is_unique_and_tighter_than_a_square_one():
    J, xdot = scaled(jacobian(ROBOT, Q2)), np.random.default_rng(2).normal(size=6)
    U, _, Vt = np.linalg.svd(J)
    largest = np.abs(U.T @ xdot).max()
    thin = 2.0 * np.sqrt(ftqp.damping_factor(J, xdot, 1.0, "bound")) / largest
    assert thin == pytest.approx(1.556, abs=1e-3)
    square = []
    for seed in range(50):
        turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(5, 5)))[0]
        V = np.vstack([Vt[:6], turn @ Vt[6:]]).T
        square.append(np.abs(V).sum(axis=1).max())
    assert min(square) > 2.2 and max(square) < 2.8 and max(square) - min(square) > 0.1


def test_result_does_not_depend_on_the_unit_of_length():
    J, limit = jacobian(ROBOT, REFERENCE), 20.0 * DEG
    metres = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    inches = np.array([1 / INCH] * 3 + [1.0] * 3)
    found = []
    for unit, length in ((metres, LENGTH), (inches, 30.0)):
        for rule in RULES:
            found.append(
                ftqp.resolve_rates(
                    unit[:, None] * J, unit * MANOEUVRE_2, LOCKS_2, method="dls",
                    damping=ftqp.Damping(rule=rule), limits=limit, characteristic_length=length,
                )
            )  # fmt: skip
    for a, b in zip(found[: len(RULES)], found[len(RULES) :], strict=True):
        assert a == pytest.approx(b, abs=1e-13)
    without = [
        ftqp.resolve_rates(unit[:, None] * J, unit * MANOEUVRE_2, LOCKS_2, method="dls", limits=limit)
        for unit in (metres, inches)
    ]
    assert np.abs(without[0] - without[1]).max() > 1e-2  # the paper does not say which it used


# Section 6: the arm


def test_check_values_of_the_arm():
    assert ROBOT.pose(Q1)[:3, 3] / INCH == pytest.approx([113.213489, 53.213489, 73.448632], abs=1e-6)
    pose = ROBOT.pose(Q2)
    assert pose[:3, 3] / INCH == pytest.approx([37.213803, 0.0, 140.418863], abs=1e-6)
    c, s = np.cos(20.0 * DEG), np.sin(20.0 * DEG)
    assert pose[:3, :3] == pytest.approx(np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]), abs=1e-12)


@pytest.mark.parametrize(
    ("q", "locks", "values"),
    [
        (Q1, (), [6.464817, 5.288295, 2.152394, 1.223836, 0.588324, 0.348837]),
        (Q2, (), [6.326615, 4.088023, 2.003008, 1.645697, 0.606653, 0.518691]),
        (REFERENCE, LOCKS_2, [4.04933, 4.02512, 1.80477, 0.62733, 0.53970, 0.0206026]),
        (Q1, LOCKS_1, [None, None, None, None, None, 0.310438]),
        (Q2, LOCKS_2, [None, None, None, None, None, 0.198673]),
    ],
)
def test_step_measures_are_those_of_the_reduced_jacobian(q, locks, values):
    planner = ftqp.Planner(ROBOT, 0.01, level="velocity")
    planner.reset(q)
    for joint in locks:
        planner.report(ftqp.Locked(joint))
    step = planner.step(q, np.zeros(11), ftqp.Target(pose=ROBOT.pose(q)))
    assert step.sigma_min == pytest.approx(values[-1], abs=1e-6)
    if values[0] is not None:
        assert step.manipulability == pytest.approx(np.prod(values), rel=1e-5)
        assert step.condition == pytest.approx(values[0] / values[-1], rel=1e-5)


# Section 7: experiments


@pytest.fixture(scope="module")
def first():
    """Manoeuvre 1, free and with J1, J6, J7 locked."""
    return [run("pseudoinverse", Q1, MANOEUVRE_1, locks) for locks in ((), LOCKS_1)]


def test_first_manoeuvre_has_its_initial_rates(first):
    open_, locked = (r.rates[0] / DEG for r in first)
    assert open_ == pytest.approx(
        [3.949, 4.495, 2.305, -6.911, 2.853, 7.512, -1.201, 10.193, -3.603, -8.790, -3.603], abs=1e-3
    )
    assert locked == pytest.approx(
        [0, 8.080, 6.899, -8.196, -9.921, 0, 0, 18.106, 0.082, -11.091, 0.082], abs=1e-3
    )
    assert first[0].peak == pytest.approx(10.19, abs=0.01) and first[1].peak == pytest.approx(18.11, abs=0.01)


def test_first_manoeuvre_moves_the_tip_alike_with_and_without_locks(first):
    ideal = MANOEUVRE_1[:3] * 20.0
    errors = [np.linalg.norm(r.tip[-1, :3, 3] - r.tip[0, :3, 3] - ideal) / INCH for r in first]
    assert errors == pytest.approx([0.125, 0.054], abs=1e-3)
    apart = np.abs(first[0].tip[-1, :3, 3] - first[1].tip[-1, :3, 3]) / INCH
    assert apart.max() == pytest.approx(0.081, abs=1e-3)  # the largest component; the distance is 0.118
    assert not (first[1].q[:, list(LOCKS_1)] - Q1[list(LOCKS_1)]).any()
    assert {status.name for r in first for status in r.status} == {"OK"}


def test_first_manoeuvre_has_an_error_of_first_order_in_the_step(first):
    end = first[0].tip[0, :3, 3] + MANOEUVRE_1[:3] * 20.0
    half = run("pseudoinverse", Q1, MANOEUVRE_1, dt=0.005)
    coarse = np.linalg.norm(first[0].tip[-1, :3, 3] - end)
    assert np.linalg.norm(half.tip[-1, :3, 3] - end) == pytest.approx(coarse / 2.0, rel=0.01)


@pytest.mark.parametrize(("gain", "apart"), [(2.0, 0.0057), (10.0, 0.0015)])
def test_first_manoeuvre_with_feedback_closes_the_gap(gain, apart):
    both = [run("pseudoinverse", Q1, MANOEUVRE_1, locks, gain=gain) for locks in ((), LOCKS_1)]
    steps = np.arange(len(both[0].tip))[:, None] * 0.01
    for r in both:
        error = r.tip[:, :3, 3] - r.tip[0, :3, 3] - MANOEUVRE_1[:3] * steps
        assert np.linalg.norm(error, axis=1).max() / INCH < 0.006
    difference = np.abs(both[0].tip[:, :3, 3] - both[1].tip[:, :3, 3]).max() / INCH
    assert difference == pytest.approx(apart, abs=3e-4)


def test_second_manoeuvre_without_locks_stays_below_six_degrees_per_second():
    r = run("pseudoinverse", Q2, MANOEUVRE_2)
    assert r.peak == pytest.approx(5.02, abs=0.01)
    assert int(np.argmax(np.abs(r.rates[0]))) == 9 and np.abs(r.rates[0]).max() / DEG == pytest.approx(r.peak)
    travelled, off, _ = progress(r, MANOEUVRE_2)
    assert travelled == pytest.approx(1.0, abs=1e-4) and off == pytest.approx(0.035, abs=1e-3)


def test_third_experiment_reaches_the_limit_at_two_seconds():
    r = run("pseudoinverse", Q2, MANOEUVRE_2, LOCKS_2, duration=2.5)
    over = np.flatnonzero(np.abs(r.rates).max(axis=1) > LIMIT)
    assert over[0] * 0.01 == pytest.approx(2.21, abs=0.02)


def test_third_experiment_under_equation_16():
    r = run(robust("bound"), Q2, MANOEUVRE_2, LOCKS_2)
    active = np.flatnonzero(r.kappa > 0.0)
    assert active[0] * 0.01 == pytest.approx(2.21, abs=0.02) and active[-1] == len(r.kappa) - 1
    before, after = np.abs(r.rates[active[0] - 1 : active[0] + 1]).max(axis=1) / DEG
    assert before == pytest.approx(47.1, abs=0.1) and after == pytest.approx(6.6, abs=0.1)
    assert r.peak == pytest.approx(47.1, abs=0.1)
    travelled, off, turned = progress(r, MANOEUVRE_2)
    assert travelled == pytest.approx(0.597, abs=0.001)
    assert off == pytest.approx(37.3, abs=0.05) and turned == pytest.approx(27.4, abs=0.05)
    assert np.abs(r.tip[:, 1, 3]).max() / INCH < 1e-3
    assert {s.name for s in r.status[: active[0]]} == {"OK"}
    assert {s.name for s in r.status[active[0] :]} == {"RELAXED"}


@pytest.mark.parametrize(("rule", "after"), [("tight", 8.4), ("row", 47.8), ("exact_inf", 50.0)])
def test_third_experiment_at_activation(rule, after):
    r = run(robust(rule), Q2, MANOEUVRE_2, LOCKS_2, duration=2.3)
    first_active = int(np.flatnonzero(r.kappa > 0.0)[0])
    assert np.abs(r.rates[first_active]).max() / DEG == pytest.approx(after, abs=0.05)


@pytest.mark.parametrize(
    ("rule", "travelled", "off", "turned"),
    [
        ("bound", 92.4, 9.9, 6.8),
        ("bound_2", 94.6, 6.3, 5.5),
        ("tight", 95.2, 4.9, 5.3),
        ("row", 99.3, 0.63, 0.9),
        ("exact_inf", 99.4, 0.57, 0.8),
        ("exact_2", 98.5, 1.3, 1.9),
    ],
)
def test_third_experiment_from_start_r(rule, travelled, off, turned):
    r = run(robust(rule), Q2 + START_R, MANOEUVRE_2, LOCKS_2)
    found = progress(r, MANOEUVRE_2)
    assert 100.0 * found[0] == pytest.approx(travelled, abs=0.06)
    assert found[1] == pytest.approx(off, abs=0.06) and found[2] == pytest.approx(turned, abs=0.06)
    assert r.peak <= 50.0 * (1.0 + 1e-9)
    if rule == "exact_2":
        assert r.peak == pytest.approx(40.5, abs=0.05)


def test_third_experiment_undamped_from_start_r():
    r = run("pseudoinverse", Q2 + START_R, MANOEUVRE_2, LOCKS_2)
    travelled, off, turned = progress(r, MANOEUVRE_2)
    assert travelled == pytest.approx(1.0, abs=1e-3) and 199.0 <= r.peak <= 213.0
    assert off == pytest.approx(0.08, abs=0.005) and turned == pytest.approx(0.10, abs=0.005)


@pytest.mark.parametrize(
    ("rule", "start", "travelled", "off", "turned"),
    [
        ("bound", "N", 54.7, 30.1, 23.5),
        ("bound", "R", 55.7, 28.7, 23.6),
        ("exact_inf", "R", 100.0, 0.47, 0.9),
    ],
)
def test_third_experiment_with_feedback(rule, start, travelled, off, turned):
    r = run(robust(rule), Q2 + (START_R if start == "R" else 0.0), MANOEUVRE_2, LOCKS_2, gain=2.0)
    found = progress(r, MANOEUVRE_2)
    assert 100.0 * found[0] == pytest.approx(travelled, abs=0.06)
    assert found[1] == pytest.approx(off, abs=0.06) and found[2] == pytest.approx(turned, abs=0.06)


@pytest.mark.parametrize(("limit", "travelled"), [(8, 57.7), (10, 58.5), (20, 59.4)])
def test_third_experiment_under_equation_16_with_other_limits(limit, travelled):
    r = run(robust("bound", limit * DEG), Q2, MANOEUVRE_2, LOCKS_2)
    assert 100.0 * progress(r, MANOEUVRE_2)[0] == pytest.approx(travelled, abs=0.06)


@pytest.mark.parametrize(("offset", "peak"), [(0.1, 213.0), (1.0, 47.0), (5.0, 19.0)])
def test_peak_rate_is_set_by_how_exactly_the_arm_is_planar(offset, peak):
    r = run("pseudoinverse", Q2 + START_R * offset / 0.1, MANOEUVRE_2, LOCKS_2, dt=0.002)
    assert r.peak == pytest.approx(peak, rel=0.005)
    assert progress(r, MANOEUVRE_2)[1] < 0.1


@pytest.mark.parametrize(("offset", "first", "second"), [(0.2, 127.5, 325.6), (0.5, 71.5, 90.5)])
def test_peaks_of_both_passages_of_the_stretched_posture(offset, first, second):
    """The arm is stretched near 2.3 s and again near 12.6 s; the second peak is the larger one here."""
    r = run("pseudoinverse", Q2 + START_R * offset / 0.1, MANOEUVRE_2, LOCKS_2, dt=0.002)
    fastest = np.abs(r.rates).max(axis=1) / DEG
    assert fastest[:2500].max() == pytest.approx(first, rel=1e-3)
    assert int(fastest[:2500].argmax()) * 0.002 == pytest.approx(2.27, abs=0.01)
    assert fastest[2500:].max() == pytest.approx(second, rel=1e-3)
    assert (2500 + int(fastest[2500:].argmax())) * 0.002 == pytest.approx(12.65, abs=0.03)


def test_blocked_arm_never_exceeds_the_limit():
    """All rolls locked, too: the path ends after 11.6 in, no damped inverse says so."""
    locks = (*LOCKS_2, 0, 2, 4, 8, 10)
    for rule in RULES:
        r = run(robust(rule), Q2, MANOEUVRE_2, locks)
        assert r.peak <= 50.0 * (1.0 + 1e-9)
        assert progress(r, MANOEUVRE_2)[1] == pytest.approx(37.0, abs=1.0)
        assert r.status[-1] is ftqp.StepStatus.RELAXED
