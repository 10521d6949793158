"""The room of a search for a way of the joints: what is asked, and its memory."""

from enum import IntEnum
from typing import TYPE_CHECKING, Final

from ftqp.kernel.layout import scene_room
from ftqp.kernel.layout.enums import numbered
from ftqp.kernel.layout.rows import KEEPS
from ftqp.kernel.layout.structures import sections

if TYPE_CHECKING:
    from ftqp.kernel.layout.enums import __getattr__ as __getattr__

NODES, NODE_NUMBERS = 20_000, 140_000
"""The most nodes of a tree, and the most numbers in them. Conventions, which size memory: 20,000 with seven
joints."""
PLACES, POSES, PIECES, INTERVALS, STRETCHES = 512, 256, 1024, 4800, 128
"""The most places of a way, poses of a tube or a path, pieces of a rounded way, intervals in time, and
stretches of an edge that are still to be looked at. Conventions, which size memory."""
TABLE = 500_000
"""The most numbers in a motion that was timed: 71 s of seven joints at 1 kHz, and what takes longer has fewer
places. A convention, which sizes memory."""

HINDRANCES = 5 * scene_room.PAIRS + 1
"""Things that may stand in the way of a posture."""

PROOF: Final = 0.5
"""The motion is proven with this share of what is kept at least: the mean leaves the way that was proven."""

LOOKS_A_SECOND, LEAST_LOOKS = 50_000, 10
"""Looks at postures for the time between two ticks [1/s], which take a sixth of a processor
(``python benchmarks/ft_mbm.py``), and the least number of them."""
MOST: Final = 400_000
"""So many looks are spent on trees at most, about a second. A guess."""
SHORTENING_LOOKS: Final = 1500
"""So many looks are spent on making a way shorter. A guess: 3,000 shorten ways from 8.1 to 4.9 rad and take
ten times the search."""
ROOMS: Final = ("chain", "scene", "keeps")
"""What a search has of a planner's record."""
PLANNERS_ROWS: Final = -1
"""The rows of poses that count are those of the planner's task."""
STRAIGHT, ROUND, AS_ASKED = 0, 1, 2
"""How the joints go: straight, round what is kept, or as the search is asked, whatever is kept."""
NONE_FOUND, NO_REST = 1, 2
"""Why there is no way: none was found, or the arm does not come to rest."""


@numbered()
class WayStage(IntEnum):
    """How far a search is."""

    FOLLOWING = 0
    GROWING = 1
    SHORTENING = 2
    ROUNDING = 3
    PACING = 4
    SAMPLING = 5
    PROVING = 6
    READY = 7
    NO_WAY = 8


@numbered("{}_WAY")
class WayKind(IntEnum):
    """Ways out of where an arm is stuck, in the order in which they are tried."""

    BACK = 0
    TIPS = 1  # back along the tip's way
    HOME = 2
    HALT = 3
    STOP = 4


OUT_PLACES: Final = 60
"""Places of a way out at most."""
TEXT: Final = """
way_out  A way out, the layout of ``ftqp_way`` in C first, see ``ftqp.kernel.ticks.way_trials``.
    kind  i8  a ``WayKind``
    clear arrives near still  i8  it arrives, may be gone everywhere; comes too near; rows that can still move
    rows  i8  of the tip's way back, what is kept, as ``asks_rows``; else 0
    time clearance effort limit force moment  f8  see ``ftqp.control.planner.ways.way_out.WayOut``
    stage ticks  i8  how far it is, and the motion that is tried
    drawn best around  i8  postures that were drawn, the best one, and that round which the next ones are
    least  f8  what the best one costs
    weak  i8  a motor cannot hold the arm somewhere on it
    has_axis  i8  as ``asks_axis``
    room most  f8  the room and the effort with which it begins, beyond which less and more is too much
    places  i8
    place  f8[OUT_PLACES,N]
    failed  i8[N]  joints that had failed when it was tried
    stand seen  f8[N]  where braking ends, and where the joints are seen in thought
    mark  i8[POSES]  memory: places that stay
ways  What a search for a way of the joints is asked, and its memory, see ``ftqp.kernel.search``.
        The rooms ``chain``, ``ahead``, ``scene`` and ``keeps`` behind it are those of a planner.
    asks_rows asks_axis  i8  the rows of poses that count, as ``rows``, -1: those of the planner's task
    asks_pose asks_nears asks_straight asks_most  i8  as ``has_goal``, ``nears``, ``straight``, ``most`` begin
    asks_rise  f8  what ``rise`` is at least [s]
    asks_places  i8  so many of ``given_place`` are gone to one after the other; 0: the way is looked for
    given_goal  f8[16]
    given_tube  f8[POSES,12]
    given_place  f8[PLACES,N]
    a_least jerk  f8[N]  the least a_max, and the largest jerk
    start_met goal_met  i8  what stands in the way of the start, and of the last goal, see ``obstruction``
    again  i8  what is proven is a motion that was found before, ...
    again_with  f8  ... with this share of what is kept
    stage  i8  a ``WayStage``
    looks  i8  postures that were looked at
    until  i8  the number of them at which shortening ends
    found  i8  the number of them at which there was a way
    shortening  i8  so many are spent on that at most
    most  i8  so many are spent on the trees at most
    starts most_starts posed clear  i8  Newton starts, at most, that came to the goal, and are clear
    first second  i8  of the sequence of random numbers
    tree joining new last grown vain  i8  which tree grows, whether it joins, its last nodes
    places  i8  of the way
    count  i8[2]  nodes of the trees
    hindered  i8[HINDRANCES]  how often each thing stood in the way of a posture of the goal, by what
        ``obstruction`` says
    nears  i8  0: only a posture of the goal will do, 1: a near place will, which is looked for
        2: from the start on, 3: as the nearest posture that was found, 4: from the trees on
    least left  f8  squared error of the nearest posture, and of the last start or node [m2, rad2]
    best wanted  f8[N]  the nearest posture, and the goal posture that was added last
    has_goal  i8  the goal is a pose, whose postures are looked for
    has_axis  i8  of its orientation only the tool's z axis counts, as in the room ``study``
    goal_rows rows  i8  a bit for each of x, y, z, rx, ry, rz: of the goal, of the tube
    tube  i8  so many poses of a path that the tip stays near; 0: it goes anywhere
    weighs  i8  torque limits count
    pairs  i8  so many pairs of the scene are looked at
    bodies  i8  capsules in them
    met  i8  what was met last, see ``ftqp.kernel.search.looks.obstruction``
    near_pose  i8  the pose of the tube that is nearest to the tip
    capped  i8  an edge was given up for its many looks
    chunk  i8  so many ticks of the motion are proven at once
    corner pieces grid paced ticks window checked is_free  i8  of timing: what is done so far
    straight  i8  the way is that of the tip along the path
    keep  f8  how far bodies are apart [m]
    share  f8  of that which counts now
    effort  f8  share of the torque limits that may hold the arm
    length  f8  what a radian of the tip counts [m]
    tolerance  f8[2]  of a pose, in place and in turning times ``length`` [m]
    slack  f8  by how much an edge may leave the tube between places [m]
    dt rise speed  f8  of the motion: a tick, a_max over the largest jerk [s], share of the speed limits
    period  f8  the time between two places of it [s]: a tick, or more where there would be too many
    before  f8  what is cut from the leg that comes
    fine  f8  longest interval of time scaling [rad or m]
    cut  f8  so much of the piece ``paced`` is cut into intervals [rad or m]
    held holds  f8  no interval is faster than this s'^2, for so much longer [s]
    tip_speed tip_acceleration  f8[2]  of a straight way, linear and angular
    free  i8[N]  joints that work
    low high  f8[N]  between which starts are drawn
    q_min q_max v_max a_max tau_max  f8[N]
    start  f8[N]
    goal  f8[12]  rows of the goal's pose
    tool  f8[9]  rotation whose z is the tool axis, in the tip frame
    tube_pose  f8[POSES,12]
    path followed  i8  poses of the rest of a path, and the last of them that was come to from ``follows``
    path_pose  f8[POSES,12]
    leap  f8[N]  how far joints go from one of them to the next at most [rad or m]
    follows  f8[N]  where the arm is there
    radius  f8[2]  how far the tip may be from them [m], and in turning times ``length`` [m]
    pair  i8[PAIRS]  pairs of the scene
    allow  f8[PAIRS]  how far each is apart at least [m]: ``keep``, or less where the start has less
    parts  f8[PAIRS,3]  the way between the bodies that parted each when it was looked at last
    keep_allow  f8[KEEPS]  the same of what is kept
    ball_allow  f8[CAPSULES]  the same of a body and the balls of a cloud
    is_body  i8[CAPSULES]  a capsule is in a pair
    sees_balls  i8[CAPSULES]  a body keeps clear of the balls
    apart  i8[PAIRS,2]  the first joint that moves the one of its bodies and not the other, -1 none
    way  f8[N]  how far each joint goes from where the arm is looked at
    goes  f8[CAPSULES,N]  how far each body goes by the joints from each one on at most
    at_least  f8[PAIRS]  pairs are so far apart at least, while the way is cut into intervals [m]
    firm  f8  the least a_max over what a joint goes, there
    moved  f8[CAPSULES]  and by all of them
    keep_moved  f8[KEEPS]  the same of what is kept
    most_moved  f8  the most of ``moved``
    middle  f8[CAPSULES,3]
    girth  f8[CAPSULES]  half the length of a capsule, and its radius
    around  f8[OBSTACLES,3]  half the edges along W of a box around each
    node  f8[2,NODE_NUMBERS]  the trees, n numbers a node
    parent  i8[2,NODES]
    place  f8[PLACES,N]  the way
    walk  f8[POSES,N]  memory: the way that is tried in place of a part
    normal one other  f8[3]  memory: of a pair
    row  f8[N]  memory
    q end near drawn begin finish followed_to  f8[N]  memory
    line  f8[3,N]  memory: c0, c1, c2 of an edge
    stretch  f8[STRETCHES,2]  memory: begin and end of those of an edge
    e  f8[6]  the tip's error
    A  f8[6,N]  and its Jacobian
    M  f8[6,6]  memory
    y  f8[6]  memory: of a step
    mass  f8[N]  memory: behind a joint
    moment  f8[N,3]
    torque  f8[N]
    c  f8[PIECES,3,N]  pieces q = c0 + c1 s + c2 s^2 of the rounded way
    size_of  f8[PIECES]  how long each is [rad or m]
    x time  f8[INTERVALS+1]  s'^2 and the time at the begin of each interval
    u  f8[INTERVALS]  s'' in it
    piece  i8[INTERVALS]  which it is part of, ...
    s ds  f8[INTERVALS]  ... from where, and for how long
    rests  i8[INTERVALS]  the arm rests at its begin
    top  f8[INTERVALS]  the largest s'^2 with which bodies come near no faster than they may
    tip_rate  f8[INTERVALS+1,2]  the tip's way, linear and angular, by that of the joints at its begin
    alpha beta gamma  f8[4*N+12]  memory: limits alpha u + beta x <= gamma
    turned  f8[9]  memory
    table  f8[TABLE]  the motion: places of the joints from rest to rest
"""
WAYS: Final = sections(TEXT, vars(scene_room) | globals() | {"KEEPS": KEEPS})
"""What gives its fields."""
