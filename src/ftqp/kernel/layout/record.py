"""Records: types of all that compiled code reads in place, by name, and that of one planner.

A helper is handed the rooms that it reads and writes, so that its signature says so; stages of a tick, which
touch more of them, take the whole record K. A solver gets ``K.qp`` and nothing else.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any, Final

import numpy as np

from ftqp.core.errors import InputError
from ftqp.kernel.layout import enums, rows
from ftqp.kernel.layout.criteria import COEFFICIENTS
from ftqp.kernel.layout.enums import JOINTS, TASK_ROWS
from ftqp.kernel.layout.feedback_rooms import FEEDBACK_ROOMS
from ftqp.kernel.layout.other_records import CONSTRAINTS, OTHERS, VARIABLES
from ftqp.kernel.layout.other_records import ROWS as EQUALITIES
from ftqp.kernel.layout.rows import CLEARANCES, constraint_capacity
from ftqp.kernel.layout.scene_room import SCENE_ROOMS
from ftqp.kernel.layout.structures import Fields, sections, structure
from ftqp.kernel.layout.ways_room import WAYS

TEXT: Final = f"""
state  Measured state, as given and as the kernel uses it, and the command.
    is_reset level ticks  i8
    unusable  i8  why samples cannot be used, an ``Unusable``
    dt  f8
    q v q_command v_command a_command tau tau_brake given_v  f8[N]
    given_q  f8[2*N]
faults  What is believed of the joints.
    reset_mode working movable  i8
    code  i8[N]  a ``JointCode``
    order  i8[N]  the ``working`` joints, then the free-swinging ones, then those that are held
    lock_rate lock_velocity  f8[N]  deceleration of a joint that is being locked, and its velocity by that
    friction coulomb  f8[N]  of a free-swinging joint [N m s/rad], [N m]
limits  Limits as believed now, and which of them set each end of an interval.
    conversion  i8
    dynamic  i8  there are rows of C, or an objective with inertia
    weakened  i8  so many joints have lost torque
    on_demand  i8  the rows of C are there only where a command would break a torque limit without them
    empty_intervals  i8
    guard  f8  share of a_max up to which torque limits are then not looked at; 0: none
    jin_p jin_v jin_margin jin_upsilon  f8
    q_min q_max v_max a_max  f8[N]
    a_brake  f8[N]  the deceleration that viability may count on
    tau_max  f8[N]
    tau_hold  f8[N]  torque that is to suffice to hold the arm still, of a joint that has lost some; else inf
    lower_by upper_by  i8[N]
task  The task and its error.
    m mode uses_rotation tool_rows has_tip_measured  i8
    given_up  i8  sets of rows that the task has been reduced by, of ``sets``
    velocity_debt  i8  ``lost_velocity`` is being given back
    sets  i8
    healthy_too  i8  rows are given up not only beside a joint that swings freely
    patience  i8  ticks after which each set goes
    late  i8  ticks of it
    held  i8  ticks in which more could be held
    wait  i8  how many of these bring rows back
    kp kv length slack_ratio position_error rotation_error scale  f8
    beyond  f8  what the task asks beside b
    nearest  f8  the least error while it is late [tolerances]
    rows  i8[6]
    m_of tool_of  i8[SETS+1]  ``m`` and ``tool_rows`` of the whole task and of each set
    row_scale  f8[6]  1 for linear rows, the characteristic length for angular ones
    target  f8[TARGET_SIZE]
    error  f8[6]  position and rotation vector from the tip to the target, along W
    lost_velocity  f8[6]  the velocity that a joint took from the tip when it stopped otherwise than foreseen
    seen  f8[6]  the error of the measured tip, of which ``position_error``, ``rotation_error`` are the norms
    slack  f8[6]  A x - asked
    asked  f8[6]  what the task asks for; b differs in lexicographic mode
    yielding  f8[6]  compliance of each component beside that of the task as a whole
    axis  f8[9]  rotation whose z is the tool axis, in the tip frame
    tip_measured  f8[4,4]
criteria  Coefficients, see ``ftqp.kernel.rows.objective``.
    {" ".join(COEFFICIENTS)}  f8
    weight posture  f8[N]
watch  What may stop the arm: thresholds, and what has been seen of them.
    stop_samples rising latched  i8
    stopped  i8  the stop has come to rest
    reason fallbacks fallback_limit  i8
    stop_position stop_rotation last_position_error last_rotation_error  f8
    left  f8  of the task's error, what limits that move the arm have left of it [thresholds]
    rise  f8  time in which a stop brings the deceleration up
cascade  Where a tick stands in the fallback cascade, and what its answer is worth.
    status outcome stage  i8
    external  i8  another solver takes the QP
    claim qp_iterations p  i8
    missed  i8  the command leaves more of the task than counts as none
    outside  i8  how many joints are beyond what is believed of their limits, and whether bodies are too near
    checked  i8  the answer is known to be good
    accept  f8  largest scaled residual that counts as solved
    residual_task residual_bounds residual_dual  f8
    torque_excess  f8  of the command over what is believed of a motor [N m]
    kappa  f8
    jump  f8  share of an instant lock's jump that the other joints' velocities have made
    z_first  f8[constraint_capacity(N)]  multipliers of the first stage of lexicographic mode, which say
        what keeps the task from being followed
    z_box_first  f8[N]
kinematics  The one snapshot of a tick.
    has_dynamics  i8
    sine cosine  f8[N]
    R  f8[N,9]
    o axis_w  f8[N,3]
    R_tip  f8[9]
    o_tip  f8[3]
    J  f8[6,N]
    J_each  f8[6,N]  J before columns of joints that mimic others are added to those of their leaders
    drift  f8[6]
    w alpha  f8[N,3]
    acc  f8[N,3]  of the frame origins, minus gravity
    h  f8[N]
    tau  f8[N]  torques of a command, or bounds on them
    effort  f8[N,2]  memory of torques
    wrench  f8[N,6]  memory of torques
    M  f8[N,N]
    carried  f8[N,16]  what the branches of a tree hand to the joint they hang on
    gained  f8[N,6]  and take from it
chain  Constants of the arm; every joint moves along or about the z axis of its frame.
    n nq has_inertia  i8
    is_tree  i8  any joint but the next one hangs on another
    tip_joint  i8  the joint that the tip moves with
    floating  i8  so many joints, the first ones, have no motor, as a body floats
    mimics  i8  so many joints follow another one
    prismatic continuous  i8[N]
    parent  i8[N]  the joint that a joint hangs on, -1 is the base; parents come first
    branches  i8[N]  a joint but the next one hangs on it
    ancestors  i8[N]  one bit for each joint on the way from the base, itself included
    lead  i8[N]  the joint that it follows by q = ``ratio`` q_lead + ``offset``; itself where it mimics none
    rotation  f8[N,9]  of a joint's frame in its parent's at q = 0
    translation  f8[N,3]  the same
    tip_rotation  f8[9]
    tip_translation gravity  f8[3]
    mass  f8[N]
    com  f8[N,3]
    inertia  f8[N,6]  about the com: xx xy xz yy yz zz
    armature  f8[N]  rotor inertia seen at the joint
    viscous  f8[N]  a part of h
    coulomb  f8[N]  data for rollouts; no formula of a planner's tick feeds it forward
    ratio offset  f8[N]
    span lever  f8[N]  |translation|, |com|
    stoutness  f8[N]  the largest principal moment of ``inertia``
scratch  Memory of the parts of a tick; nothing in it but ``wide`` outlives the part that fills it.
    joints impulse  f8[N+1]
    rows  f8[6]
    wide  f8[6,N]  diag(sigma) V' of the turned rows
    square  f8[max(N,6),max(N,6)]
turned  Task rows along the singular directions: U and sigma of the reduced Jacobian.
    on  i8  the rows are turned
    threshold  f8  damping begins where a singular value falls below it
    factor  f8  of damping at the singularity; 0: none
    U  f8[6,6]
    sigma  f8[6]
    softness  f8[6]  compliance of the rows, times H
aside  The task's QP while another one is solved with its rows: sizes, objective and box.
    nx meq dense  i8
    g H_diagonal lb ub  f8[N]
settling  What brings the arm to rest, see ``ftqp.kernel.settling``; what is not explained is memory.
    on  i8  the planner wants it
    entered  i8  the last tick was posed in settling
    holding  i8  the arm no longer tries, at the error ``held``
    gradient_suppressed  i8  how often it has been seen to swing
    count  i8  how many joints are free
    seen_working  i8  joints that worked when ``sigma_seen`` was looked at
    known_working  i8  so many are ``known``
    stood  f8  how long the target has stood
    sure  f8  how long it has been clear that little can be gained
    held  f8
    way long_way  f8  of its joints within the present ``window``
    window  f8  [s], which began at ``q_window`` and ``q_long_window``
    rho  f8  share of the error e'e that can be removed
    beta  f8  share of the error that feedback asks for
    psi  f8  how much of the metric there is
    soft  f8  weight of the scheme's objective
    reach lipschitz  f8  bounds of the curvature and of the change of the rows
    sigma_seen  f8  the smallest singular value when it was last looked at, at ``q_seen``
    free  i8[N]  working joints, those first that can follow the gradient
    known  i8[N]  the joints that worked at the last tick
    q_seen q_window q_long_window  f8[N]
    gradient  f8[N]  A'e
    kick  f8[N]  what is added to it at a saddle
    kept kept_m kept_count found  i8  what the metric was found from, and how many joints are free then
    kept_s  f8
    kept_q  f8[N]
    kept_free  i8[N]
    kept_e  f8[6]
    kept_A  f8[6,N]
    delta  f8[N]  way to go of the free joints
    direction  f8[N]
    anchor  f8[12]  pose where the target stands
    weighted  f8[6]
    e b rate  f8[6]  error, right sides and column of a path's rate as the priority weighs them
    squares  f8[6]
    A  f8[6,N]  rows as the priority weighs them
    S D  f8[N,N]  curvature, and the metric
    work modes gains  f8[N,N]
    U  f8[6,8]
    G  f8[6,6]
    values beside  f8[max(N,6)]
free  What is reported of a free-swinging joint; the memory behind it is that called ``free``.
    mode joint  i8
    rows  i8  what is kept now
    allowed  i8  which sets of rows may be kept, one bit for each of ``Kept``
    impact_side  i8  -1 or 1 for the stop that will be met, 0 for none
    window  i8  ticks of the present comparison of joints that are measured
    impact_time impact_speed impact_energy  f8
    swing reach  f8  half the way of the joint, and how far the tip goes, both in the next 0.8 s
    drift  f8  speed of a joint that gravity does not move, once the others rest
    drift_time  f8  until its stop
    contact  i8[N]  1 at the lower stop, -1 at the upper one
    trust  i8[N]  for so many ticks more a joint counts as swinging only while each sample is as foretold
    tau_stop  f8[N]  torque of the stop
    begun_at halfway  f8[N]  where joints were at the begin and in the middle of the comparison
    swung swung_v  f8[N]  where and how fast they would be had they swung since
    v_before  f8[N]  a tick ago
    coasting swinging  f8[N,3]  sums of y, t y and y^2 of what each supposition leaves
"""
QP_TEXT: Final = """
qp  A QP with compliant equality rows, and the active-set solver's memory.
        min 1/2 x'Hx + g'x + sum_k s_k^2/(2 soft_k),  Ax + s = b,  lb <= x <= ub,  l <= Cx <= u.
    nx meq nc  i8
    rigid  i8  equalities among so many rows of C, the first ones, do not give way
    yields_from  i8  rows of C from this one on give way by ``soft_last``, too
    dense warm iterations max_iterations  i8
    soft_rows soft_last  f8  compliance of rows of C
    tolerance  f8
    lb ub g H_diagonal  f8[variables]
    A  f8[rows,variables]
    b  f8[rows]
    soft  f8[rows]  a row with soft_k = 0 is hard
    x  f8[variables]
    y  f8[rows]
    z_box  f8[variables]
    x_free  f8[variables]  the minimiser without rows
    root  f8[variables]  1/sqrt(H_ii), 0 for a fixed variable
    root_of root_was  f8[variables]  an H_ii and its root
    inverse  f8[variables]  the square of ``root``
    t lam lam_new warm_lam  f8[working]
    z l u  f8[constraints]
    code side  i8[working]
    active  i8[variables+constraints]
    warm_code warm_side  i8[working]
    scratch  f8[variables]
    V  f8[working,variables]  the rows of the working set times H^(-1/2)
    G  f8[working,working]  V V' + compliance
    L  f8[working,working]  its Cholesky factor with inverse diagonal
    C  f8[constraints,variables]
    H L_H  f8[variables,variables]
"""
_QP = sections(QP_TEXT, {})["qp"]
_TICK = sections(TEXT, vars(enums) | vars(rows) | {"max": max})


def qp_fields(variables: int, rows: int, constraints: int) -> Fields:
    """Fields of a QP of these sizes."""
    working = variables + rows + constraints
    return _QP(variables=variables, rows=rows, constraints=constraints, working=working)


def _qp(N: int) -> Fields:
    return qp_fields(N + 1, TASK_ROWS, constraint_capacity(N))


_EACH: Final[dict[str, Callable[[int], Fields]]] = {
    **_TICK,
    **FEEDBACK_ROOMS,
    **SCENE_ROOMS,
    "qp": _qp,
    "supposed": _TICK["state"],
}
ORDER: Final = (
    "state faults limits task criteria watch cascade feedback gate held monitor kinematics chain qp scratch "
    "turned past learned history aside settling free terms keeps scene ahead supposed"
)
ROOMS: Final = {name: _EACH[name] for name in ORDER.split()}
"""Each room with the fields that it has for N joints; those that every tick touches come first.

``supposed`` is a state where formulas are asked how the arm would be there, so that ``state``, which was
measured or leads the arm, need not be lent.
"""

OF_ROOMS = {
    "record": tuple(ROOMS),
    "arm": ("state", "kinematics", "chain"),
}
"""Records of rooms that begin lines of the cache: a planner's, and that of an arm without a planner."""
BESIDE = {"study": (*OF_ROOMS["arm"], "ahead", "scene"), "ways": ("chain", "ahead", "scene", "keeps")}
"""The rooms of a planner in records that have one of their own first."""
KINDS = (*OF_ROOMS, *OTHERS, *WAYS)
"""All records by name."""
LINE = 64
"""Bytes of a line of the cache, and of the widest register that is loaded at once."""


def check_joints(joints: int) -> None:
    """Refuse an arm of more joints than a record holds."""
    if joints > JOINTS:
        raise InputError(f"the arm has {joints} joints, expected at most {JOINTS}")


def _on_lines(fields: Sequence[Any]) -> np.dtype[Any]:
    """A type whose arrays and rooms each begin a line, so that no wide load of theirs needs two."""
    plain = np.dtype(list(fields), align=True)
    kinds, offsets, end = [plain[name] for name in plain.names or ()], [], 0
    for kind in kinds:
        unit = LINE if kind.itemsize >= LINE else kind.alignment
        offsets.append(-(-end // unit) * unit)
        end = offsets[-1] + kind.itemsize
    size = -(-end // LINE) * LINE
    layout: Any = {"names": plain.names, "formats": kinds, "offsets": offsets, "itemsize": size}
    return np.dtype(layout, align=True)


def zeros_in_line(kind: np.dtype[Any], count: int = 1) -> Any:
    """Zeros of a type, (count,), that begin a line of the cache; memory is taken by what is written to."""
    room = np.zeros(count * kind.itemsize + LINE, np.uint8)
    begin = -room.ctypes.data % LINE
    return room[begin : begin + count * kind.itemsize].view(kind)


def in_line(memory: Any) -> Any:
    """A copy of (1,) that begins a line of the cache."""
    copy = zeros_in_line(memory.dtype)
    copy.view(np.uint8)[:] = memory.view(np.uint8)  # as bytes, not field by field
    return copy


def _words_of(of: np.dtype[Any], fewer: np.dtype[Any], begin: int = 0) -> Iterator[Any]:
    """The words of a structure that a structure of the same fields with shorter arrays has, too."""
    for name in of.names or ():
        (kind, at, *_), small = of.fields[name], fewer.fields[name][0]  # type: ignore[index]
        if kind.names:
            yield from _words_of(kind, small, begin + at)
        else:
            places = np.arange(max(kind.itemsize // 8, 1)).reshape(kind.shape)
            yield (begin + at) // 8 + places[tuple(map(slice, small.shape))].ravel()


@cache
def used_words(joints: int) -> Any:
    """Begin and end of each run of words that a planner's record of so many joints uses, (k, 2)."""
    block = LINE // 8
    capacity = min(-(-joints // block) * block, JOINTS)
    words = np.sort(np.concatenate([*_words_of(dtype("record"), dtype("record", capacity))]))
    ends = np.flatnonzero(np.diff(words) > 1)
    begins = words[np.r_[0, ends + 1]]
    return np.ascontiguousarray(np.stack([begins, words[np.r_[ends, -1]] + 1], axis=1))


@cache
def dtype(kind: str, joints: int = JOINTS) -> np.dtype[Any]:
    """The type of a record by its name, with room for so many joints."""
    if kind in OF_ROOMS:
        return _on_lines([(name, _on_lines(ROOMS[name](joints))) for name in OF_ROOMS[kind]])
    fields = ({**OTHERS, **WAYS})[kind](joints)
    if kind in BESIDE:  # its own room first: numba takes a record that begins as another one for that
        rooms = {name: _on_lines(ROOMS[name](joints)) for name in BESIDE[kind]}
        fields = [(kind, structure(fields)), *rooms.items()]
    elif kind == "continuation":
        fields.append(("qp", structure(qp_fields(joints, TASK_ROWS, CLEARANCES))))
    elif kind == "standalone":
        fields = [*qp_fields(VARIABLES, EQUALITIES, CONSTRAINTS), *fields]
    return structure(fields)


def memory(kind: str) -> Any:
    """One record, (1,), of zeros; that of a reduced problem with unscaled unknowns."""
    made = zeros_in_line(dtype(kind))
    if kind == "reduced":
        made["column"] = 1.0
    return made


def record(joints: int = JOINTS) -> Any:
    """One planner's record, (1,), zero but for ``yielding``; no joint swings freely."""
    W = zeros_in_line(dtype("record", joints))
    W["task"]["yielding"] = 1.0
    W["free"]["joint"] = -1
    return W


def load_chain(
    K: Any, *, parent: Any, tip_joint: int, floating: int, continuous: Any, inertia: Any, **others: Any
) -> None:
    """Write the constants of an arm, or of a tree of arms, into a record K, by their names in ``Chain``."""
    chain, n, upper = K.chain, len(inertia), np.triu_indices(3)
    chain.n, chain.floating = n, floating
    _load_tree(chain, parent, tip_joint)
    chain.nq = n + int(np.count_nonzero(continuous))
    chain.has_inertia = bool(np.any(others["mass"]) or np.any(inertia))
    others |= {"continuous": continuous, "inertia": inertia[:, upper[0], upper[1]]}
    for name, value in others.items():
        field = chain[name]
        rows = np.reshape(value, (-1, *field.shape[1:]))
        field[: len(rows)] = rows
    chain.span[:n] = np.linalg.norm(others["translation"], axis=1)
    chain.lever[:n] = np.linalg.norm(others["com"], axis=1)
    chain.stoutness[:n] = np.abs(np.linalg.eigvalsh(inertia)).max(axis=1)
    chain.mimics = int(np.count_nonzero(chain.lead[:n] != np.arange(n)))


def _load_tree(chain: Any, parent: Any, tip_joint: int) -> None:
    n = chain.n
    chain.parent[:n] = parent
    chain.tip_joint = tip_joint
    chain.branches[:] = 0
    for i in range(n):
        above = int(chain.parent[i])
        chain.ancestors[i] = np.uint64(1 << i).astype(np.int64)
        if above >= 0:
            chain.ancestors[i] |= chain.ancestors[above]
            chain.branches[above] |= above != i - 1
    chain.is_tree = any(chain.parent[i] != i - 1 for i in range(n)) or tip_joint != n - 1
