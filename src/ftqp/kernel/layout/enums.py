"""The integer codes that the record carries, in one place."""

from typing import Final

JOINTS: Final = 32
"""Capacity: joints of one record."""
ROWS: Final = 6
"""Capacity: task rows (a pose)."""
VARIABLES: Final = JOINTS + 1
"""Capacity: QP variables, the joints and the path scale."""

VELOCITY: Final = 0
ACCELERATION: Final = 1

HARD: Final = 0
SLACK: Final = 1
SCALE: Final = 2
LEXICOGRAPHIC: Final = 3

VIABILITY: Final = 0
JIN: Final = 1
ONE_STEP: Final = 2

HEALTHY: Final = 0
BRAKING: Final = 1
LOCKED: Final = 2
FREE: Final = 3
INSTANT: Final = 4
"""Locks at once: the velocity is reset at the next tick, after which the joint is LOCKED."""

RESET_KINEMATIC: Final = 0
RESET_MOMENTUM: Final = 1
RESET_TASK: Final = 2

SOLVED: Final = 0
MAX_ITERATIONS: Final = 1
INFEASIBLE: Final = 2
FAILED: Final = 3

OK: Final = 0
RELAXED: Final = 1
SCALED: Final = 2
FALLBACK: Final = 3
STOPPING: Final = 4
STOPPED: Final = 5
INVALID_INPUT: Final = 6

READY: Final = 100
"""The QP is assembled and waits for a solver."""
SOLVE: Final = 101
"""A substitute QP waits for the in-kernel solver."""
ANSWERED: Final = 102
"""An external solver has answered."""

FIRST_STAGE: Final = 0
MAIN_STAGE: Final = 1
RELAX_STAGE: Final = 2
ELASTIC_STAGE: Final = 3
REST_STAGE: Final = 4
REST_ELASTIC_STAGE: Final = 5

WRONG_SHAPE: Final = -1
NO_ROTATION: Final = -2
"""The task has rotation rows but the target carries a position only."""
NOT_RESET: Final = -3

NO_LIMIT: Final = 0
BY_ACCELERATION: Final = 1
BY_VELOCITY: Final = 2
BY_POSITION: Final = 3
BY_FAULT: Final = 4

TARGET_POSE: Final = 0
"""Offset of the pose, 16 numbers by rows, in a packed target."""
TARGET_TWIST: Final = 16
TARGET_ACCELERATION: Final = 22
TARGET_HAS_ROTATION: Final = 28
TARGET_SIZE: Final = 29

DELAYS: Final = 64
"""Capacity: samples by which a measurement of a moving base may be late, plus one."""

ESTIMATED_ATTITUDE: Final = 0
NOMINAL_ATTITUDE: Final = 1
MEASURED_ATTITUDE: Final = 2

HAS_TIP: Final = 1
"""What is measured at a tick of a moving base, bit by bit."""
HAS_POSITION: Final = 2
"""Of the tip the position only."""
HAS_BASE: Final = 4
HAS_TWIST: Final = 8

BASE_TRACKING: Final = 0
BASE_SATURATED: Final = 1
BASE_RANK_DEFICIENT: Final = 2
BASE_UNREACHABLE: Final = 3
BASE_STALE: Final = 4
BASE_HALTED: Final = 5
PSEUDOINVERSE: Final = 0
"""Closed forms: x = J^+ b, weights by scaled columns."""
DAMPED: Final = 1
APPROXIMATE: Final = 2

BOUND: Final = 0
"""Rules of the damping factor, see ``ftqp.kernel.closed_forms.damping_factor``."""
BOUND_2: Final = 1
TIGHT: Final = 2
ROW: Final = 3
EXACT_2: Final = 4
EXACT_INF: Final = 5
