"""The records beside that of a planner: of what it is given, of its leaders, and of studies and solvers."""

from typing import Final

from ftqp.kernel.layout import enums, scene_room
from ftqp.kernel.layout.structures import sections

FAILED_JOINTS = 2
"""The most joints that fail."""
FACTS = 7
"""Numbers that a continuation leaves: how it ended, then what ``continuation`` has of the last motion."""
GOAL_SIZE = 12
"""Numbers of a goal: the pose's upper three rows, by rows."""
SEGMENTS = 3
"""Segments of the plan of an arm beside a joint that swings freely."""
STARTS = 5
"""Postures from which a rest posture is looked for."""
WORKS_STILL, IS_LOCKED_NOW, SWINGS_NOW = 0, 1, 2
"""What becomes of a joint that is reported: it works, within limits that may be lower, or not."""
LEFT_ALONE, DOUBTED = 3, 4
"""What else may become of one of which something was found."""

WIDTH: Final = 8
"""Configurations of a law side by side: as many as a block of joints has in ``side_by_side``."""
SHARE: Final = 0.5
"""c of the variable s with dq/ds = v / (c + |v|)."""
LONG_WAY: Final = 60.0
"""A run that went further without rest has none [rad]."""
VARIABLES, ROWS, CONSTRAINTS = 128, 64, 512
"""The most of each of a QP that the active set solves alone."""
ARRAYS: Final = (
    "q", "v", "targets", "faults", "events", "starts",
    "position_error", "rotation_error", "clearance", "counts", "first_bad", "trace",
)  # fmt: skip
"""Of ``ftqp.kernel.entry.rollouts.Batch``."""
TEXT: Final = f"""
path  A path that is followed by its progress.
    interval  i8  of the path's table
    driven  i8  the null space is drawn to ``drive``
    found  i8  ``drive`` is a way past a singularity, looked for where ``speed`` is not 0
    progress  f8  path time reached
    rate  f8  its derivative in [0, 1], negative while not known
    stop  f8  path time of the next jump of the twist
    end  f8
    limit  f8  largest rate allowed now
    aside  f8  how far beside the path the tip may go on, 0: it stays on it
    ahead  f8  largest rate from which the arm can stop before the next jump
    left  f8  largest rate beside an error that the feedback no longer corrects
    speed  f8
    feedback  f8[6]  kp e of each row, where the path is blocked all but the velocity feedback
    bend  f8[6]  x'' - Jdot q' of each row
    kept  f8[6]  the error while a way past a singularity is looked for
    target  f8[TARGET_SIZE]  the path's at the progress
    drive  f8[N]  velocity that the null space is drawn to
base  A base that moves in the inertial frame I, see ``ftqp.kernel.rows.inertial_target``.
    code attitude has delay ticks seen rates ever stale freezes hold leaning anti_windup  i8
    gain  f8
    observer  f8  low-pass factor of the disturbance observer, 0: none
    age patience  f8  how long the base has not been seen, and may not be
    rank tolerance  f8
    tip_world given  f8[4,4]  measured poses of tip and base in I
    rate  f8[6]  given twist of the base at its origin, along I
    rate_last  f8[6]
    nominal  f8[9]
    now last  f8[4,4]  pose of the base when it was measured, and before
    pose  f8[4,4]  the same brought to now
    shift  f8[6]  displacement of the tip by the base in one sample, as observed
    twist  f8[6]  of the tip by the base, predicted for the coming sample
    error  f8[6]  from the tip to the target along I
    turn tip product  f8[9]
    six  f8[6]
    setpoint  f8[N]  sum of the commands since the start
    arm_history  f8[DELAYS,12]  rotation and position of the tip in the base
joints  A motion of the joints that is followed, see ``ftqp.kernel.rows.objective``.
    kp kv  f8  gains on the error
    q v  f8[N]  where each joint should be now
    x  f8[N]  its mean acceleration, or velocity, until the next tick
    demand  f8[N]  what the QP is asked for
    spared  f8  of the distance that is kept, as the motion is proven to keep the rest of it: a share
going  A motion of the joints, see ``ftqp.kernel.commands.going`` and ``ftqp.kernel.search.on_the_way``.
    goal  f8[N]
    q v a way  f8[N]  the state that it begins from, and how far each joint goes
    times jerks  f8[N,8]  of the parts of its motion
    duration  f8
    v_max a_max jerk least slow  f8[N]  limits, the least a_max, and by which speed a command has left it
    by  f8[N]  speeds on the way
    q_now v_now a_now near far  f8[N]
    moves counts  i8[N]  joints that work, and that are at the goal when it is reached
    speed tolerance t  f8
    heavy worst looks  i8  the joint whose motor cannot hold the arm farther on, -1: none
    best  f8
    since lately  i8  ticks without coming nearer, and slow ones
    ticks begun state  i8  after which tick it goes on, -1 where it begins anew; a ``Going``
    whole asks  i8  it asks for the whole task; 0: goes straight, 1: round what is kept, 2: as is asked
    plays thinks  i8  the motion is that of the search; 1: a way is looked for, 2: a motion is proven again
    blocked  i8  there is no way: 1 none was found, 2 the arm does not come to rest
    tries left late scene  i8  how often it began anew, was planned, joints that failed braked, of which scene
    rate stood brakes  f8  its pace, how long it has stood, how long it may wait for such joints [s]
    rest  f8[N]  where the arm comes to rest
    bend_times bend_jerks  f8[N,8]  of what leads from braking into the motion that was found
    known  f8[N,10]  what was believed of each joint when it was planned
    target  f8[TARGET_SIZE]
fault  A fault as it is reported, the layout of ``ftqp_fault`` in C; NaN for what is not said.
    joint  i4
    kind  i4  WORKS_STILL, IS_LOCKED_NOW or SWINGS_NOW
    mode  i4  0 brakes, 1 is at rest at once
    reset  i4  what the others' velocities do then, a ``Reset``
    deceleration damping friction  f8
    velocity acceleration torque  f8  shares of the healthy limits that are left
    q_min q_max  f8  the range that is left
load  A load in the frame of the robot's own tip, the layout of ``ftqp_load`` in C.
    mass  f8  0 is none
    com  f8[3]
    inertia  f8[9]  about its centre of mass, by rows
reserve  Shares of the acceleration limits.
    share  f8  that braking may count on
    guard  f8  up to which torque limits hold
given  What a planner was made with, as far as what it is given later needs it.
    torque_limits  i8  motors have limits that count
    dynamic on_demand  i8  as in the room ``limits``, of a healthy arm
    external  i8  another solver takes the QP
    may_swing  i8  a joint that swings freely is served
    allowed  i8  as in the room ``free``
    has_posture  i8  ``posture`` is where the null space leads, else the start is
    samples  i8  of the braking reserve
    swings  i8  a joint swings freely now
    body  i8  that moves with the robot's own tip, here without a load
    body_mass body_lever body_stoutness  f8
    length  f8  the characteristic length of the arm
    tip_rotation  f8[9]  the robot's own tip in the frame of its joint
    tip_translation  f8[3]  the same
    body_com  f8[3]
    body_inertia  f8[6]
    q_min q_max v_max a_max tau_max coulomb  f8[N]  limits and friction of the healthy arm
    jerk  f8[N]  of motions to a posture
    posture  f8[N]
    begins  i8[TERMS]  of a further task: 1 where its goal is where the arm begins, -1 where nobody sets it
    mount  f8[TERMS,9]  rotation of its frame in that of ``terms.body``
    onto  f8[TERMS,12]  the frame that its goal is given in, in that of ``terms.other``, by rows
free  Work memory beside a joint that swings freely: the plan, the gain, and the rollout on its way.
    plan  f8[SEGMENTS,N]  a factor of a_max for each segment and joint, or BRAKE
    base_q base_v  f8[N]  the state that trials begin from
    q v a x  f8[N]
    goal  f8[3]  where the tip is to be held
    goal_rotation  f8[9]
    places  f8[N+1,3]  of the joints and the tip when it was given
    start start_v trial  f8[N]
    rest  f8[N]  the posture that is tried or held
    slope step  f8[N]
    c  f8[7]
    C  f8[7,N]
    square  f8[7,7]
    A G H W S V  f8[2*N,2*N]  of the Riccati equation
    column  f8[2*N]
    gain  f8[N,2*N]  the feedback over the joints ``moving``
    lever  f8[N]
    rests  f8[STARTS,N]  postures found for the goal
    rest_costs  f8[STARTS]
    roll_q roll_v  f8[N]  where a rollout under the gain is at step ``roll_step``
    dt  f8
    phase  f8  time into the first segment
    base_phase  f8
    left  f8  how long the search goes on
    since best impact_time impact_speed impact_energy reach lowest highest way recheck  f8
    borne  f8  the speed of an impact up to which a task is followed
    given_up  f8  how long ago one was given up
    held_reach held_energy  f8  how far links would have gone from ``places``, and with which energy the joint
        met a stop, if the others had held still
    moving  i8[N]
    pivots  i8[2*N]
    refused  i8[4]  for each set of rows what spoke against it, a ``Refusal``
    joint rows stage countdown period candidate side starts iteration roll_step rolling found  i8
    unknowns quiet calming  i8
    clear_for  i8  looks ahead without an impact
reduced  The task over the joints that work, for the closed forms: Bedrossian 1993, equation 3, as J_f = J S.
        sum over working joints A_i x_i = b - sum over failed joints A_i rate_i, x_i = column_i y_i. No
        J B J' is formed, which is singular with fewer working joints than rows. Rows of A and b are expected
        with the characteristic length in them.
    A  f8[6,N]  rows of its own, where they are not those of a planner's record
    b  f8[6]
    rate  f8[N]  of a failed joint [rad/s or m/s]
    column  f8[N]  scale of each unknown: 1, relative limit, or 1/sqrt(weight)
    J  f8[6,N]  column_i A_i of the working joints
    right  f8[6]
    V  f8[6,N]  right singular vectors, one a row
    Q  f8[6,6]
    sigma square  f8[6]
    c  f8[6]  U' right
    L  f8[6,6]
    pivot w  f8[6]
    y x  f8[N]
    E  f8[N,N+1]  motion of the free-swinging joints, eliminated
    limit kappa threshold wrist  f8
    failed joint swinging  i8[N]
    n m f r rank method rule own_limits swings  i8
servo  The servos of a simulated arm: what they take, may give, and ask of their motors.
    stiffness damping  f8  gains on positions and velocities
    q v  f8[N]  command
    limit  f8[N]  what each motor may give now
    tau_max  f8[N]  what it could give when it was healthy
    unresponsive  f8[N]  1.0 for a joint that does not do what its servo wants although its motor may be on
    a  f8[N]  what each servo wants its joint to do
    demand tau  f8[N]  what it asks of its motor, and gets
study  The room of a study: the rows of its task, a goal, and memory to look at many configurations.
    m turns  i8  rows that count, and whether rotation is among them
    axis  i8  of the orientation only the tool's z axis counts, and rx and ry are the shortest turn of it
        along the goal's x and y axes; derivatives of A are not known then
    closed crossed  i8  how the last curve ended, a ``CurveEnd``; whether it passed a crossing
    length  f8  what angular rows are multiplied by [m]
    tolerance  f8  error that counts as none [m]
    step  f8  largest step of a curve [rad or m]
    side  f8  sign of det [A; tangent]
    cosine side_ahead  f8  turn of the tangent in a step, and the side behind it
    arc least  f8  length of the last curve and its smallest sigma
    rows  i8[6]  which of x, y, z, rx, ry, rz
    held  i8[N]  joints that stand still
    wraps  i8[N]  joints whose values count modulo one turn
    winding  i8[N]  turns of each joint on one round
    goal  f8[GOAL_SIZE]
    q_min q_max  f8[N]  where curves end
    full  f8[6]  error of the pose, not scaled
    e  f8[6]  error of the rows, scaled
    A  f8[6,N]  their Jacobian
    W  f8[6,N]  diag(sigma) V' of A
    U  f8[6,6]
    sigma  f8[6]
    dq  f8[N]  a step
    tangent middle ahead  f8[N]  directions of a curve at a point, behind half a step and behind the step
    first  f8[N]  at its start
    square  f8[N,N]
    pivot  f8[N]
continuation  Motions after a failure: which joints have failed and how, limits, and memory; a QP comes last.
    moving  i8  how many joints move
    whole  i8  a lost motion is followed to the end all the same
    sample  i8  where the last motion was lost
    fast  i8  where ``hurry`` first was over 1
    dt  f8  of the path
    near turned  f8  errors from which a sample is lost [m, rad]
    weight  f8  of the task
    caution  f8  the share of the way to a limit that one sample may take
    share  f8  what is left of the speed limit of a joint that is not locked; negative where it is
    position rotation  f8  the worst errors of the last motion [m, rad]
    margin  f8  the least distance of a joint that moves from its limits
    hurry  f8  the largest |v| / v_max
    clearance  f8  the least distance of two bodies that are to be kept apart, inf without any
    failed  i8[FAILED_JOINTS]  the joints that fail, -1 for none
    free  i8[N]  joints that move
    begin speed  f8[FAILED_JOINTS]  where each was when it failed, and its speed as it begins to brake
    q_min q_max v_max a_max here step  f8[N]
    B  f8[6,6]
    rhs pivots  f8[6]
law  Runs and lines of the point-to-point law, eight configurations side by side.
        Number k of joint i is at i WIDTH + k, number k of row r and column i at (r n + i) WIDTH + k. Arrays
        of eight come first, so that they do not cross lines of the cache.
    q free next k1 k2 k3 k4 trial eight eight_rate alone  f8[N*WIDTH]
    e  f8[6*WIDTH]
    A P  f8[6*N*WIDTH]
    pivot rhs  f8[6*WIDTH]
    factor turned  f8[36*WIDTH]
    way wanted  f8[6*WIDTH]
    h path time gone rate arrived fresh error speed regular found reach zero  f8[WIDTH]
    one_error one_speed one_regular used failed  f8[WIDTH]
    margin outside  f8[(N+1)*WIDTH]
    unit  f8  mean length of a link [m]
    tolerance  f8  of a step [rad]
    close  f8  how near a run must be to one of many configurations at the goal that counts as its end [rad]
    horizon success slowness per_speed spacing  f8
    most  i8  steps before a run goes on by another method
    plain  i8  M is the identity
    moves rows intervals  i8
    run steps  i8[WIDTH]
    moving  i8[N]
    M  f8[N,N]  the inverse of the weights
    here there v w y pivots k_1 k_2 k_3 f_0 f_1  f8[N]
    slope work  f8[N,N]
plan  A plan that leads the null space; its rows are arrays beside it.
    q_at  i8  address of joint values, (rows, n)
    tip_at  i8  address of position and rotation of the tip in each row, (rows, 12)
    rows begun  i8
    spacing  f8  time between two rows
    length  f8  what weighs rotations; 0 leaves them out
    at  f8  where the tip is, counted in rows
    pace  f8  how many rows it passes in a second
    tip  f8[12]  that of the last tick
batch  How many arms and ticks there are, and where the arrays of all arms lie.
    arms ticks  i8
    every  i8  after how many ticks q is kept, 0 keeps none
    kinds  i8  how many ``faults`` there are
    stop  i8  all are to end now
    {" ".join(f"{name}_at" for name in ARRAYS)}  i8
standalone  What a solver alone has beside its QP.
    centre g_given diagonal_given  f8[VARIABLES]
"""
OTHERS: Final = sections(TEXT, vars(enums) | vars(scene_room) | globals())
"""What gives the fields of each."""
