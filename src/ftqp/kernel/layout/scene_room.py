"""The rooms of what stands around an arm, and of what is asked beside the task of the tip."""

from enum import IntEnum
from typing import TYPE_CHECKING, Final

from ftqp.kernel.layout import rows
from ftqp.kernel.layout.enums import numbered
from ftqp.kernel.layout.structures import sections

if TYPE_CHECKING:
    from ftqp.kernel.layout.enums import __getattr__ as __getattr__

CAPSULES = 128
"""The most capsules of an arm, their ends among them. A convention, which sizes memory."""
SHAPES = 64
"""The most shapes around an arm that have a name. A convention, which sizes memory."""
NEAREST = 6
"""So many balls of a cloud each body of an arm looks at. A convention."""
CLOUD_BODIES = 20
"""The most bodies of an arm that look at a cloud. A convention, which sizes memory."""
OBSTACLES = SHAPES + NEAREST * CLOUD_BODIES
"""The most shapes around an arm, with the balls that are looked at."""
BALLS = 4096
"""The most balls of a cloud. A convention, which sizes memory."""
PAIRS = 1024
"""The most pairs that are watched. A convention, which sizes memory."""
HULL_CORNERS, HULL_EDGES, HULL_FACES = 512, 1024, 640
"""The most corners, edges and faces of all hulls around an arm. Conventions, which size memory: 64 boxes have
512, 768 and 384."""
BODY_CORNERS, BLOCK = 2048, 8
"""The most corners of the bodies of an arm, of which each has whole blocks: as many as are looked at at once.
A convention, which sizes memory: a Panda's meshes have 1,000."""


Shape = IntEnum("Shape", "NOTHING SEGMENT HALF_SPACE BOX CYLINDER HULL", start=0)
"""What an obstacle is; spheres and capsules are segments."""
numbered()(Shape)

TERMS = 8
"""The most tasks that a planner may have beside that of the tip. A convention, which sizes memory."""
PLACES_OF = TERMS + 1
"""Places for them: the one behind the planner's own draws the tip to rows that were given up."""


TermKind = IntEnum("TermKind", "FRAME AXIS MASS JOINTS OWN", start=0)
"""What a further task asks for."""
numbered(JOINTS="JOINT_PLACES")(TermKind)

BESIDE_TIP, BEFORE_SCHEME = 1, 2
"""How a term stands in the objective where it does not by its weight alone, which is 0."""


TEXT: Final = """
terms  Further tasks, see ``ftqp.kernel.rows.further_tasks`` and ``ftqp.kernel.rows.task_terms``.
    count  i8  one more than ``own`` while rows are given up, see ``ftqp.kernel.rows.rows_given_up``
    own  i8  how many the planner has
    shared  i8  how many terms stand beside the tip
    bends  i8  what their errors bend by counts
    missed  i8  how many of those that are required the command misses
    length  f8  what a radian counts [m]
    stands  f8  firmness 1/soft at which terms beside the tip are in H, negative while no terms are
    added  f8  by how much tr H has grown
    worst  f8  the largest error of one as a share of its tolerance
    kind  i8[PLACES_OF]  a ``TermKind``
    body  i8[PLACES_OF]  the joint whose frame a point or an axis moves with, -1 is the base
    other  i8[PLACES_OF]  the one that its goal moves with
    rows  i8[PLACES_OF]  one bit for each of x, y, z, rx, ry, rz
    towards  i8[PLACES_OF]  an axis points at ``goal``
    m  i8[PLACES_OF]  rows of a task that the user fills in
    hard  i8[PLACES_OF]  rows of C, before the task of the tip, in place of terms of the objective
    shares  i8[PLACES_OF]  terms as firm as the rows of the tip, beside which they stand, or before the scheme
    required  i8[PLACES_OF]  counts for the status
    weight kp kv  f8[PLACES_OF]
    place axis  f8[PLACES_OF,3]  in the frame of ``body``
    goal  f8[PLACES_OF,3]  where the point should be, or what the axis should point at, in the frame of
        ``other``; or else the direction that it should have along W
    error  f8[PLACES_OF,6]  as of the last tick
    rate rate_change  f8[PLACES_OF,6]  twist and acceleration of a goal along W
    asked  f8[PLACES_OF,6]  of the rows
    slack  f8[PLACES_OF,6]  J x - b of the command
    turn  f8[PLACES_OF,9]  how ``body`` should stand in ``other``
    q_goal share  f8[PLACES_OF,N]  of a task of joints
    J  f8[PLACES_OF,6,N]  of a task that the user fills in; of the others as of the last tick
    b  f8[PLACES_OF,6]  the same
keeps  What ``ftqp.kernel.rows.row_blocks`` needs: planes, cones, and rows of the user's own.
    asked  i8  how many rows the planner asks for, those of tasks included
    count  i8
    own  i8  rows of the user's own
    body  i8[KEEPS]  the joint whose frame the point ``place`` moves with
    turns  i8[KEEPS]  ``place`` is an axis of the frame that stays within ``offset`` of ``normal`` [rad]
    offset  f8[KEEPS]  ``normal``'p >= ``offset`` is its side
    brake  f8[KEEPS]  how hard the arm can brake it there
    distance  f8[KEEPS]  as of the last tick
    place  f8[KEEPS,3]
    normal  f8[KEEPS,3]  along W
    own_C  f8[OWN_ROWS,N]
    own_l own_u  f8[OWN_ROWS]
scene  What ``ftqp.kernel.scene`` knows: the arm as capsules, what is around, and the pairs that keep apart.
    pairs capsules obstacles held  i8
    nearest  i8  the pair that is nearest at the predicted posture
    closing  i8  its bodies close in
    crowded  i8  a row has found no slot
    corners  i8  of ``simplex``
    stamp  i8  of the tick
    cloud  i8  so many balls, x, y, z and radius, lie at the address ``cloud_at``
    cloud_at  i8
    cloud_pair  i8  from this pair on each body has NEAREST pairs
    chosen_tick  i8  when balls were chosen
    things  i8  of the scene, its cloud counted as one
    whole  i8  so many of the capsules are bodies, and not ends of them
    laid  i8  how often the room was laid out
    version  i8  that of the scene then
    version_at  i8  where its version now lies; 0 for a copy, whose scene stays as it is
    keep halt gain share  f8
    way  f8  all that anything had gone by now
    distance  f8  the least of all pairs, at the predicted posture
    chosen_way  f8  ``way`` when balls were chosen
    body  i8[CAPSULES]  the joint whose frame a capsule moves with
    stamped  i8[CAPSULES]  its ends in W were placed in the tick of this stamp
    solid  i8[OBSTACLES]  a ``Shape``
    end_a end_b  f8[CAPSULES,3]  of a capsule in its frame
    a b  f8[CAPSULES,3]  the same in W
    wide  f8[CAPSULES]
    place  f8[OBSTACLES,3]
    turn  f8[OBSTACLES,9]
    extent  f8[OBSTACLES,3]  half the length along z and the radius of a segment or cylinder, half the edges
        of a box, how far a hull reaches along its axes
    twist  f8[OBSTACLES,6]  velocity at ``place``, along W
    joint_way  f8[N]  how far anything moves with a joint at most, by its angle [m/rad]
    first  i8[PAIRS]  capsule
    second  i8[PAIRS]  capsule, or obstacle -1 - ``second``
    look  i8[PAIRS]  the tick in which the pair is looked at again, if it may not be the nearest before
    gap  f8[PAIRS]  distance when it was looked at plus ``way`` then: gap - way is at most its distance
    slot  i8[CLEARANCES]  the pair of each row, -1 none
    met  i8[CLEARANCES]  it was found in this tick
    G  f8[CLEARANCES,N]  gradient of each row
    least  f8[CLEARANCES]  right side
    spare  f8[CLEARANCES]  by how much its velocity may grow until the row holds it back
    normal near far  f8[3]  of the pair that is looked at: direction to its first body, and points on both
    row  f8[N]  memory
    away  f8[BALLS]  memory
    ball  i8[OBSTACLES]  which ball an obstacle stands for, -1 none
    taken  i8[NEAREST]  memory
    edges_of faces_of  i8[SHAPES,2]  first edge and face of a hull, and those behind its last
    edge  i8[HULL_EDGES,2]  two rows of ``corner``
    corner  f8[HULL_CORNERS,3]
    face  f8[HULL_FACES,4]  the normal n and the offset d of n'x <= d in the hull's own frame
    corners_of  i8[SHAPES,2]  first corner of a hull, and the one behind its last
    hull_of  i8[CAPSULES,2]  the same of the convex body in a capsule, alike where only that is known
    hull_corner  f8[3,BODY_CORNERS]  in the frame of the body; those of each fill blocks of eight
    simplex  f8[4,10]  memory: w = x - y, x on the first body, y on the second, and the share of each corner
ahead  Kinematics at the predicted posture: q + v dt, or q itself at the velocity level.
    q sine cosine  f8[N]
    R  f8[N,9]
    o axis_w  f8[N,3]
    R_tip  f8[9]
    o_tip  f8[3]
    J J_each  f8[6,N]
"""
SCENE_ROOMS: Final = sections(TEXT, vars(rows) | globals())
"""What gives the fields of each."""
