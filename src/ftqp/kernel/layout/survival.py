"""What becomes of a motion after a failure, to the end of its path."""

from enum import IntEnum


class Survival(IntEnum):
    """How the continuation of one pair of joint and instant ends.

    The path is finished, or it is not: a joint meets its position limit, a joint would have to be too fast,
    the joints that are left become singular, at once or so that a speed limit is met first, no solution is
    found, the plan itself is outside its limits at the failure, the error leaves its tolerance, the joint is
    one that this task can never do without, or a body comes too near to another one.
    """

    SURVIVED = 0
    LIMIT = 1
    VELOCITY = 2
    SINGULAR = 3
    SINGULAR_VELOCITY = 4
    NOT_CONVERGED = 5
    NOMINAL = 6
    ERROR = 7
    STRUCTURAL = 8
    TOO_NEAR = 9


(
    SURVIVED,
    LIMIT,
    VELOCITY,
    SINGULAR,
    SINGULAR_VELOCITY,
    NOT_CONVERGED,
    NOMINAL,
    ERROR,
    STRUCTURAL,
    TOO_NEAR,
) = map(int, Survival)
