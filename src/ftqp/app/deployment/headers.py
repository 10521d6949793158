"""Headers that are made for a build: where fields lie, and what is known of an arm."""

import re
import struct
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any, Final

import numpy as np

from ftqp.control.planner.assembly import Deployable
from ftqp.control.planner.mounted_robot import SAMPLES
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.status import STOP_REASONS, StepStatus
from ftqp.control.planner.ways.way_out import HANGS, ROWS
from ftqp.control.task.task import row_indices
from ftqp.kernel.compiled.library import KERNEL, code_key
from ftqp.kernel.entry.planner_commands import LIMITS
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.layout.enums import JOINTS, NEWS, Brakes, DriveKind, FaultKind, Going, StopReason
from ftqp.kernel.layout.flat_arrays import COLUMNS
from ftqp.kernel.layout.record import dtype, zeros_in_line
from ftqp.kernel.layout.scene_room import SHAPES, TERMS, TermKind
from ftqp.kernel.layout.thresholds import OUTSIDE_FROM, SUSPECTS
from ftqp.kernel.layout.ways_room import ROOMS, WayKind

MAGIC: Final = b"FTQPARM\0"
FORMAT: Final = 6
"""Of the file; a library takes files of its own format only."""
HEAD: Final = struct.Struct("<8sII24sIIQQQQQQQQQQ")
"""Magic, format, its own size, hash of the kernel's source, joints, samples, sizes of record, given, arm,
path and its table, after how many ticks a place of the way is kept, how many runs follow, size of the file,
fingerprint of the arm, checksum. What a file does not have has 0 bytes."""
RUN: Final = struct.Struct("<QQ")
"""The part in the highest byte and the offset in the others, and how many bytes follow."""
PATH_PART: Final = 3
"""Number of the path among the parts of a file; its table is the next one."""
LINE: Final = 64
"""Bytes that are kept or left out together."""
SEED: Final = 0xCBF29CE484222325
PRIME: Final = 0x100000001B3
"""Of the checksum FNV-1a, 64 bits: it changes with every byte, and any processor computes it."""


@cache
def kernel_hash() -> str:
    """The hash of the kernel's source, which file and library must have in common, 24 hexadecimal digits."""
    return code_key(KERNEL)


def checksum(content: bytes, start: int = SEED) -> int:
    """FNV-1a of bytes, 64 bits."""
    found = start
    for byte in content:
        found = ((found ^ byte) * PRIME) & 0xFFFFFFFFFFFFFFFF
    return found


SMALL: Final = (8, 16, 32)
"""Most joints of an arm in small libraries: whole blocks of joints, as loops go through them."""


def small_capacity(joints: int) -> int:
    """The most joints of the smallest library for an arm of so many."""
    return next((capacity for capacity in SMALL if joints <= capacity), JOINTS)


def arm_file(
    memory: Deployable, joints: int, capacity: int = JOINTS, *, path: Memory | None = None,
    fingerprint: int = 0,
) -> bytes:  # fmt: skip
    """The bytes of ``arm.ftqp``."""
    kinds = [dtype("record", capacity), dtype("given", capacity), dtype("arm", capacity)]
    kept = [memory.record, memory.given, memory.arm]
    sizes = [int(kind.itemsize) for kind in kinds] + [0, 0]
    parts: dict[int, Any] = dict(enumerate(map(_fitted, kept, kinds)))
    if path is not None:
        table = np.dtype((np.void, path.table.nbytes))
        parts[PATH_PART] = _fitted(path.memory, dtype("path", capacity))
        parts[PATH_PART + 1] = np.frombuffer(path.table.tobytes(), table)
    for number, part in parts.items():
        sizes[number] = int(part.dtype.itemsize)
    runs = list(_runs(parts))
    states = np.ascontiguousarray(memory.states, dtype="<f8").tobytes()
    body = b"".join(runs) + states
    count = len(runs)
    fields = (
        MAGIC, FORMAT, HEAD.size, kernel_hash().encode(), joints, len(memory.states), *sizes,
        memory.came_every, count, HEAD.size + len(body), fingerprint,
    )  # fmt: skip
    head = HEAD.pack(*fields, 0)
    found = checksum(body, checksum(head[: HEAD.size - 8]))
    return HEAD.pack(*fields, found) + body


def _fitted(memory: Any, dtype: np.dtype[Any]) -> Any:
    """The same in a type for fewer joints, (1,): of each array its begin, where what is of joints lies."""
    if memory.dtype == dtype:
        return memory
    fitted = zeros_in_line(dtype)
    _fit(memory[0], fitted[0])
    return fitted


def _fit(source: Any, into: Any) -> None:
    """Copy each field, the arrays from their begins on."""
    for name in into.dtype.names:
        value, place = source[name], into[name]
        if place.dtype.names:
            _fit(value, place)
        elif place.ndim == 0:
            into[name] = value
        else:
            place[...] = value[tuple(slice(0, length) for length in place.shape)]


def _runs(parts: dict[int, Any]) -> Iterator[bytes]:
    """Each stretch of lines that are not zero, with its place."""
    for number, part in parts.items():
        content = part.tobytes()
        content += bytes(-len(content) % LINE)
        used = np.frombuffer(content, np.uint64).reshape(-1, LINE // 8).any(axis=1)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], used.astype(np.int8), [0]])))
        for first, last in edges.reshape(-1, 2):
            begin, end = int(first) * LINE, min(int(last) * LINE, int(part.dtype.itemsize))
            yield RUN.pack(number << 56 | begin, end - begin) + content[begin:end]


CHAIN = ("n", "floating", "tip_joint", "parent", "lead")
"""Fields of a chain by which memory is addressed, for files whose contents make no sense."""
FIELDS = (
    "chain.n", "chain.floating", "chain.has_inertia", "chain.lead", "chain.ratio", "chain.offset",
    "feedback.q_sent", "feedback.v_sent",
    "feedback.tau_sent", "feedback.kind", "state.a_command", "state.tau", "kinematics.has_dynamics",
    "feedback.speed", "task.position_error", "state.dt", "state.is_reset",
    "kinematics.R_tip", "kinematics.o_tip",
    "feedback.asks", "feedback.lost", "feedback.brakes", "watch.latched", "watch.reason",
    "terms.own", "terms.body", "terms.other", "terms.kind", "terms.hard", "terms.weight", "terms.error",
    "scene.obstacles", "scene.pairs", "scene.distance", "monitor.names", "monitor.worst", "monitor.found",
    "monitor.found_at", "monitor.began", "keeps.asked", "state.v_command", "task.sets",
)  # fmt: skip
"""Fields of the record that the C interface reads."""
PATH = ("progress", "rate", "end")
"""Fields of a path's record that the C interface reads."""
GOING = ("state", "ticks", "tolerance")
"""Fields of a motion to a posture that the C interface reads."""
WAYS = (
    "ways.drawn", "ways.starts", "ways.most_starts", "ways.node", "ways.normal", "ways.c", "chain", "scene",
    "keeps",
)  # fmt: skip
"""Fields of a search that the C interface reads, and the rooms that it copies."""
WAY_OUT = ("places", "stage")
"""Fields of a way out that the C interface reads."""
GIVEN = ("samples", "may_swing", "q_min", "q_max", "v_max")
SHOWN = {
    "Q_REFERENCE": ("state.q_command", "double[n]: the planner's own positions"),
    "V_REFERENCE": ("state.v_command", "double[n]: the planner's own velocities"),
    "ROTATION_ERROR": ("task.rotation_error", "double: of the measured end effector [rad]"),
    "ASKS_FOR_BRAKE": (
        "feedback.asks",
        "int64_t[n]: which joints are out of hand; ftqp_brakes says what to close",
    ),
    "HOLDING": ("settling.holding", "int64_t: 1 while the arm rests short of a target out of reach"),
    "STOP_REASON": ("watch.reason", "int64_t: why a stop is latched; ftqp_stop_reason says it"),
}
"""Fields of the record that users may want beside the C interface, and what they are."""

NAMED_IN_C = (
    (r"; \{joint\} is farthest.*", ""),
    (r"Clearance\(stop=\.\.\.\)", "the clearance that stops"),
    (r"\{joint\}", "a joint"),
    (r"\{pair\}", "two bodies"),
    (r"\b(report|reset|resume|stop)\(\)", r"ftqp_\1"),
    ("; report it,", "; ftqp_report it,"),
)
"""What of a sentence for Python is said otherwise in C."""

PLAIN = re.compile(r"[^ -!#-\[\]-~]")
"""What may not stand in a text of C."""


def offset(dtype: np.dtype[Any], place: str) -> int:
    """Where a field ``room.name`` lies in a type [bytes]."""
    found = 0
    for name in place.split("."):
        fields = dtype.fields
        assert fields is not None
        dtype, at = fields[name][:2]
        found += at
    return found


def layout_header(joints: int = JOINTS) -> str:
    """``layout.h``: what ``ftqp.c`` must know of the kernel's memory."""
    record, given = dtype("record", joints), dtype("given", joints)
    kinds = ("arm", "path", "going", "ways", "way_out")
    arm, path, going, ways, way_out = (dtype(kind, joints) for kind in kinds)
    numbers = {
        "FORMAT": FORMAT,
        "CAPACITY": joints,
        "MOST_SAMPLES": SAMPLES,
        "OUTSIDE_FROM": OUTSIDE_FROM,
        "SUSPECTS": SUSPECTS,
        "NEWS": NEWS,
        "JOINT_PLACES": int(TermKind.JOINTS),
        "MOST_TASKS": TERMS,
        "MOST_THINGS": SHAPES,
        "STOPPED_AS_ASKED": int(StopReason.ASKED),
        "TORQUE_DRIVE": int(DriveKind.TORQUE),
        **{f"{kind.name}_BRAKES": int(kind) for kind in Brakes},
        "SIZE_OF_RECORD": record.itemsize,
        "SIZE_OF_GIVEN": given.itemsize,
        "SIZE_OF_ARM": arm.itemsize,
        "SIZE_OF_FREE": dtype("free", joints).itemsize,
        "SIZE_OF_GOING": going.itemsize,
        "SIZE_OF_JOINTS": dtype("joints", joints).itemsize,
        "SIZE_OF_WAYS": ways.itemsize,
        "SIZE_OF_WAY_OUT": way_out.itemsize,
        **{f"WAY_OUT_{name.upper()}": offset(way_out, name) for name in WAY_OUT},
        **{f"{kind.name}_WAY": int(kind) for kind in WayKind},
        "MOST_CAME": ROWS,
        "HANGS": HANGS,
        **{f"SEARCH_{place.rpartition('.')[2].upper()}": offset(ways, place) for place in WAYS},
        **{f"GOING_{name.upper()}": offset(going, name) for name in GOING},
        **{f"GOING_{state.name}": int(state) for state in Going},
        **{f"SIZE_OF_{room.upper()}": record[room].itemsize for room in ROOMS},
        "ARM_CHAIN": offset(arm, "chain"),
        **{f"RECORD_{room.upper()}": offset(record, room) for room in ROOMS},
        **{f"IN_CHAIN_{name.upper()}": offset(arm["chain"], name) for name in CHAIN},
        **{f"FOUND_{kind.name}": int(kind) for kind in FaultKind},
        "SIZE_OF_PATH": path.itemsize,
        "SIZE_OF_INTERVAL": 8 * COLUMNS,
        **{f"PATH_{name.upper()}": offset(path, name) for name in PATH},
        "SIZE_OF_FAULT": dtype("fault").itemsize,
        "SIZE_OF_LOAD": dtype("load").itemsize,
        **{place.replace(".", "_").upper(): offset(record, place) for place in FIELDS},
        **{f"GIVEN_{name.upper()}": offset(given, name) for name in GIVEN},
    }
    said = {status.name: status.value for status in StepStatus}
    why = {f"STOP_{reason.name}": STOP_REASONS[reason] or "no stop is latched" for reason in StopReason}
    lines = [f"#define {name} {number}" for name, number in numbers.items()]
    return "\n".join(
        [
            "/* Made by ftqp build from the kernel's own layout. */",
            f'#define KERNEL_HASH "{kernel_hash()}"',
            "#define KERNEL(name) ftqp_c_##name",
            *lines,
            f"#define SENTENCES{_sentences(said)}",
            f"#define STOP_SENTENCES{_sentences(why)}",
            "",
        ]
    )


def _sentences(said: dict[str, str]) -> str:
    """Cases of a switch, each with its sentence as a program in C reads it."""
    return "".join(f' \\\n    SENTENCE(FTQP_{name}, "{_in_c(text)}")' for name, text in said.items())


def _in_c(text: str) -> str:
    """A sentence of the planner in Python with the names of C, and without those of joints."""
    for pattern, by in NAMED_IN_C:
        text = re.sub(pattern, by, text)
    return text


def _array(name: str, values: Iterable[float]) -> str:
    numbers = ", ".join(_number(float(value)) for value in values)
    return f"static const double {name}[] = {{{numbers}}};"


def _number(value: float) -> str:
    if np.isfinite(value):
        return repr(value)
    return "HUGE_VAL" if value > 0.0 else "-HUGE_VAL"


def fingerprint(planner: Planner) -> int:
    """A number of what ``arm.h`` says of an arm, 64 bits; its file has the same one."""
    return checksum("\n".join(_arm(planner)).encode())


def _arm(planner: Planner) -> list[str]:
    """What a program may build upon: another arm says something else."""
    robot, limits = planner.robot, planner.robot.limits
    rows = row_indices(planner.task.rows or robot.default_rows)
    return [
        f"#define FTQP_ARM_JOINTS {robot.nv}",
        f"#define FTQP_ARM_DT {planner.dt!r} /* s */",
        f'#define FTQP_ARM_DRIVE "{planner.drive.kind}" /* what is to be sent to the arm */',
        _names("joints", robot.joints),
        _array("ftqp_arm_neutral", robot.neutral),
        _array("ftqp_arm_tip", robot.pose(robot.neutral).ravel()),
        f"#define FTQP_ARM_ROTATES {int(max(rows) >= 3)} /* has_rotation of a target */",
        *(_array(f"ftqp_arm_{limit}", getattr(limits, limit)) for limit in LIMITS),
        *(
            line
            for what, names in (("tasks", planner.tasks), ("things", planner.scene or ()))
            if names
            for line in (f"#define FTQP_ARM_{what.upper()} {len(names)}", _names(what, names))
        ),
    ]


def _names(what: str, names: Iterable[str]) -> str:
    """An array of names."""
    return f"static const char *const ftqp_arm_{what}[] = {{{', '.join(_text(name) for name in names)}}};"


def _text(name: str) -> str:
    return f'"{PLAIN.sub("_", name)}"'


def arm_header(
    planner: Planner, name: str, file: bytes, *, embedded: bool, joints: int = JOINTS,
    duration: float | None = None,
) -> str:  # fmt: skip
    """``arm.h``: names, limits and places of an arm's planner, and its file where that is embedded."""
    robot = planner.robot
    head = 64 * -(-HEAD_OF_PLANNER // 64)
    record = dtype("record", joints)
    lines = [
        f"/* arm.h - {name}: {robot.name}, tip {robot.tip}. Made by ftqp build for the library next to it. "
        "*/",
        "#ifndef FTQP_ARM_H", "#define FTQP_ARM_H", "", "#include <math.h>", "#include <stdint.h>", "",
        "/* Of what is said of the arm here; ftqp_open_for refuses an arm.ftqp of another one. */",
        f"#define FTQP_ARM_FINGERPRINT UINT64_C({fingerprint(planner):#018x})", "",
        *_arm(planner),
        *([] if duration is None else [f"#define FTQP_ARM_PATH_DURATION {duration!r} /* s */"]),
        "", "/* Of the formulas of library and arm.ftqp, for logs: ftqp_open compares theirs by itself. */",
        f'#define FTQP_KERNEL_HASH "{kernel_hash()}"',
        "", "/* Where else in a planner's memory something lies [bytes from its begin]. */",
        *(
            f"#define FTQP_AT_{key} {head + offset(record, place)} /* {meaning} */"
            for key, (place, meaning) in SHOWN.items()
        ),
        "",
    ]  # fmt: skip
    if embedded:
        lines += [
            "/* The bytes of arm.ftqp, for boards without files. */",
            "#define FTQP_ARM_EMBEDDED 1",
            _bytes(file),
        ]
    return "\n".join([*lines, "#endif", ""])


def _bytes(file: bytes) -> str:
    rows = (", ".join(str(byte) for byte in file[at : at + 24]) for at in range(0, len(file), 24))
    body = ",\n    ".join(rows)
    return f"static const unsigned char ftqp_arm_file[] = {{\n    {body}\n}};\n"


HEAD_OF_PLANNER = 8 + 4 * 4 + 16 * 8 + 2 * 8 + 3 * 8
"""Bytes of ``struct ftqp`` in ``ftqp.c``, behind which the record lies."""
