"""The rooms of clearance: the arm as capsules, what stands around it, and the pairs that keep apart."""

from enum import IntEnum

from ftqp.kernel.layout.field_kinds import Fields, floats, integers, scalars
from ftqp.kernel.layout.rows import CLEARANCES

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


class Shape(IntEnum):
    """What an obstacle is; spheres and capsules are segments."""

    NOTHING = 0
    SEGMENT = 1
    HALF_SPACE = 2
    BOX = 3
    CYLINDER = 4
    HULL = 5


NOTHING, SEGMENT, HALF_SPACE, BOX, CYLINDER, HULL = map(int, Shape)


def scene_fields(N: int) -> Fields:
    """What ``ftqp.kernel.scene`` knows.

    A capsule moves with the frame of the joint ``body``, from ``end_a`` to ``end_b`` there and ``wide``;
    ``a`` and ``b`` are its ends in W, placed where ``stamped`` is the ``stamp`` of the tick. ``solid`` of
    an obstacle is a ``Shape``; it stands at ``place``, turned by ``turn``, with ``extent``: half the length
    along z and the radius of a segment or cylinder, half the edges of a box; ``twist`` is its velocity, at
    ``place``, along W. Of a hull ``extent`` is how far it reaches along its axes, ``edges_of`` and
    ``faces_of`` are its first edge and face and those behind its last; an ``edge`` is two rows of
    ``corner``, a ``face`` the normal n and the offset d of n'x <= d, all in its own frame.

    Pair p is of capsule ``first`` and capsule ``second``, or obstacle -1 - ``second``. ``gap`` is its
    distance when it was looked at plus all the ``way`` that anything had gone by then, so that gap - way is
    no more than its distance now; it is looked at again in tick ``look``, or where it may be the nearest.
    ``joint_way``: how far anything moves with a joint at most, by its angle [m/rad].

    ``slot`` is the pair of each row, -1 none; ``G`` its gradient, ``least`` the right side; ``spare`` by how
    much its velocity may grow until the row holds it back; ``met`` whether it was found in this tick.
    ``distance`` is the least of all pairs, at the predicted posture, and ``nearest`` that pair, whose bodies
    are ``closing`` in; ``crowded``: a row has found no slot. ``normal``, ``near``, ``far``: of the pair that
    is looked at, the direction to its first body and the points on both; ``local``,
    ``along`` and ``row`` are memory.

    A ``cloud`` of so many balls, x, y, z and radius, lies at the address ``cloud_at``. From pair
    ``cloud_pair`` on each body has NEAREST pairs; ``ball`` is which ball an obstacle stands for, -1 none.
    They were chosen in tick ``chosen_tick``, when ``way`` was ``chosen_way``. ``away`` and ``taken`` are
    memory.

    The scene has so many ``things``, its cloud counted as one. ``laid`` counts how often the room was laid
    out, and ``version`` is that of the scene then; its version now lies at the address ``version_at``, 0 for
    a copy, whose scene stays as it is.
    """
    return [
        *scalars(
            "i8",
            "pairs capsules obstacles held nearest closing crowded stamp "
            "cloud cloud_at cloud_pair chosen_tick things laid version version_at",
        ),
        *scalars("f8", "keep halt gain share way distance chosen_way"),
        *integers({"body": (CAPSULES,), "stamped": (CAPSULES,), "solid": (OBSTACLES,)}),
        *floats(dict.fromkeys(("end_a", "end_b", "a", "b"), (CAPSULES, 3))),
        *floats({"wide": (CAPSULES,), "place": (OBSTACLES, 3), "turn": (OBSTACLES, 9)}),
        *floats({"extent": (OBSTACLES, 3), "twist": (OBSTACLES, 6), "joint_way": (N,)}),
        *integers(dict.fromkeys(("first", "second", "look"), (PAIRS,))),
        *floats({"gap": (PAIRS,)}),
        *integers(dict.fromkeys(("slot", "met"), (CLEARANCES,))),
        *floats({"G": (CLEARANCES, N), "least": (CLEARANCES,), "spare": (CLEARANCES,)}),
        *floats(dict.fromkeys(("normal", "near", "far", "local", "along"), (3,))),
        *floats({"row": (N,), "away": (BALLS,)}),
        *integers({"ball": (OBSTACLES,), "taken": (NEAREST,)}),
        *integers({"edges_of": (SHAPES, 2), "faces_of": (SHAPES, 2), "edge": (HULL_EDGES, 2)}),
        *floats({"corner": (HULL_CORNERS, 3), "face": (HULL_FACES, 4)}),
    ]


def ahead_fields(N: int) -> Fields:
    """Kinematics at the predicted posture ``q``, as in ``kinematics``.

    That is q + v dt, or q itself at the velocity level.
    """
    return floats(
        {
            "q": (N,),
            "sine": (N,),
            "cosine": (N,),
            "R": (N, 9),
            "o": (N, 3),
            "axis_w": (N, 3),
            "R_tip": (9,),
            "o_tip": (3,),
            "J": (6, N),
            "J_each": (6, N),
        }
    )
