"""The rooms of the record: the fields of each, for so many joints. SI units and ``f8`` unless named."""

from ftqp.kernel.layout.calm_room import calm_fields
from ftqp.kernel.layout.criteria import COEFFICIENTS
from ftqp.kernel.layout.enums import SETS, TARGET_SIZE, TASK_ROWS
from ftqp.kernel.layout.feedback_rooms import feedback_fields, history_fields, past_fields
from ftqp.kernel.layout.field_kinds import Fields, floats, integers, scalars
from ftqp.kernel.layout.gate_room import gate_fields
from ftqp.kernel.layout.held_room import held_fields
from ftqp.kernel.layout.keeps_room import keeps_fields
from ftqp.kernel.layout.learned_room import learned_fields
from ftqp.kernel.layout.rows import constraint_capacity
from ftqp.kernel.layout.scene_room import ahead_fields, scene_fields
from ftqp.kernel.layout.terms_room import terms_fields


def _state(N: int) -> Fields:
    """Measured state, as given and as the kernel uses it, and the command.

    ``unusable``: why samples cannot be used, an ``Unusable``; ``py_buffer``: memory for looking into a
    caller's object.
    """
    names = ("q", "v", "q_command", "v_command", "a_command", "tau", "tau_brake", "given_v")
    return [
        *scalars("i8", "is_reset level ticks unusable"),
        *scalars("f8", "dt"),
        *floats(dict.fromkeys(names, (N,))),
        *floats({"given_q": (2 * N,)}),
    ]


def _supposed(N: int) -> Fields:
    """A state that is only supposed, q and v: where formulas are asked how the arm would be there.

    So that ``state`` need not be lent: it holds what was measured, or the reference that leads the arm.
    """
    return _state(N)


def _faults(N: int) -> Fields:
    """What is believed of the joints.

    ``order`` lists the ``working`` ones, then the free-swinging ones, then those that are held.
    ``friction`` and ``coulomb`` are those of a free-swinging joint [N m s/rad] and [N m]; ``lock_rate`` and
    ``lock_velocity`` are the deceleration and, by that model, the velocity of a joint that is being locked.
    """
    return [
        *scalars("i8", "reset_mode working movable"),
        *integers({"code": (N,), "order": (N,)}),
        *floats(dict.fromkeys(("lock_rate", "lock_velocity", "friction", "coulomb"), (N,))),
    ]


def _limits(N: int) -> Fields:
    """Limits as believed now, and which of them set each end of an interval.

    ``a_brake`` is the deceleration that viability may count on. ``dynamic``: rows of C, or an objective
    with inertia. ``on_demand``: the rows of C are there only where a command would break a torque limit
    without them. ``guard``: share of a_max up to which torque limits are then not looked at; 0: none.
    """
    names = ("q_min", "q_max", "v_max", "a_max", "a_brake", "tau_max")
    return [
        *scalars("i8", "conversion dynamic on_demand empty_intervals"),
        *scalars("f8", "guard jin_p jin_v jin_margin jin_upsilon"),
        *floats(dict.fromkeys(names, (N,))),
        *integers({"lower_by": (N,), "upper_by": (N,)}),
    ]


def _task(N: int) -> Fields:
    """The task and its error.

    ``row_scale``: 1 for linear rows, the characteristic length for angular ones. ``axis``: rotation whose z
    is the tool axis, in the tip frame. ``error``: position and rotation vector from the tip to the target,
    along W. ``slack`` is A x - asked, ``asked`` what the task asks for (b differs in lexicographic mode),
    ``beyond`` what it asks beside b. ``yielding``: compliance of each component beside that of the task as a
    whole. ``seen``: the error of the measured tip, of which ``position_error`` and ``rotation_error`` are the
    norms.

    ``given_up``: sets of rows that the task has been reduced by, of ``sets``; ``m_of``, ``tool_of``: ``m``
    and ``tool_rows`` of the whole task and of each set; ``healthy_too``: not only beside a joint that
    swings freely; ``patience``: ticks after which each goes; ``late``: ticks of it; ``nearest``: the least
    error meanwhile, in tolerances; ``held``: ticks in which more could be held; ``wait``: how many of these
    bring rows back.

    ``lost``: the velocity that a joint took from the tip when it stopped otherwise than foreseen; ``owes``:
    it is being given back.
    """
    return [
        *scalars("i8", "m mode uses_rotation tool_rows has_tip_measured given_up owes"),
        *scalars("i8", "sets healthy_too patience late held wait"),
        *scalars("f8", "kp kv length slack_ratio position_error rotation_error scale beyond nearest"),
        *integers({"rows": (6,), "m_of": (SETS + 1,), "tool_of": (SETS + 1,)}),
        *floats(
            {
                "row_scale": (6,),
                "target": (TARGET_SIZE,),
                "error": (6,),
                "lost": (6,),
                "seen": (6,),
                "slack": (6,),
                "asked": (6,),
                "yielding": (6,),
                "axis": (9,),
                "tip_measured": (4, 4),
            }
        ),
    ]


def _criteria(N: int) -> Fields:
    """Coefficients, see ``ftqp.kernel.rows.objective``; ``sways``: ``sway`` counts."""
    return [
        *scalars("i8", "sways"),
        *scalars("f8", " ".join(COEFFICIENTS)),
        *floats({"weight": (N,), "posture": (N,), "sway": (N,)}),
    ]


def _kinematics(N: int) -> Fields:
    """The one snapshot of a tick; ``acc`` is of the frame origins, minus gravity.

    ``tau`` holds torques of a command, or bounds on them; ``effort`` and ``wrench`` are memory of both.
    ``J_each``: J before columns of joints that mimic others are added to those of their leaders.
    ``carried`` and ``gained``: what the branches of a tree hand to the joint they hang on, and take from it.
    """
    return [
        *scalars("i8", "has_dynamics"),
        *floats(
            {
                "sine": (N,),
                "cosine": (N,),
                "R": (N, 9),
                "o": (N, 3),
                "axis_w": (N, 3),
                "R_tip": (9,),
                "o_tip": (3,),
                "J": (6, N),
                "J_each": (6, N),
                "drift": (6,),
                "w": (N, 3),
                "alpha": (N, 3),
                "acc": (N, 3),
                "h": (N,),
                "tau": (N,),
                "effort": (N, 2),
                "wrench": (N, 6),
                "M": (N, N),
                "carried": (N, 16),
                "gained": (N, 6),
            }
        ),
    ]


def _chain(N: int) -> Fields:
    """Constants of the arm; every joint moves along or about the z axis of its frame.

    ``parent``: the joint that a joint hangs on, -1 is the base; parents come first. ``ancestors``: one bit
    for each joint on the way from the base, itself included. ``branches``: whether a joint but the next one
    hangs on it; ``is_tree``: whether any does. The tip moves with ``tip_joint``. ``floating``: so many
    joints, the first ones, have no motor, as a body floats. ``mimics``: so many joints follow another one,
    their ``lead``, by q = ``ratio`` q_lead + ``offset``; all others lead themselves.
    ``rotation`` and ``translation`` place a joint's frame in its parent's at q = 0. ``inertia`` is about
    the com: xx xy xz yy yz zz. ``armature`` is the rotor inertia seen at the joint. ``viscous`` is a part of
    h; ``coulomb`` is data for rollouts, no formula of a planner's tick feeds it forward. ``span``, ``lever``
    and ``stoutness`` are sizes: |translation|, |com| and the largest principal moment of ``inertia``.
    """
    return [
        *scalars("i8", "n nq has_inertia is_tree tip_joint floating mimics"),
        *integers(
            dict.fromkeys(("prismatic", "continuous", "parent", "branches", "ancestors", "lead"), (N,))
        ),
        *floats(
            {
                "rotation": (N, 9),
                "translation": (N, 3),
                "tip_rotation": (9,),
                "tip_translation": (3,),
                "gravity": (3,),
                "mass": (N,),
                "com": (N, 3),
                "inertia": (N, 6),
                "armature": (N,),
                "viscous": (N,),
                "coulomb": (N,),
                "ratio": (N,),
                "offset": (N,),
                "span": (N,),
                "lever": (N,),
                "stoutness": (N,),
            }
        ),
    ]


def _watch(N: int) -> Fields:
    """What may stop the arm: thresholds, and what has been seen of them.

    ``stopped``: the stop has come to rest; ``rise``: time in which a stop brings the deceleration up [s].
    ``left``: of the task's error, what limits that move the arm have left of it [thresholds].
    """
    return [
        *scalars("i8", "stop_samples rising latched stopped reason fallbacks fallback_limit"),
        *scalars("f8", "stop_position stop_rotation last_position_error last_rotation_error left rise"),
    ]


def _cascade(N: int) -> Fields:
    """Where a tick stands in the fallback cascade, and what its answer is worth.

    ``external``: another solver takes the QP. ``accept``: largest scaled residual that counts as solved.
    ``z_first``, ``z_box_first``: multipliers of the first stage of lexicographic mode, which say what keeps
    the task from being followed. ``missed``: the command leaves more of the task than counts as none;
    ``outside``: how many joints are beyond what is believed of their limits, and whether bodies are too near;
    ``checked``: the answer is known to be good; ``jump``: share of an instant lock's jump that the other
    joints' velocities have made;
    ``torque_excess``: of the command over what is believed of a motor [N m].
    """
    return [
        *scalars("i8", "status outcome stage external claim qp_iterations p missed outside checked"),
        *scalars("f8", "accept residual_task residual_bounds residual_dual torque_excess kappa jump"),
        *floats(
            {
                "z_first": (constraint_capacity(N),),
                "z_box_first": (N,),
            }
        ),
    ]


def qp_fields(variables: int, rows: int, constraints: int) -> Fields:
    """Fields of a QP with compliant equality rows and of the active-set solver's memory.

    min 1/2 x'Hx + g'x + sum_k s_k^2/(2 soft_k),  Ax + s = b,  lb <= x <= ub,  l <= Cx <= u; a row with
    soft_k = 0 is hard. Rows of C give way as ``soft_rows`` says, equalities among the first ``rigid`` not;
    those from ``yields_from`` on by ``soft_last``, too.

    ``x_free`` is the minimiser without rows. ``root`` is 1/sqrt(H_ii), 0 for a fixed variable; ``root_of``
    and ``root_was`` keep an H_ii and its root, ``inverse`` the square of the root. V holds the rows of the
    working set times H^(-1/2), G = V V' + compliance, L its Cholesky factor with inverse diagonal.
    """
    working = variables + rows + constraints
    return [
        *scalars("i8", "nx meq nc rigid yields_from dense warm iterations max_iterations"),
        *scalars("f8", "soft_rows soft_last tolerance"),
        *floats(
            {
                "lb": (variables,),
                "ub": (variables,),
                "g": (variables,),
                "H_diagonal": (variables,),
                "A": (rows, variables),
                "b": (rows,),
                "soft": (rows,),
                "x": (variables,),
                "y": (rows,),
                "z_box": (variables,),
                "x_free": (variables,),
                "root": (variables,),
                "root_of": (variables,),
                "root_was": (variables,),
                "inverse": (variables,),
                "t": (working,),
                "lam": (working,),
                "lam_new": (working,),
                "warm_lam": (working,),
                "z": (constraints,),
                "l": (constraints,),
                "u": (constraints,),
            }
        ),
        *integers(
            {
                "code": (working,),
                "side": (working,),
                "active": (variables + constraints,),
                "warm_code": (working,),
                "warm_side": (working,),
            }
        ),
        *floats(
            {
                "scratch": (variables,),
                "V": (working, variables),
                "G": (working, working),
                "L": (working, working),
                "C": (constraints, variables),
                "H": (variables, variables),
                "L_H": (variables, variables),
            }
        ),
    ]


def _qp(N: int) -> Fields:
    return qp_fields(N + 1, TASK_ROWS, constraint_capacity(N))


def _aside(N: int) -> Fields:
    """The task's QP while another one is solved with its rows: sizes, objective and box."""
    return [
        *scalars("i8", "nx meq dense"),
        *floats(dict.fromkeys(("g", "H_diagonal", "lb", "ub"), (N,))),
    ]


def _turned(N: int) -> Fields:
    """Task rows along the singular directions: U and sigma of the reduced Jacobian.

    ``on``: the rows are turned; ``softness``: their compliance, times H. Damping begins where a singular
    value falls below ``threshold`` and is ``factor`` at the singularity; factor 0: none.
    """
    return [
        *scalars("i8", "on"),
        *scalars("f8", "threshold factor"),
        *floats({"U": (6, 6), "sigma": (6,), "softness": (6,)}),
    ]


def _free(N: int) -> Fields:
    """What is told of a free-swinging joint; the memory behind it is ``ftqp.kernel.layout.free_memory``.

    ``allowed``: which sets of rows may be kept, one bit for each of ``Kept``; ``rows``: what is kept now.
    ``impact_side``: -1 or 1 for the stop that will be met, 0 for none; ``swing``: half the way of the joint,
    ``reach``: how far the tip goes, both in the next 0.8 s. ``drift``: speed of a joint that gravity does not
    move, once the others rest, ``drift_time``: until its stop. ``contact``: 1 at the lower stop, -1 at the
    upper one; ``tau_stop``: torque of the stop.

    ``trust``: for so many ticks more a joint counts as swinging only while each sample is as foretold.
    ``window``: ticks of the present comparison of joints that are measured; ``begun_at`` is where they began
    it, ``halfway`` where they were in its middle, ``swung`` and ``swung_v`` where and how fast they would be
    had they swung since, ``v_before`` the velocities a tick ago; ``coasting`` and ``swinging`` are the sums
    of y, t y and y^2 of what each leaves.
    """
    return [
        *scalars("i8", "mode joint rows allowed impact_side window"),
        *scalars("f8", "impact_time impact_speed impact_energy swing reach drift drift_time"),
        *integers({"contact": (N,), "trust": (N,)}),
        *floats({"tau_stop": (N,), "begun_at": (N,), "halfway": (N,), "swung": (N,), "swung_v": (N,)}),
        *floats({"v_before": (N,), "coasting": (N, 3), "swinging": (N, 3)}),
    ]


def _scratch(N: int) -> Fields:
    """Memory of the parts of a tick; nothing in it but ``wide`` outlives the part that fills it."""
    return [
        *floats(
            {
                "joints": (N + 1,),
                "impulse": (N + 1,),
                "rows": (6,),
                "wide": (6, N),  # diag(sigma) V' of the turned rows
                "square": (max(N, 6), max(N, 6)),
            }
        )
    ]


ROOMS = {
    "state": _state,
    "faults": _faults,
    "limits": _limits,
    "task": _task,
    "criteria": _criteria,
    "watch": _watch,
    "cascade": _cascade,
    "feedback": feedback_fields,
    "gate": gate_fields,
    "held": held_fields,
    "kinematics": _kinematics,
    "chain": _chain,
    "qp": _qp,
    "scratch": _scratch,
    "turned": _turned,
    "past": past_fields,
    "learned": learned_fields,
    "history": history_fields,
    "aside": _aside,
    "calm": calm_fields,
    "free": _free,
    "terms": terms_fields,
    "keeps": keeps_fields,
    "scene": scene_fields,
    "ahead": ahead_fields,
    "supposed": _supposed,
}
"""Each room with the fields that it has for N joints; those that every tick touches come first."""
