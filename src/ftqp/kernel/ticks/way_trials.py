"""Ways out of where an arm is stuck: their places, and each tried in thought, tick by tick, in Python and C.

K is a copy of a planner's record with nobody behind it, A its arm by itself, W, J and S what leads it, see
``ftqp.kernel.search.on_the_way``, and O the way. Nothing takes longer than about so many looks at postures;
a tick in thought counts as one. Source: docs/theory/ways-out.md.
"""

from math import inf
from typing import Any

from ftqp.kernel.arm.dynamics import torques_of
from ftqp.kernel.arm.kinematics import forward_kinematics, mimic_places, motion
from ftqp.kernel.commands.believed import swings
from ftqp.kernel.commands.going import GOES, effort_at, look_up, plan_going
from ftqp.kernel.commands.stops import start, write_together
from ftqp.kernel.feedback.late_loop import expected_sample
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import (
    BRAKING,
    FALLBACK,
    GOING_MOVING,
    GOING_REACHED,
    HEALTHY,
    INVALID_INPUT,
    LOCKED,
    NEWS,
    STOPPED,
    STOPPING,
    VELOCITY,
)
from ftqp.kernel.layout.thresholds import NEARER, SINGULAR_FROM, STRONG
from ftqp.kernel.layout.ways_room import (
    AS_ASKED,
    BACK_WAY,
    GROWING,
    HALT_WAY,
    HOME_WAY,
    NO_WAY,
    OUT_PLACES,
    POSES,
    SHORTENING,
    STOP_WAY,
    STRAIGHT,
    TIPS_WAY,
)
from ftqp.kernel.maths.elementary import is_finite
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.maths.symmetric_eigen import extreme_eigenvalues, gram
from ftqp.kernel.maths.vectors import ZERO, length, plus, rotated_back, three, three_from
from ftqp.kernel.search.asking import ask_as_given, begin_asked, know_asked
from ftqp.kernel.search.looks import obstruction, pose_arm
from ftqp.kernel.search.motion import search_step
from ftqp.kernel.search.on_the_way import aim_going, begin_as_given
from ftqp.kernel.search.poses import squared, tip_error
from ftqp.kernel.search.trees import add_goal, chance, follow_path, node_of
from ftqp.kernel.ticks.steps import deployed_go

LOOKING, FOUND, TRYING, TRIED = 0, 1, 2, 3
"""How far a way is: its places are looked for, are there, are gone in thought, and were."""
OFF_RECORD = 0.03
"""The way back leaves the one that the arm has come by at most this in any joint [rad or m]: a centimetre or
two at the tip."""
APART, MANY = 0.01, 200
"""Places of the way that has been come are so far apart [rad or m], by convention, or farther, so that there
are not many more than these."""
LEAP = 0.3
"""Where the joints follow the tip's way, none goes farther from one place to the next [rad or m]. A guess."""
ROUND = 60_000
"""So many looks are spent on a way home round what is in between at most, 0.15 s or so. A guess."""
TIP_BACK, TURNED_BACK = 0.01, 0.05
"""The tip is back within this of where its way began [m, rad]: the defaults of a task's tolerances, so that
it counts as being there, exactly then."""
EVERY = 8e-3
"""What motors and the base bear on a motion is looked at so often [s]. A convention."""
LATE = 10.0
"""A motion that takes longer than it is planned for by so much does not arrive [s]. A convention."""
NEAR = 0.6
"""A joint goes no farther than this to where the arm can stand for long [rad or m] ..."""
SAMPLES, DRAWN, SHRINK = 32, 128, 0.5
"""... and it is the best of so many samples round the best one so far, of so many in all; the next ones are
drawn from so much less."""
BASE_SHARE = 0.25
"""What the base bears on the way there, as a share of what it bears where the arm brakes on the spot, is a
quarter of a torque limit's whole share. A convention."""
LEAST_FORCE, LEAST_MOMENT = 10.0, 1.0
"""The force and torque [N, N m] below which that share is not distinguished: a kilogram's. A convention."""
ON_THE_WAY = 25
"""What the base bears on the way there is looked at in so many places."""
ROOM_SHARE = 0.1
"""A joint with less than this share of its range to its nearer limit counts as near it: half of what a torque
limit's whole share counts, at the limit. A convention."""

STOOD = 1e-3
"""A place nearer than this to the last one in every joint is not kept [rad or m]: the arm stands. A
convention."""


@jit
def _add_place(K: Any, O: Any, q: Any) -> None:
    """Add a place to a way; joints that have failed stay where they come to rest."""
    limits, place = K.limits, O.place[O.places]
    for i in range(K.chain.n):
        place[i] = O.stand[i]
        if K.faults.code[i] == HEALTHY:
            place[i] = min(max(q[i], limits.q_min[i]), limits.q_max[i])
    O.places += 1


@jit
def _apart(a: Any, b: Any, n: int) -> float:
    """How far two places are apart in the joint in which they are farthest [rad or m]."""
    far = 0.0
    for i in range(n):
        far = max(far, abs(a[i] - b[i]))
    return far


@rare_jit
def _walk_back(K: Any, S: Any, came: Any, count: int) -> int:
    """The way that has been come into ``walk``, from the arm back: number of the last place."""
    walk, n, rows, way = S.ways.walk, K.chain.n, len(came), 0.0
    first = max(0, count - rows)
    for k in range(first + 1, count):
        way += _apart(came[k % rows], came[(k - 1) % rows], n)
    apart, last = max(APART, way / MANY), 0
    assign(walk[0], K.state.q_command, n)
    for k in range(count - 1, first - 1, -1):
        far = _apart(came[k % rows], walk[last], n)
        if last + 1 < POSES and (far >= apart or (k == first and far > 0.0)):
            last += 1
            assign(walk[last], came[k % rows], n)
    return last if count - first > 1 else 0


@rare_jit
def _take_corners(K: Any, S: Any, O: Any, last: int, off: float) -> None:
    """Places of ``walk`` between which straight ways are nowhere farther from it than so much in any joint.

    Source: Ramer 1972.
    """
    walk, n, a = S.ways.walk, K.chain.n, 0
    O.places = 0
    for k in range(last + 1):
        O.mark[k] = 1 if k == last else 0
    while a < last:
        b = a + 1
        while not O.mark[b]:
            b += 1
        size, most, far = 1e-300, off, -1
        for i in range(n):
            size += (walk[b, i] - walk[a, i]) * (walk[b, i] - walk[a, i])
        for k in range(a + 1, b):
            share, away = 0.0, 0.0
            for i in range(n):
                share += (walk[k, i] - walk[a, i]) * (walk[b, i] - walk[a, i]) / size
            share = min(max(share, 0.0), 1.0)
            for i in range(n):
                away = max(away, abs(walk[a, i] + share * (walk[b, i] - walk[a, i]) - walk[k, i]))
            if away > most:
                most, far = away, k
        if far >= 0:
            O.mark[far] = 1
        else:
            a = b
            if O.places < OUT_PLACES:
                _add_place(K, O, walk[b])


@rare_jit
def _follow_tip(K: Any, given: Any, S: Any, last: int) -> None:
    """Let the path be the tip's way back along ``walk``, in equal parts of what the joints go."""
    way, n, total, i = S.ways, K.chain.n, 0.0, 0
    walk, at = way.walk, way.time
    at[0] = 0.0
    for k in range(last):
        total += _apart(walk[k], walk[k + 1], n)
        at[k + 1] = total
    way.path, way.tolerance[0], way.tolerance[1] = MANY + 1, TIP_BACK, TURNED_BACK * given.length
    for k in range(MANY + 1):
        s, T, R, o = total * k / MANY, way.path_pose[k], S.ahead.R_tip, S.ahead.o_tip
        while i + 1 < last and at[i + 1] < s:
            i += 1
        share = min((s - at[i]) / (at[i + 1] - at[i]), 1.0)
        for j in range(n):
            way.q[j] = walk[i, j] + share * (walk[i + 1, j] - walk[i, j])
            way.leap[j] = LEAP
        pose_arm(S, way.q)
        for r in range(3):
            for c in range(3):
                T[4 * r + c] = R[3 * r + c]
            T[4 * r + 3] = o[r]


@jit
def begin_way_out(
    K: Any, given: Any, W: Any, J: Any, S: Any, copies: Any, O: Any, came: Any, count: int, home: Any,
    kind: int, fewer: int,
) -> bool:  # fmt: skip
    """Begin with a way out of a kind from the last command; whether there is one, as far as is known.

    ``came``, (rows, n), has the way that has been come, ``count`` places in all, of which the last ones are
    there. ``home`` is where the arm belongs; of the tip so many sets of the task's rows are given up.
    """
    state, way, n, works, all_work = K.state, S.ways, K.chain.n, False, True
    assign(W.a, state.a_command, n)
    start(K, given, state.q_command, state.v_command)
    assign(state.a_command, W.a, n)
    assign(K.feedback.seen, state.q_command, n)
    assign(K.feedback.v_hat, state.v_command, n)
    K.monitor.names = 0  # nobody responds here
    begin_as_given(K, given, W, J)
    W.speed, O.kind, O.stage, O.places, O.drawn, O.ticks = K.feedback.speed, kind, LOOKING, 0, 0, 0
    O.best = O.around = 0
    O.clear = O.arrives = O.near = O.weak = O.still = O.rows = 0
    O.clearance, O.effort, O.force, O.moment = inf, 0.0, 0.0, 0.0
    write_together(copies)
    ask_as_given(S, K, given, way.given_goal)
    way.asks_pose = way.asks_nears = way.asks_straight = 0
    for i in range(n):
        W.moves[i] = K.faults.code[i] == HEALTHY
        O.failed[i] = 0 if W.moves[i] else 1
        works, all_work = works or W.moves[i] != 0, all_work and W.moves[i] != 0
        brakes = K.faults.code[i] == BRAKING
        v = state.v_command[i] if W.moves[i] or brakes else 0.0
        rate = K.faults.lock_rate[i] if brakes else K.limits.a_brake[i]
        ahead = 0.5 * state.dt if state.level == VELOCITY else 0.0  # a tick goes as fast as it ends
        O.stand[i] = state.q_command[i] + v * (abs(v) / (2.0 * max(rate, 1e-9)) - ahead)
        O.seen[i] = state.q_command[i] if W.moves[i] else O.stand[i]
    _add_place(K, O, O.stand)
    assign(O.stand, O.place[0], n)
    if kind == STOP_WAY:
        O.stage = FOUND
        return True
    if not works or swings(K.faults, K.chain):
        return False
    O.places = 0
    if kind == HOME_WAY:
        _add_place(K, O, home)
        if K.keeps.count > 0 or K.scene.pairs > 0:
            way.asks_most = ROUND
            begin_asked(S, K, O.stand, 0)
            add_goal(S, O.place[0])
        else:
            O.stage = FOUND
    elif kind == HALT_WAY:
        begin_asked(S, K, O.stand, 0)
    else:
        last = _walk_back(K, S, came, count)
        if last < 1 or (kind == TIPS_WAY and all_work):
            return False
        if kind == BACK_WAY:
            _take_corners(K, S, O, last, OFF_RECORD)
            O.stage = FOUND
        else:
            O.rows, O.has_axis = 0, K.task.tool_of[fewer]
            for k in range(K.task.m_of[fewer]):
                O.rows |= 1 << K.task.rows[k]
            way.asks_rows, way.asks_axis = O.rows, O.has_axis
            _follow_tip(K, given, S, last)
            begin_asked(S, K, O.seen, 0)
            assign(way.follows, O.seen, n)
    return True


@jit
def _borne(A: Any, q: Any, v: Any, a: Any) -> tuple[float, float]:
    """The force and the torque that the base bears on a motion, about its origin [N, N m].

    They hold the arm's weight and make its bodies accelerate; rotors, which spin beside, are left out.
    """
    chain, kinematics, f, m, force, moment = A.chain, A.kinematics, ZERO, ZERO, ZERO, ZERO
    if not chain.has_inertia:
        return 0.0, 0.0
    assign(A.state.q, q, chain.n)
    assign(A.state.v, v, chain.n)
    forward_kinematics(A, A.state)
    motion(A, A.state)
    torques_of(A.state, kinematics, chain, a)
    for i in range(chain.n - 1, -1, -1):
        f, m = plus(f, three(kinematics.wrench[i])), plus(m, three_from(kinematics.wrench[i], 3))
        if chain.parent[i] < 0:
            force, moment = plus(force, f), plus(moment, m)
        if chain.parent[i] < 0 or chain.parent[i] != i - 1:  # whose wrench has it already
            f = m = ZERO
    return length(force), length(moment)


@rare_jit
def _halt_cost(K: Any, A: Any, W: Any, S: Any, q: Any, is_stand: bool) -> float:
    """effort + 0.5 max(0, 1 - room/0.1) + 0.125 (force/force_0 + torque/torque_0); infinite where it is met.

    That is the largest share of a torque limit that holds the arm in a posture, the least share of a range to
    a limit, and the largest force and torque that the base bears on the way, beside those of braking.
    Source: docs/theory/ways-out.md; Chen 2020.
    """
    n, y, room, force, moment = K.chain.n, S.ways.y, 1.0, LEAST_FORCE, LEAST_MOMENT
    for i in range(n):
        low, high = K.limits.q_min[i], K.limits.q_max[i]
        if W.moves[i] and is_finite(high - low):
            room = min(room, min(q[i] - low, high - q[i]) / (high - low))
    if obstruction(S, q) != 0 and not is_stand:
        return inf
    assign(W.goal, q, n)
    W.looks, W.heavy = 0, -1
    plan_going(K, A, W, GOES)
    for part in range(ON_THE_WAY):
        look_up(W, n, W.duration * part / (ON_THE_WAY - 1))
        f, m = _borne(A, W.q_now, W.v_now, W.a_now)
        force, moment = max(force, f), max(moment, m)
    if is_stand:
        y[0], y[1] = force, moment
    share = 0.5 * BASE_SHARE * (force / y[0] + moment / y[1])
    return effort_at(K, A, W) + 0.5 * max(0.0, 1.0 - room / ROOM_SHARE) + share


@rare_jit
def _draw_halt(K: Any, A: Any, W: Any, S: Any, O: Any) -> None:
    """The next posture near by, (n,), and its cost in ``x``: the same arm gets the same posture."""
    n, way, k = K.chain.n, S.ways, O.drawn
    q, width = node_of(S, 1, k), NEAR
    if k % SAMPLES == 1:
        O.around = O.best
    centre = node_of(S, 1, O.around)
    for _ in range((k - 1) // SAMPLES):
        width *= SHRINK
    assign(q, O.stand, n)
    for i in range(n if k > 0 else 0):
        drawn = centre[i] + width * (2.0 * chance(way) - 1.0)
        if way.free[i]:
            low, high = max(K.limits.q_min[i], q[i] - NEAR), min(K.limits.q_max[i], q[i] + NEAR)
            q[i] = min(max(drawn, low), high)
    if K.chain.mimics:
        mimic_places(K.chain, q)
    cost = _halt_cost(K, A, W, S, q, k == 0)
    if k == 0 or cost < O.least:
        O.best, O.least = k, cost
    O.drawn += 1
    way.looks += ON_THE_WAY
    if k == DRAWN:
        _add_place(K, O, node_of(S, 1, O.best))
        O.stage = FOUND


@rare_jit
def _look_for_places(K: Any, A: Any, W: Any, S: Any, O: Any, looks: int) -> None:
    """Look on for the places of a way."""
    way, n = S.ways, K.chain.n
    if O.kind == HALT_WAY:
        _draw_halt(K, A, W, S, O)
    elif O.kind == HOME_WAY:
        if way.stage == GROWING or way.stage == SHORTENING:
            search_step(S, looks)
            return
        if way.stage != NO_WAY and way.places <= OUT_PLACES + 1:
            O.places = way.places - 1
            for k in range(O.places):
                assign(O.place[k], way.place[k + 1], n)
        O.stage = FOUND
    elif not follow_path(S, 1):
        O.drawn += 1
        assign(way.walk[O.drawn], way.follows, n)
    elif way.followed < MANY - 1:  # places that cannot be come to are passed by
        way.followed += 1
        assign(way.follows, way.walk[O.drawn], n)
    elif way.followed == MANY:
        _take_corners(K, S, O, O.drawn, OFF_RECORD / 3.0)
        O.stage = FOUND
    else:
        O.stage = TRIED


@jit
def begin_way(K: Any, given: Any, W: Any, J: Any, S: Any, O: Any) -> None:
    """Go a way out from the next tick on; who had failed when it was tried may be anywhere."""
    n, way = K.chain.n, S.ways
    begin_as_given(K, given, W, J)
    ask_as_given(S, K, given, way.given_goal)
    way.asks_pose = way.asks_nears = way.asks_straight = 0
    way.asks_places = O.places
    for k in range(O.places):
        assign(way.given_place[k], O.place[k], n)
    assign(W.goal, O.place[O.places - 1], n)
    for i in range(n):
        W.counts[i] = 1 if K.faults.code[i] == HEALTHY or not O.failed[i] else 0
    aim_going(K, W, AS_ASKED if O.places > 1 else STRAIGHT)


@rare_jit
def _weigh(K: Any, A: Any, W: Any, O: Any) -> None:
    """What motors and the base bear at the last command."""
    state = K.state
    assign(W.q_now, state.q_command, K.chain.n)
    O.effort = effort_at(K, A, W)
    O.most = max(STRONG, O.effort) if O.ticks == 1 else O.most
    O.weak = 1 if O.weak or O.effort > O.most else 0
    force, moment = _borne(A, state.q_command, state.v_command, state.a_command)
    O.force, O.moment = max(O.force, force), max(O.moment, moment)


@jit
def _see(K: Any, O: Any) -> None:
    """What is seen before a tick in thought: a joint that has failed brakes and stays as is believed."""
    state, seen = K.state, K.feedback.seen
    expected_sample(K, O.seen)
    for i in range(K.chain.n):
        if K.faults.code[i] == BRAKING or K.faults.code[i] == LOCKED:  # it begins where it was commanded
            O.seen[i] = state.q_command[i] + (seen[i] - state.q[i] if O.ticks > 0 else 0.0)


@jit
def _watch(K: Any, A: Any, W: Any, O: Any) -> None:
    """Look at a tick in thought."""
    scene, keeps, clear, room = K.scene, K.keeps, inf, inf
    if scene.pairs > 0:
        clear, room = scene.distance, scene.distance - (scene.keep - NEARER)
    for t in range(keeps.count):
        clear, room = min(clear, keeps.distance[t]), min(room, keeps.distance[t])
    O.ticks += 1
    O.clearance = min(O.clearance, clear)
    O.room = min(0.0, room - 1e-9) if O.ticks == 1 else O.room
    O.near = 1 if O.near or room <= O.room else 0
    if O.ticks % max(1, int(EVERY / K.state.dt)) == 1 or 2.0 * K.state.dt > EVERY:
        _weigh(K, A, W, O)


@rare_jit
def _still(K: Any, S: Any, scale: float) -> int:
    """How many rows the tip can move in, in all directions: those of a pose, with a tool's axis, a place."""
    way, J, columns = S.ways, K.kinematics.J, 0
    for j in range(K.chain.n):
        if K.faults.code[j] == HEALTHY:
            turn = rotated_back(K.kinematics.R_tip, (J[3, j], J[4, j], J[5, j]))
            for r in range(3):
                way.A[r, columns], way.A[3 + r, columns] = J[r, j], scale * turn[r]
            columns += 1
    for rows in (6, 5, 3):
        if columns >= rows:
            least, _ = extreme_eigenvalues(way.M, gram(way.A, rows, columns, way.M), way.y, way.e)
            if least > (SINGULAR_FROM * scale) * (SINGULAR_FROM * scale):
                return rows
    return 0


@rare_jit
def _end(K: Any, given: Any, A: Any, W: Any, S: Any, copies: Any, O: Any, arrives: bool) -> None:
    """The motion has ended in thought: what is to be said of it."""
    limits, q = K.limits, K.state.q_command
    _weigh(K, A, W, O)
    O.limit, O.stage, O.time = inf, TRIED, O.ticks * K.state.dt
    for i in range(K.chain.n):
        if W.moves[i]:
            O.limit = min(O.limit, min(q[i] - limits.q_min[i], limits.q_max[i] - q[i]))
    O.still = _still(K, S, given.length)
    O.arrives = 1 if arrives else 0
    O.clear = 1 if arrives and not O.near and not O.weak else 0
    if O.kind == TIPS_WAY:  # it counts where the tip is back
        way = S.ways
        write_together(copies)
        way.asks_rows, way.asks_axis = O.rows, O.has_axis
        know_asked(S, K)
        pose_arm(S, q)
        tip_error(S, way.path_pose[MANY])
        off, turned, most = squared(way, O.rows, 0), squared(way, O.rows, 3), TURNED_BACK * given.length
        O.places = 0 if off > TIP_BACK * TIP_BACK or turned > most * most else O.places


@jit
def try_way_out(
    K: Any, given: Any, A: Any, W: Any, J: Any, S: Any, copies: Any, O: Any, looks: int
) -> bool:  # fmt: skip
    """Think on for about so many looks: whether the way was tried; it has no places where there is none."""
    while looks > 0 and O.stage != TRIED:
        before = S.ways.looks
        if O.stage == LOOKING:
            _look_for_places(K, A, W, S, O, looks)
        elif O.stage == FOUND:
            begin_way(K, given, W, J, S, O)
            O.stage = TRYING
        else:
            _see(K, O)
            code = deployed_go(K, A, W, J, S, copies, O.seen, K.state.v_command)
            code = code % NEWS if code >= 0 else INVALID_INPUT
            off = code in (FALLBACK, STOPPING, STOPPED, INVALID_INPUT)
            _watch(K, A, W, O)
            planned = (S.ways.ticks - 1) * S.ways.period if W.plays else W.duration
            if off or W.state != GOING_MOVING or O.ticks * K.state.dt > planned + LATE:
                _end(K, given, A, W, S, copies, O, not off and W.state == GOING_REACHED)
        looks -= 1 + max(S.ways.looks - before, 0)
    return bool(O.stage == TRIED)


@jit
def remember(K: Any, came: Any, facts: Any, code: int) -> None:
    """After a tick: keep where the joints are commanded to be, now and then, where they have gone.

    ``facts`` are after how many ticks, ticks, and places that were kept; the last ones, (rows, n), are there.
    """
    n, rows, count = K.chain.n, len(came), facts[2]
    is_due = code >= 0 and facts[1] % facts[0] == 0
    if is_due and (count == 0 or _apart(K.state.q_command, came[(count - 1) % rows], n) > STOOD):
        assign(came[count % rows], K.state.q_command, n)
        facts[2] += 1
    facts[1] += 1
