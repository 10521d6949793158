"""The ways in from Python and from C: every entry point, who makes it, and what it takes."""

from dataclasses import replace
from typing import Final

from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.layout.record import CAPACITIES


def _entry(name: str, module: str, signature: str, nogil: bool = False) -> EntryPoint:
    """An entry point whose factory has its name."""
    return EntryPoint(name=name, module=module, factory=name, signature=signature, nogil=nogil)


_STEPS, _EXTERNAL = "ftqp.kernel.ticks.steps", "ftqp.kernel.ticks.external_steps"
_NETWORK, _CLOSED = "ftqp.kernel.ticks.network_steps", "ftqp.kernel.ticks.closed_form_steps"
_DETECTION = "ftqp.kernel.entry.detect_entries"
_ARM, _STANDALONE = "ftqp.kernel.entry.arm_entries", "ftqp.kernel.entry.standalone_entries"
_TOLD = "ftqp.kernel.entry.told_entries"
_STUDY = "ftqp.kernel.entry.study_entries"
_CONTINUATION = "ftqp.kernel.entry.continuation_entries"

ENTRIES: Final = {
    entry.name: entry
    for entry in (
        _entry("step", _STEPS, "ioooi"),
        _entry("step_rich", _STEPS, "ioooi"),
        _entry("step_free", _STEPS, "iioooi"),
        _entry("step_path", _STEPS, "iiiioo"),
        _entry("step_base", _STEPS, "iioooi"),
        _entry("step_joints", _STEPS, "iioo"),
        _entry("prepare_clock", _EXTERNAL, "iioooi"),
        _entry("finish_clock", _EXTERNAL, "iiii"),
        _entry("prepare_path", _EXTERNAL, "iiiiioo"),
        _entry("finish_path", _EXTERNAL, "iiiii"),
        _entry("prepare_base", _EXTERNAL, "iiioooi"),
        _entry("finish_base", _EXTERNAL, "iiiii"),
        _entry("network_clock", _NETWORK, "iiioooi"),
        _entry("network_path", _NETWORK, "iiiiiioo"),
        _entry("network_base", _NETWORK, "iiiioooi"),
        _entry("closed_form_clock", _CLOSED, "iioooi"),
        _entry("closed_form_base", _CLOSED, "iiioooi"),
        _entry("resolve_reduced", _CLOSED, "i"),
        _entry("kappa", _CLOSED, "i"),
        _entry("kinematics", _ARM, "ii"),
        _entry("inverse_dynamics", _ARM, "ii"),
        _entry("torques", _ARM, "i"),
        _entry("servo_torques", _ARM, "iiooo"),
        _entry("pair_distances", "ftqp.kernel.entry.scene_entries", "iiii", nogil=True),
        _entry("write_together", "ftqp.kernel.entry.scene_entries", "ii"),
        _entry("block", "ftqp.kernel.ticks.block_of_ticks", "iooooiiiiiii"),
        _entry("rollout", "ftqp.kernel.entry.rollout", "i" * 6, nogil=True),
        _entry("write_target", "ftqp.kernel.entry.target_entry", "iooo"),
        _entry("follow_plan", "ftqp.kernel.entry.plan_entry", "ii"),
        _entry("believe", _TOLD, "iiii"),
        _entry("believed", _TOLD, "ii"),
        _entry("sample_reserve", _TOLD, "iii"),
        _entry("reserve_shares", _TOLD, "i" * 6),
        _entry("count_on", _TOLD, "iiiii"),
        _entry("hold_up", _TOLD, "iii"),
        _entry("ask_for_brake", _TOLD, "ii"),
        _entry("start", _TOLD, "iiii"),
        _entry("stop", _TOLD, "ii"),
        _entry("resume", _TOLD, "i"),
        _entry("carry", _TOLD, "iiii"),
        _entry("give_up", _TOLD, "i"),
        _entry("begin_path", _TOLD, "i"),
        _entry("miss_tick", _TOLD, "ioiiiii"),
        _entry("detect", _DETECTION, "iioooooo"),
        _entry("watch", _DETECTION, "iiii"),
        _entry("tell_detector", _DETECTION, "iii"),
        _entry("detect_log", _DETECTION, "i" * 10, nogil=True),
        _entry("solve_qp", _STANDALONE, "i"),
        _entry("kkt", _STANDALONE, "iiiiii"),
        _entry("solve_network", _STANDALONE, "i" * 11),
        _entry("solve_network_batch", _STANDALONE, "iiiiii", nogil=True),
        _entry("study_values", _STUDY, "i" * 8, nogil=True),
        _entry("study_clearances", _STUDY, "i" * 4, nogil=True),
        _entry("study_solutions", _STUDY, "i" * 8, nogil=True),
        _entry("study_curve", _STUDY, "i" * 5, nogil=True),
        _entry("study_self_motions", _STUDY, "i" * 8, nogil=True),
        _entry("study_runs", "ftqp.kernel.study.law_runs", "iiiii", nogil=True),
        _entry("study_lines", "ftqp.kernel.study.law_lines", "iiiii", nogil=True),
        _entry("exact_continuations", _CONTINUATION, "iiiii", nogil=True),
        _entry("bounded_continuations", _CONTINUATION, "iiiii", nogil=True),
        _entry("self_speed_tracks", _CONTINUATION, "iiiii", nogil=True),
    )
}
"""By name."""

ANY_SIZE: Final = 0
"""The capacity of entries that know no robot."""

ALONE: Final = ("write_target", "write_together", "solve_qp", "kkt", "solve_network", "solve_network_batch")
"""The entry points that know no robot."""

FIRST: Final = (
    (ENTRIES["write_target"], ANY_SIZE),
    *(
        (ENTRIES[name], CAPACITIES[0])
        for name in (
            "step",
            "block",
            "kinematics",
            "inverse_dynamics",
            "torques",
            "believe",
            "believed",
            "sample_reserve",
            "reserve_shares",
            "count_on",
            "hold_up",
            "start",
            "stop",
            "resume",
            "carry",
            "servo_torques",
            "watch",
            "tell_detector",
            "detect",
        )
    ),
)
"""What the demo's first picture and a planner of a small arm need that is given targets."""

DEMO: Final = (
    *FIRST,
    (ENTRIES["write_together"], ANY_SIZE),
    *((ENTRIES[name], CAPACITIES[0]) for name in ("pair_distances", "step_joints", "study_solutions")),
)
"""What all of the demo needs: the box, and the goal that needs another way, too."""

BUILT: Final = (
    *DEMO,
    *(
        (entry, capacity)
        for capacity in CAPACITIES
        for name, entry in ENTRIES.items()
        if name not in ALONE and (entry, capacity) not in DEMO
    ),
    *((ENTRIES[name], ANY_SIZE) for name in ALONE[2:]),
)
"""What is built: entry points with the capacities of their records."""

PARTS: Final = {"first": FIRST, "demo": DEMO, "all": BUILT}
"""What may be built by itself, each part with those before it."""

DEPLOYED: Final = tuple(
    replace(entry, caller="c")
    for entry in (
        _entry("deployed_step", "ftqp.kernel.ticks.deployed_step", "i" * 8),
        *(
            ENTRIES[name]
            for name in (
                "believe",
                "believed",
                "sample_reserve",
                "count_on",
                "hold_up",
                "start",
                "stop",
                "resume",
                "carry",
                "torques",
            )
        ),
    )
)
"""The ways in from C: what ``ftqp build`` puts into a library."""

WATCHING: Final = tuple(replace(ENTRIES[name], caller="c") for name in ("watch", "tell_detector"))
"""The ways in to a detector from C, for libraries that are built with it."""

FOLLOWING: Final = tuple(
    replace(entry, caller="c")
    for entry in (
        _entry("deployed_follow", "ftqp.kernel.ticks.deployed_follow", "i" * 10),
        ENTRIES["begin_path"],
    )
)
"""The ways in along a path from C, for libraries that are built with one."""
