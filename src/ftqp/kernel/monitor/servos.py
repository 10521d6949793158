"""What is estimated of each servo, with nothing stated: one linear model a joint, written for the command.

    u = y + c v + m a + f sgn(v) + b + s g(q) + i (M(q) a),    all signals behind three poles at w

u is what was sent, y the sample that came after it, v and a its derivatives, g and M those of the robot's
model, as torques in units of a fifth of the limit. c is the lag [s], with delays and with half a period of
the loop taken off, m the rotor over the stiffness [s2], f dry friction and b a droop over it [rad or m], s
and i the droop under the arm's weight and under what its inertia takes. A Kalman filter a joint learns them;
its states drift with the way that the joint goes, so that an arm at rest forgets nothing, and a residual
beyond three standard deviations teaches as much as one of three: a fault is not learned as usual. No state is
kept above zero, as what the others learn beside one that is would be wrong: samples that come half a period
early are a lag below zero.

Of an arm that takes velocities u is their integral, drawn to the sample: u' = v_sent - (u - y)/T.
So both sides of the row forget what is older, all but b, which then is the creep of a servo without an
integral part.
Source: docs/theory/monitor.md, "The model of a joint".
"""

from typing import Any

from ftqp.kernel.arm.dynamics import torques_of
from ftqp.kernel.arm.kinematics import motion, tip_of
from ftqp.kernel.jit import exact_jit, jit, rare_jit
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    IS_LOCKED,
    NOTHING_HEARD,
    POSITION_DRIVE,
    TORQUE_DRIVE,
    VELOCITY_DRIVE,
)
from ftqp.kernel.layout.feedback_rooms import SERVO
from ftqp.kernel.layout.thresholds import (
    COARSEST,
    GEAR,
    SERVO_DRIFT,
    SERVO_PRIOR,
    SPEED_SERVO_PRIOR,
    UNLIMITED,
)
from ftqp.kernel.maths.elementary import larger, mul_add, select, smaller, sqrt
from ftqp.kernel.maths.side_by_side import WIDTH, is_set, load_lanes, store_lanes
from ftqp.kernel.monitor.torques import (
    A_RADIAN,
    OTHERWISE,
    TORQUE_CREEP,
    model_torques,
    noise_of_torque,
    take_torques,
)

CREEP = 0.002
"""The droop changes by so much per root of a second, beside its drift with the way."""
FRICTION, DROOP = 2, 3
"""The parameters f and b."""
IDEAL = (1e-4, 1e-6, 1e-6, 1e-5, 1e-5, 1e-5)
"""What is left open of a joint whose samples were its commands to the last bit while it moved."""
SLOW, STILL = 0.02, 3.0
"""Slower than this [rad/s or m/s] where speeds are taken, or where positions are than gears play and so many
standard deviations of the speed that is seen, a joint may be held by dry friction to either side."""
MORE = 0.3
"""At rest friction holds by this share of f more or less than it brakes in motion: Stribeck, loads."""
EITHER = 4.0 / 3.0
"""What friction holds is between -f and f: so many f^2 are the variance of twice that, if all are alike."""
UNSURE, SUREST, WORST = 0.02, 5e-4, 0.1
"""Of the motion of a healthy joint the model misses so much [s] before anything was learned, and between
these."""
REMEMBERS, FAR, QUICK = 5.0, 3.0, 6.0
"""The largest residual is kept for so far a way [rad or m]. Where twice what is missed is so many times as
much, what a lock is judged by falls so many times as fast."""
SETTLES, LAGS_TO_SETTLE = 0.1, 4.0
"""A joint that was let go is not judged, nor is its motor believed off where the arm was switched on, for
so long [s] and so many times what it may lag: it goes where its load draws it."""
STRAINED = 0.9
"""A motor of which the arm's weight takes so much may be at its limit, as friction and the model's errors are
the rest: what its servo is asked for beyond that shows nothing."""
BEGINS = 8.0
"""An arm may have been sent anywhere before: the filters forget that in so many time constants, to 1 %."""
CRAWLS, OF_NOISE, OF_MOTION = 0.1, 0.25, 0.05
"""Slower than this share of its limit a joint's samples scatter by noise alone, and by its motion, too,
where it is faster; a look counts for so much of either."""
RIPPLES, MOST_RIPPLE = 7.0, 1.0
"""A joint whose place scatters by e of its way from one command to the next goes at v (1 + 7 e) between them:
3 to 10 of arms that were drawn, with servos up to 3 times as fast as their loop. It is slowed down to half
its speed at most, as noise of which few looks told may be taken for its motion."""
COMPARED = 0.25
"""How far samples are from what was sent is a mean over one over this independent looks."""
TAUGHT = 3.0
"""A residual teaches as if it were so many standard deviations at most."""


@jit
def block_time(K: Any) -> float:
    """From one look at a joint to the next [s]."""
    return float(K.monitor.every) * K.state.dt


@rare_jit
def forget_servos(K: Any) -> None:
    """Nothing is known of the servos but what was stated of them."""
    M = K.monitor
    M.sees = M.news = M.ideal = M.holds = 0
    M.worst = 0.0
    for i in range(K.chain.n):
        if M.found[i] != IS_LOCKED:  # a joint that is held is looked at further; sensors are believed again
            M.found[i] = 0
        M.missed[i] = M.sharp[i] = UNSURE
        M.tail[i] = M.way[i] = 0.0
        M.droop[i] = M.unsure[i] = M.response[i] = 0.0
        M.scatter[i] = M.uneven[i] = M.ripple[i] = 0.0
        M.blind[i] = 0
        for r in range(SERVO):
            M.theta[i, r] = M.used[i, r] = M.stated[i, r]
            for c in range(SERVO):
                M.P[i, r, c] = 0.0
            M.P[i, r, r] = M.doubt[i, r] * M.doubt[i, r]
            for k in range(2):
                M.safe[k, i, r] = M.theta[i, r]
                for c in range(SERVO):
                    M.safe_P[k, i, r, c] = M.P[i, r, c]


@rare_jit
def as_before(M: Any, i: int) -> None:
    """The servo of joint i is again what it was a while before anything spoke against it, and so kept."""
    for r in range(SERVO):
        M.theta[i, r] = M.safe[0, i, r] = M.safe[1, i, r]
        for c in range(SERVO):
            M.P[i, r, c] = M.safe_P[0, i, r, c] = M.safe_P[1, i, r, c]


@jit
def strains(asked: Any, a: Any, weight: Any, inertia: Any, top: Any) -> Any:
    """Whether what a motor carries of the acceleration a, as far as that was asked for, may be its most."""
    share = smaller(1.0, asked / larger(abs(a), 1e-9))
    return abs(weight + share * inertia) > STRAINED * top


@jit
def is_strained(K: Any, i: int) -> bool:
    """Whether the servo of joint i may be at its torque limit, so that its row does not hold.

    By its weight, and by the acceleration that was asked for: how a brake stops it is no servo's doing.
    """
    M, top = K.monitor, K.limits.tau_max[i] * K.monitor.unit[i]
    strained = strains(M.peak_a[i], M.a[i], M.weight[i], M.inertia[i], top)
    return bool(strained and K.feedback.kind != TORQUE_DRIVE)


@jit
def ticks_to_settle(K: Any, i: int) -> int:
    """For how many ticks joint i is not judged once its servo begins."""
    if K.feedback.kind == TORQUE_DRIVE:
        return int(SETTLES / K.state.dt)
    lag = max(K.monitor.theta[i, 0], 0.0) + sqrt(K.monitor.P[i, 0, 0])
    return int((SETTLES + LAGS_TO_SETTLE * lag) / K.state.dt)


@rare_jit
def begin_filters(K: Any) -> None:
    """The first sample of an arm that does not follow to the last bit: it has stood until now.

    What it was sent before nobody knows, so that a droop shows as if it had only begun: until the filters
    have forgotten that, nothing is learned. An ideal arm was sent where it stood.
    """
    M = K.monitor
    begins = 0 if M.ideal else int(BEGINS / (M.w * K.state.dt)) + 1
    M.sees = 1
    M.count = M.settles = 0
    for i in range(K.chain.n):
        y = K.feedback.good[i]
        u = y if M.leak > 0.0 else K.gate.sent[i]
        if K.feedback.kind == TORQUE_DRIVE:
            u = 0.0
        M.speed[i] = K.gate.speed[i]
        M.y[i] = M.anchor[i] = M.place[i] = y
        M.u[i] = M.asked[i] = u
        M.total[i] = y * ((M.every - i % M.every) % M.every)  # samples that its first mean lacks
        M.act[i] = M.weight[i] = M.inertia[i] = M.own[i] = M.r[i] = M.S[i] = 0.0
        M.rests[i], M.blind[i] = 0, begins
        if not M.ideal:
            M.settles = max(M.settles, ticks_to_settle(K, i))
        M.room[i] = UNLIMITED  # until it is looked at
        for k in range(3):
            M.u_f[k, i], M.y_f[k, i] = u, y
        for k in range(4):
            M.means[k, i] = y
        M.v[i] = M.a[i] = M.peak_v[i] = M.peak_a[i] = 0.0
        M.sense[i] = M.hold[i] = 0.0
        M.follows[0, i] = M.follows[1, i] = M.differs[0, i] = M.differs[1, i] = 0.0
        M.G[i] = M.G_lock[i] = M.G_free[i] = M.z_old[i] = M.z_sharp_old[i] = 0.0
        if M.ideal:
            for r in range(SERVO):
                M.theta[i, r] = M.used[i, r] = 0.0
                M.P[i, r, r] = IDEAL[r] * IDEAL[r]
            M.missed[i] = M.sharp[i] = SUREST


@jit
def _integral(K: Any, at: int, y: Any, heard: bool) -> Any:
    """What was sent to the joints from ``at`` on, summed up as the planner does it.

    That of one that works goes to the sample.
    """
    M, before = K.monitor, load_lanes(K.monitor.speed, at)
    speed = load_lanes(K.gate.speed if heard else M.speed, at)
    store_lanes(M.speed, at, speed)
    mean = 0.5 * (speed + before) if K.state.level == ACCELERATION else speed
    u = mul_add(K.state.dt, mean, load_lanes(M.u, at))
    return select(is_set(M.found, at) | is_set(K.faults.code, at), u, mul_add(M.leak, y - u, u))


@jit
def take_samples(K: Any, then: int) -> None:
    """Three poles for what was sent and what was measured; a sample that did not come went on as was sent."""
    M, feedback, p = K.monitor, K.feedback, K.monitor.pole
    if feedback.kind == TORQUE_DRIVE:
        take_torques(K, then)
        return
    heard = K.state.unusable != NOTHING_HEARD
    for at in range(0, K.chain.n, WIDTH):
        missed, good, last = is_set(feedback.age, at), load_lanes(feedback.good, at), load_lanes(M.y, at)
        if feedback.kind == VELOCITY_DRIVE:
            y = select(missed, mul_add(K.state.dt, load_lanes(M.speed, at), last), good)
            u = _integral(K, at, y, heard)
        else:
            u = load_lanes(K.gate.sent if heard else M.u, at)
            y = select(missed, u + last - load_lanes(M.u, at), good)
        store_lanes(M.y, at, y)
        store_lanes(M.u, at, u)
        store_lanes(M.total, at, load_lanes(M.total, at) + y)
        for k in range(3):
            u = mul_add(p, load_lanes(M.u_f[k], at) - u, u)
            y = mul_add(p, load_lanes(M.y_f[k], at) - y, y)
            store_lanes(M.u_f[k], at, u)
            store_lanes(M.y_f[k], at, y)


@rare_jit
def motion_terms(K: Any) -> None:
    """g(q), and M(q) a of the accelerations that are seen, in units of a fifth of the torque limits.

    And the inertia that one joint after the other moves alone.
    """
    M, supposed = K.monitor, K.supposed
    if K.feedback.kind == TORQUE_DRIVE:
        model_torques(K)
        return
    for i in range(K.chain.n):
        supposed.q[i], supposed.v[i], M.inertia[i] = M.y_f[2, i], 0.0, 0.0
    tip_of(K, supposed)
    motion(K, supposed)
    torques_of(supposed, K.kinematics, K.chain, M.inertia)  # at rest, of trees, too
    for i in range(K.chain.n):
        M.weight[i] = K.kinematics.tau[i] * M.unit[i]
    torques_of(supposed, K.kinematics, K.chain, M.a)
    for i in range(K.chain.n):
        M.inertia[i] = K.kinematics.tau[i] * M.unit[i] - M.weight[i]
        M.alone[i] = 0.0
    k = K.state.ticks // M.every % K.chain.n
    M.alone[k] = 1.0
    torques_of(supposed, K.kinematics, K.chain, M.alone)
    M.own[k] = K.kinematics.tau[k] * M.unit[k] - M.weight[k]


@exact_jit
def _add_products(total: float, x: float, row: Any, phi: Any) -> float:
    """total + x row' phi over the parameters, added in their order."""
    total = mul_add(x * row[0], phi[0], total)
    total = mul_add(x * row[1], phi[1], total)
    total = mul_add(x * row[2], phi[2], total)
    total = mul_add(x * row[3], phi[3], total)
    total = mul_add(x * row[4], phi[4], total)
    return mul_add(x * row[5], phi[5], total)


@exact_jit
def _add_row(row: Any, x: float, other: Any) -> None:
    """row <- row + x other, over the parameters."""
    row[0] = mul_add(x, other[0], row[0])
    row[1] = mul_add(x, other[1], row[1])
    row[2] = mul_add(x, other[2], row[2])
    row[3] = mul_add(x, other[3], row[3])
    row[4] = mul_add(x, other[4], row[4])
    row[5] = mul_add(x, other[5], row[5])


@jit
def variance(P: Any, phi: Any) -> float:
    """phi' P phi."""
    total = 0.0
    for r in range(SERVO):
        if phi[r] != 0.0:
            total = _add_products(total, phi[r], P[r], phi)
    return max(total, 0.0)


@jit
def noise_of(K: Any, i: int) -> float:
    """Variance of the samples of joint i; what an encoder's steps leave out shows only while it moves."""
    sigma, step = K.held.sigma[i], min(K.feedback.increment[i], COARSEST)
    return float(max(sigma * sigma, step * step / 12.0))


@jit
def _between(K: Any, i: int, k: int, seen: float, led: float) -> float:
    """A derivative of joint i from what its samples say and what it was sent, each by its variance.

    Noise in what the parameters multiply would draw them to zero, and all the surer the more there is.
    """
    M, d = K.monitor, seen - led
    M.differs[k, i] += COMPARED * M.kappa * (d * d - M.differs[k, i])
    noise = M.blurs[k] * noise_of(K, i)
    return float(led if noise >= M.differs[k, i] else seen - noise / M.differs[k, i] * d)


@jit
def _see_ripples(K: Any, i: int) -> None:
    """How much faster joint i goes between two commands than in the mean, by how unevenly its samples go.

    A servo that is faster than its loop goes there at once and waits. No sample shows the speed in between,
    but commands that come late make its ways unequal. Third differences of samples have 20 times the variance
    of what these scatter by, s^2 at rest and s^2 + (e v T)^2 in motion.
    """
    M = K.monitor
    d = M.means[0, i] - M.means[3, i] - 3.0 * (M.means[1, i] - M.means[2, i])
    way = min(abs(M.means[0, i] - M.means[3, i]) / 3.0, M.peak_v[i] * block_time(K))
    way, crawl = way * way, CRAWLS * min(K.limits.v_max[i], UNLIMITED) * block_time(K)
    most = 9.0 * (M.scatter[i] + M.uneven[i] * way) + 0.01 * way + GEAR * GEAR
    scatter = min(0.05 * d * d, most)
    if way < crawl * crawl:
        M.scatter[i] += OF_NOISE * (scatter - M.scatter[i])
    else:
        share = OF_MOTION * way / (way + crawl * crawl)
        more = (scatter - M.scatter[i]) / way - M.uneven[i]
        M.uneven[i] = max(M.uneven[i] + share * more, 0.0)
    M.ripple[i] = min(RIPPLES * sqrt(M.uneven[i]), MOST_RIPPLE)


@jit
def observe_joint(K: Any, i: int) -> None:
    """How fast joint i is, and how much of its motion was asked for."""
    M, D, decay = K.monitor, K.monitor.D, K.monitor.decay
    M.v[i] = D * (M.y_f[1, i] - M.y_f[2, i])
    M.a[i] = D * D * (M.y_f[0, i] - 2.0 * M.y_f[1, i] + M.y_f[2, i])
    v = D * (M.u_f[1, i] - M.u_f[2, i])
    a = D * D * (M.u_f[0, i] - 2.0 * M.u_f[1, i] + M.u_f[2, i])
    if K.feedback.kind == TORQUE_DRIVE:
        v, a = K.state.v_command[i], K.state.a_command[i]
    if M.leak > 0.0:  # of what was sent, without what went to the sample
        rate = M.leak / K.state.dt
        v += rate * (M.u_f[2, i] - M.y_f[2, i])
        a += rate * D * (M.u_f[1, i] - M.u_f[2, i] - M.y_f[1, i] + M.y_f[2, i])
    if K.feedback.kind == POSITION_DRIVE:
        half = max(0.5 * M.theta[i, 0], block_time(K))  # a servo without overshoot has two such poles
        share = block_time(K) / (block_time(K) + half)
        M.follows[0, i] += share * (v - M.follows[0, i])
        M.follows[1, i] += share * (M.follows[0, i] - M.follows[1, i])
        M.v[i] = _between(K, i, 0, M.v[i], M.follows[1, i])
        M.a[i] = _between(K, i, 1, M.a[i], (M.follows[0, i] - M.follows[1, i]) / half)
    M.peak_v[i] = max(abs(v), decay * M.peak_v[i])
    M.peak_a[i] = max(abs(a), decay * M.peak_a[i])
    M.act[i] = min(abs(M.v[i]), M.peak_v[i]) + 0.05 * min(abs(M.a[i]), M.peak_a[i])
    for k in range(3, 0, -1):
        M.means[k, i] = M.means[k - 1, i]
    M.means[0, i] = M.total[i] / M.every
    M.total[i] = 0.0
    if K.feedback.kind == POSITION_DRIVE and M.every == 1:
        _see_ripples(K, i)


@jit
def creep_of(K: Any, i: int) -> float:
    """Slower than this joint i may stand: it goes no farther than gears do while the filters look at it."""
    if K.monitor.fades > 0.0:
        return SLOW
    w = K.monitor.w
    return float(GEAR * w / 3.0 + STILL * sqrt(0.1875 * w * w * w * K.state.dt * noise_of(K, i)))


@jit
def direction(v: float, slow: float) -> float:
    """sgn(v), smooth where dry friction may hold a joint to either side."""
    return v / sqrt(v * v + slow * slow)


@jit
def _creeps(M: Any) -> bool:
    """Whether a joint is so slow that dry friction may hold it to either side."""
    share = M.phi[FRICTION]
    return bool(abs(share) < direction(STILL, 1.0) if M.fades == 0.0 else share == 0.0)


@jit
def _sense(K: Any, i: int, v: float, slow: float) -> float:
    """To which side friction acts on joint i: -1 or 1 where it moves, and 0 where it may stand."""
    M = K.monitor
    asked = min(max(v, -M.peak_v[i]), M.peak_v[i])
    if K.feedback.kind == TORQUE_DRIVE:
        return direction(asked, slow / STILL)
    sooner = M.D * (M.y_f[0, i] - M.y_f[1, i])  # behind two poles: what has stopped shows sooner
    asked = min(max(sooner, 0.0), asked) if asked > 0.0 else max(min(sooner, 0.0), asked)
    share = min(max(abs(asked) / slow - 1.0, 0.0), 1.0)
    return float(share if asked > 0.0 else -share)


@jit
def _friction_at_rest(M: Any, i: int, r: float) -> float:
    """What is left over of r once friction has taken its part; ``phi`` is then of the end that r is beyond.

    Coulomb's law: what moves is braked by f, and what stands is held by whatever it takes, up to f to either
    side. So between these ends nothing is left over, and beyond one of them it is that end that was wrong.
    """
    free, f = 1.0 - abs(M.sense[i]), max(M.theta[i, FRICTION], 0.0)
    held = min(max(r, -free * f), free * f)
    M.hold[i] = M.sense[i] * f + held
    M.phi[FRICTION] = M.sense[i] + (free if r > 0.0 else -free)
    return float(r - held)


@jit
def _forget_older(slow: Any, phi: Any, share: float) -> None:
    """Takes from what the parameters multiply, all but the droop, what is older."""
    for k in range(SERVO):
        if k != DROOP:
            slow[k] += share * (phi[k] - slow[k])
            phi[k] -= slow[k]


@jit
def _friction_squared(M: Any, i: int) -> float:
    """The mean of the square of joint i's friction, of which one below zero holds nothing.

    But of a joint that stands it is then as wrong as it is far from zero.
    """
    f, var = M.theta[i, FRICTION], M.P[i, FRICTION, FRICTION]
    return float(f * f + var if f > 0.0 else max(f * f * M.rests[i], var))


@jit
def _stuck(M: Any, i: int) -> float:
    """By how many f^2 what holds joint i may differ from what it was lately, as far as that counts.

    Friction that held it one way may hold it the other way, which are 2 f. A joint that was not asked to move
    so tells nothing but of its droop.
    """
    slow, phi = abs(M.v[i]), M.phi
    if slow > M.peak_v[i]:
        for k in range(2, SERVO):
            phi[k] *= 1.0 if k == DROOP else M.peak_v[i] / slow
        slow = M.peak_v[i]
    M.slow[i, DROOP] *= 1.0 - M.fades
    if slow < SLOW:
        M.slow[i, DROOP], phi[FRICTION] = 1.0, 0.0
    share: float = M.slow[i, DROOP]
    return EITHER * share * share


@jit
def _motion_beside(K: Any, i: int) -> float:
    """The motion of which the model of joint i may miss a share: its own, and some of the others'."""
    M, n, others = K.monitor, K.chain.n, 0.0
    for j in range(n):
        others += M.act[j]
    moved: float = M.act[i] + 0.3 * (others - M.act[i]) / n + 0.01
    return moved


@jit
def may_stick(K: Any, i: int) -> bool:
    """Whether joint i behind a position servo has not gone yet: more friction than is known may hold it."""
    gone = abs(K.monitor.y_f[2, i] - K.monitor.place[i])
    return bool(K.feedback.kind == POSITION_DRIVE and gone < GEAR + STILL * sqrt(noise_of(K, i)))


@rare_jit
def _come_loose(M: Any, i: int) -> float:
    """Joint i, which stood, goes where it was asked to: what was taken for droop was friction, and no lock.

    How much more is left over of its row then.
    """
    phi, theta, change = M.phi, M.theta[i], 0.0
    for k in range(SERVO):
        change += phi[k] * theta[k]
    as_before(M, i)
    for k in range(SERVO):
        change -= phi[k] * theta[k]
    held = M.u_f[2, i] - M.asked[i]
    M.P[i, FRICTION, FRICTION] = max(M.P[i, FRICTION, FRICTION], held * held)
    M.G[i] = M.G_lock[i] = M.G_free[i] = 0.0
    return change


@jit
def _pull_of_others(K: Any, i: int) -> float:
    """What the others' motion does to joint i, if all of m is inertia of the links, and no rotor's.

    Of m as it was a while ago: what a fault teaches is no reason to wait.
    """
    M = K.monitor
    if M.own[i] <= 0.0:
        return 0.0
    m = max(min(M.theta[i, 1], M.safe[1, i, 1]), 0.0)
    return float(m * (M.inertia[i] / M.own[i] - M.a[i]))


@exact_jit
def _sharper(S: float, miss: float, sharp: float, pull: float) -> float:
    """S with ``sharp`` in the place of what the model misses, and the pull of the others."""
    return S + (mul_add(sharp, sharp, -(miss * miss)) + pull * pull)


@jit
def residual(K: Any, i: int) -> None:
    """r of joint i, and S, its variance: what is left open, noise, and what the model misses.

    S = phi' P phi + 4 sigma^2 w dt + (missed act)^2, and what friction may hold by more at rest. What speaks
    against the joint is r next to sqrt(S + the pull of the others).
    """
    M = K.monitor
    phi, theta, v, a, slow = M.phi, M.theta[i], M.v[i], M.a[i], creep_of(K, i)
    phi[0], phi[1], phi[2], phi[3], phi[4], phi[5] = v, a, direction(v, slow), 1.0, M.weight[i], M.inertia[i]
    by_torque = K.feedback.kind == TORQUE_DRIVE
    if M.fades > 0.0:
        _forget_older(M.slow[i], phi, 1.0 if M.S[i] == 0.0 else M.fades)
        v, a = phi[0], phi[1]
    else:
        M.sense[i] = phi[FRICTION] = _sense(K, i, v, slow)
        if by_torque and theta[FRICTION] < 0.0 and _creeps(M):  # one below zero holds nothing
            phi[FRICTION] = 0.0
    r = M.u_f[2, i] - (M.weight[i] if by_torque else M.y_f[2, i])
    for k in range(SERVO):
        r -= phi[k] * theta[k]
    if M.fades == 0.0:
        begins = M.rests[i] and abs(M.sense[i]) == 1.0 and phi[FRICTION] * r > 0.0
        if begins and M.G[i] > 0.0 and may_stick(K, i):
            r += _come_loose(M, i)
        if not by_torque:
            r = _friction_at_rest(M, i, r)
    moved = _motion_beside(K, i)
    miss, sharp = M.missed[i] * moved, M.sharp[i] * moved
    if by_torque:
        miss, sharp = A_RADIAN * miss, A_RADIAN * sharp
        spread = noise_of_torque(K, i) + OTHERWISE * OTHERWISE + miss * miss
    else:
        spread = 4.0 * noise_of(K, i) * M.w * K.state.dt + 0.25 * GEAR * GEAR + miss * miss
    if M.fades > 0.0:
        spread += _stuck(M, i) * _friction_squared(M, i)
    elif by_torque:  # the slower it is the less is known to which side it is held
        spread += (1.0 - phi[FRICTION] * phi[FRICTION]) * _friction_squared(M, i)
    else:
        more = MORE * (1.0 - abs(M.sense[i])) * max(theta[FRICTION], 0.0)
        spread += more * more
    if M.settles == 0:  # what was asked for, not how a joint falls
        phi[0] = min(max(v, -M.peak_v[i]), M.peak_v[i])
        phi[1] = min(max(a, -M.peak_a[i]), M.peak_a[i])
    M.r[i], M.spread[i] = r, spread
    M.S[i] = spread + variance(M.P[i], phi)
    pull = 0.0 if by_torque else _pull_of_others(K, i)
    M.z[i] = r / sqrt(M.S[i] + pull * pull)
    M.S_sharp[i] = _sharper(M.S[i], miss, sharp, pull)
    M.z_sharp[i] = r / sqrt(M.S_sharp[i])


@jit
def _missed(rho: float, rate: float, beyond: float, quick: float) -> float:
    """rho after a look: it rises by exp(0.95 rate) where that was beyond, and falls elsewhere."""
    change = rate * (beyond - 0.05 * quick)
    return float(min(max(rho * (1.0 + change + 0.5 * change * change), SUREST), WORST))


@jit
def _believe_missed(K: Any, i: int) -> None:
    """What the model misses of joint i: 5 % of the looks at a healthy joint are beyond two deviations.

    Sharply, not behind velocity drives: six times as fast less, where nothing near it was seen lately.
    """
    M, moved = K.monitor, _motion_beside(K, i)
    rate, r = 0.02 + 0.1 / (1.0 + M.way[i]), abs(M.r[i])
    if K.feedback.kind == TORQUE_DRIVE:
        moved *= A_RADIAN
    if K.feedback.kind == VELOCITY_DRIVE:
        M.missed[i] = M.sharp[i] = _missed(
            M.missed[i], rate, 1.0 if r > 2.0 * sqrt(M.spread[i]) else 0.0, 1.0
        )
        return
    miss, sharp = M.missed[i] * moved, M.sharp[i] * moved
    noise = max(M.spread[i] - miss * miss, 0.0)
    M.tail[i] *= 1.0 - min(abs(M.v[i]) * block_time(K) / REMEMBERS, 1.0)
    M.tail[i] = max(M.tail[i], (r - 2.0 * sqrt(noise)) / moved)
    quick = QUICK if 2.0 * M.sharp[i] > FAR * M.tail[i] else 1.0
    beyond = 1.0 if r > 2.0 * sqrt(noise + sharp * sharp) else 0.0
    M.missed[i] = _missed(M.missed[i], rate, 1.0 if r > 2.0 * sqrt(M.spread[i]) else 0.0, 1.0)
    M.sharp[i] = min(_missed(M.sharp[i], rate, beyond, quick), M.missed[i])
    if K.feedback.kind == TORQUE_DRIVE:  # nothing else is stated by it
        M.missed[i] = M.sharp[i]


@jit
def _held_by_friction(M: Any, i: int) -> float:
    """What friction may make of the row of joint i where it explains all of it, as a variance; else 0.

    Such a look tells of the droop alone. ``phi`` is of the joint as it stands then.
    """
    free, f = 1.0 - abs(M.sense[i]), max(M.theta[i, FRICTION], 0.0)
    r = M.r[i] + M.hold[i] - M.sense[i] * f
    if abs(r) > free * (f + sqrt(M.P[i, FRICTION, FRICTION])):
        return 0.0
    M.phi[FRICTION] = M.sense[i]
    return float((1.0 - M.sense[i] * M.sense[i]) * _friction_squared(M, i))


@jit
def learn_servo(K: Any, i: int) -> None:
    """One look of the filter of joint i, whose row is in ``phi``.

    However long a joint stands, what holds it is one thing: its droop is not known better by it than what
    friction may hold.
    """
    M, block = K.monitor, block_time(K)
    phi, theta, P, gain, v = M.phi, M.theta[i], M.P[i], M.gain, abs(M.v[i])
    r_i, S, held = M.r[i], M.S[i], 0.0
    if K.feedback.kind == POSITION_DRIVE:
        held = _held_by_friction(M, i)
        if held > 0.0:
            r_i += M.hold[i] - M.sense[i] * max(theta[FRICTION], 0.0)
            S = M.spread[i] + held + variance(P, phi)
    share = min(1.0, TAUGHT / max(abs(M.z_sharp[i]), 1e-9)) / S
    if 0.0 < P[DROOP, DROOP] <= held:
        share = 0.0
    for r in range(SERVO):
        gain[r] = _add_products(0.0, 1.0, P[r], phi)
    friction, doubt = theta[FRICTION], P[FRICTION, FRICTION]
    # what holds a joint is no measure of its friction, but that it is no less
    stuck = _creeps(M)
    if K.feedback.kind == POSITION_DRIVE:
        stuck = held > 0.0 or (abs(M.sense[i]) < 1.0 and gain[FRICTION] * r_i < 0.0)
    for r in range(SERVO):
        theta[r] += share * gain[r] * r_i
        _add_row(P[r], -share * gain[r], gain)
    if stuck:
        theta[FRICTION], P[FRICTION, FRICTION] = friction, doubt
    elif may_stick(K, i) and abs(M.sense[i]) < 1.0:  # and of one that has not gone yet it may be more still
        P[FRICTION, FRICTION] = max(P[FRICTION, FRICTION], doubt)
    if K.feedback.kind == TORQUE_DRIVE:  # no rotor is lighter than none: what falls is no light joint
        theta[1] = max(theta[1], (K.learned.used[i] - K.chain.armature[i]) * M.unit[i])
    if M.G[i] == 0.0 or M.rests[i] == 0:  # else the droop of a joint that is held would take the fault
        for r in range(SERVO):
            drift, creep = SERVO_DRIFT[r], CREEP
            most = SERVO_PRIOR[r] if M.leak == 0.0 else SPEED_SERVO_PRIOR[r]
            if K.feedback.kind == TORQUE_DRIVE:  # by the same share of what is open at first
                drift, most, creep = drift * M.doubt[i, r] / most, M.doubt[i, r], TORQUE_CREEP
            drift = drift * drift * v * block
            drift += creep * creep * block if r == DROOP else 0.0
            P[r, r] = max(P[r, r], min(P[r, r] + drift, most * most))  # never less: as sure as stated
    if (_motion_beside(K, i) if K.feedback.kind == TORQUE_DRIVE else M.act[i]) > 0.05:
        _believe_missed(K, i)
    M.way[i] += v * block / 0.05
