"""Codes of the methods beside the active set: closed forms, rules of damping, iterations, traced curves."""

from enum import IntEnum


class ClosedForm(IntEnum):
    """Closed forms: x = J^+ b with scaled columns, its damped form, or the approximate pseudoinverse."""

    PSEUDOINVERSE = 0
    DAMPED = 1
    APPROXIMATE = 2


PSEUDOINVERSE, DAMPED, APPROXIMATE = map(int, ClosedForm)


class Rule(IntEnum):
    """Rules of the damping factor, see ``ftqp.kernel.closed_forms.damping_factor``."""

    BOUND = 0
    BOUND_2 = 1
    TIGHT = 2
    ROW = 3
    EXACT_2 = 4
    EXACT_INF = 5


BOUND, BOUND_2, TIGHT, ROW, EXACT_2, EXACT_INF = map(int, Rule)


class Iteration(IntEnum):
    """Methods of the network, by formula in ``ftqp.kernel.dtrnn.iterations``."""

    LVI94 = 0
    E47 = 1
    IMPLICIT = 2


LVI94, E47, IMPLICIT = map(int, Iteration)


class CurveEnd(IntEnum):
    """How a traced curve ended."""

    CUT = 0  # at a joint limit, or where it could not be followed
    CLOSED = 1
    UNFINISHED = 2  # its memory was full


CUT, CLOSED, UNFINISHED = map(int, CurveEnd)
