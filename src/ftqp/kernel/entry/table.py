"""The ways in from Python and from C: every entry point, its formula, and what it takes.

What an entry point takes is said once, and its addresses become records and arrays. Its text names the
arguments in their order, with spaces between: ``K:record`` is the address of a record of that kind,
``q:f8[count,n]`` that of an array, whose shape may name other arguments and what is in records, ``q:object``
a Python object, and a name alone a whole number.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import import_module
from typing import Any, Final, NamedTuple

import numpy as np

from ftqp.kernel.compiled.library import EntryPoint
from ftqp.kernel.layout.enums import JOINTS
from ftqp.kernel.layout.record import KINDS, dtype

NUMBERS: Final = {"f8": np.dtype(np.float64), "i8": np.dtype(np.int64), "i1": np.dtype(np.int8)}
OBJECT: Final = "object"
_ARGUMENT: Final = re.compile(r"(\w+)(?::(\w+)(?:\[(\S+)\])?)?")


class Spec(NamedTuple):
    """What an entry point takes, and the formula that it calls."""

    module: str  # Where the names in ``call`` and ``first`` are found
    takes: str  # Its arguments
    call: str  # The call of the formula, or its name, which returns a number, a truth value or nothing (0)
    first: str = ""  # A call before it that may find a mistake (negative), which is then the answer

    def arguments(self) -> Iterator[tuple[str, str, str]]:
        """Name, kind (empty for a whole number) and shape (empty but for arrays) of each argument."""
        for word in self.takes.split():
            found = _ARGUMENT.fullmatch(word)
            if found is None or not {found[2]} <= {None, OBJECT, *KINDS, *NUMBERS}:
                raise ValueError(f"{word!r} in {self.takes!r} is no argument of an entry point")
            yield found[1], found[2] or "", found[3] or ""

    @property
    def handed_on(self) -> str:
        """All arguments but sizes of arrays, for a call."""
        taken = list(self.arguments())
        sizes = {size for _, _, shape in taken for size in re.findall(r"(?<![\w.])[a-z]\w*(?![\w.])", shape)}
        return ", ".join(name for name, kind, _ in taken if kind or name not in sizes)

    @property
    def signature(self) -> str:
        """A letter an argument, as an ``EntryPoint`` has them."""
        return "".join("o" if kind == OBJECT else "i" for _, kind, _ in self.arguments())

    def function(self, name: str, joints: int = JOINTS) -> Callable[..., int]:
        """The Python function, for records with room for so many joints."""
        from ftqp.kernel.jit import carray, pointer  # numba, where the kernel is built
        from ftqp.kernel.layout import enums, flat_arrays, other_records

        module = import_module(self.module)
        numbers = vars(other_records) | vars(flat_arrays) | vars(enums)  # beside the module
        words = {**numbers, **vars(module), "carray": carray, "pointer": pointer, **NUMBERS}
        words["words"] = dtype("record", joints).itemsize // 8
        taken, records, arrays = [], [], []
        for argument, kind, shape in self.arguments():
            taken.append(f"{argument}_at" if kind not in ("", OBJECT) else argument)
            if shape:
                arrays.append(f"{argument} = carray(pointer({argument}_at), ({shape},), {kind})")
            elif kind in KINDS:
                words[f"_{kind}"] = dtype(kind, joints)
                records.append(f"{argument} = carray(pointer({argument}_at), 1, _{kind})[0]")
        call = self.call if "(" in self.call else f"{self.call}({self.handed_on})"
        formula = getattr(module, call.partition("(")[0])
        result = getattr(formula, "py_func", formula).__annotations__.get("return")
        body = [*records, *arrays]
        if self.first:
            body += [f"code = {self.first}", "if code < 0:", "    return code"]
        if result is None:
            body += [call, "return 0"]
        else:
            body.append(f"return 1 if {call} else 0" if result is bool else f"return {call}")
        text = "\n    ".join([f"def _entry({', '.join(taken)}):", *body])
        exec(compile(text, f"<entry point {name}>", "exec"), words)
        made: Callable[..., int] = words["_entry"]
        made.__name__ = made.__qualname__ = name
        return made


LEADERS: Final = {
    "clock": ("", "", "target:object row", "accept(K, q, v, target, row)", "prepare(K)", "settle(K, "),
    "path": (
        " path:path", " table:f8[rows,COLUMNS] rows", "", "accept_on_path(K, path, table, q, v)",
        "prepare_on_path(K, path)", "settle_on_path(K, path, ",
    ),
    "base": (
        " base:base", "", "target:object row", "accept(K, q, v, target, row)", "prepare_on_base(K, base)",
        "settle_on_base(K, base, ",
    ),
}  # fmt: skip
"""Who leads a tick: the record and the array that are taken for it, what else, what accepts that, and what
prepares and settles the tick."""
SOLVERS: Final = {
    "step": ("", "run_cascade(K, {}, SOLVED)"),
    "prepare": (" flat_at", "hand_over(K, {}, flat_at)"),
    "network": (" memory:f8[numbers] numbers", "solve_by_network(K, memory, K.qp.warm, {})"),
}
"""Who solves its QP: what is taken for that, and the call with a prepared tick."""


def _ticks() -> Iterator[str]:
    """The entry points of every leader with every solver."""
    for leader, (record, table, target, accept, prepared, settled) in LEADERS.items():
        for solver, (memory, solved) in SOLVERS.items():
            usual = (solver, leader) == ("step", "clock")
            yield f"""{"step ticks.steps first" if usual else f"{solver}_{leader} ticks.steps"}
    takes K:record{memory}{record}{table} q:object v:object {target}
    after {accept}
    calls {settled}{solved.format(prepared)})
"""
        yield f"""finish_{leader} ticks.steps
    takes K:record{record} solution_at claim iterations
    calls {settled}take_back(K, solution_at, claim, iterations))
"""


TEXT: Final = f"""
{"".join(_ticks())}write_target ticks.accepted_inputs first alone
    takes target_at pose:object twist:object acceleration:object
step_free ticks.steps takes K:record F:free q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls settle_beside_free(K, run_cascade(K, prepare_free(K, F), SOLVED))
step_joints ticks.steps demo takes K:record joints:joints q:object v:object
    after accept_on_joints(K.state, K.task, K.gate, K.chain, q, v)
    calls step_on_joints(K, joints)
closed_form_clock ticks.steps takes K:record P:reduced q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls resolve(K, P, prepare(K))
closed_form_base ticks.steps takes K:record P:reduced base:base q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls settle_on_base(K, base, resolve(K, P, prepare_on_base(K, base)))
resolve_reduced closed_forms.closed_form_tick takes P:reduced
kappa closed_forms.closed_form_tick takes P:reduced
    calls damp_reduced
kinematics ticks.arm_states first takes K:arm nq
inverse_dynamics ticks.arm_states first takes K:arm nq
torques ticks.arm_states first c takes K:record
keep_step ticks.kept_row first
    takes K:record rows:f8[count,width] count width first rest k code
servo_torques ticks.arm_states first takes K:arm S:servo q:object v:object limit:object
pair_distances scene.clearance demo nogil
    takes K:record q:f8[samples,K.chain.n] out:f8[samples,K.scene.pairs] samples
    calls measure_all
rollout entry.rollout nogil
    takes model:i8[words] used:i8[runs,2] runs what:i8[GIVEN_WORDS] B:batch A:arm
          rows:f8[samples,A.chain.n*(A.chain.n+3)] samples out:reserve own:i8[words] K:record
          mine:i8[GIVEN_WORDS] G:given work:i8[WORK_WORDS] F:free first last
begin_arms entry.kept_arms nogil
    takes model:i8[words] used:i8[runs,2] runs what:i8[GIVEN_WORDS] records_at givens_at works_at
          mask:i1[count] q:f8[count,n] v:f8[count,n] found:i8[count,n] count n first last
tell_arms entry.kept_arms nogil
    takes records_at givens_at A:arm fault:fault mask:i1[count] news:i1[count] goes_on:i1[count] count weak
          rows:f8[samples,A.chain.n*(A.chain.n+3)] samples out:reserve found:i8[count,A.chain.n]
step_arms entry.kept_arms nogil
    takes records_at givens_at works_at mask:i1[count] targets:f8[count,TARGET_SIZE] q:f8[count,n]
          v:f8[count,n] sent:f8[count,2,n] found:i8[count,n] status:i8[count] error:f8[count,2]
          count n ticks first last
poses entry.kept_arms nogil takes A:arm q:f8[count,A.chain.n] out:f8[count,16] count
write_together commands.stops first alone takes table:i8[rows,3] rows
follow_plan rows.plan_posture takes K:record P:plan
believe commands.believed first c takes K:record G:given fault:fault goes_on
    calls believe(K.faults, K.limits, G, fault, goes_on)
respond commands.believed first c takes K:record G:given joint
forget_finding commands.believed first c takes K:record joint
believed commands.believed first c takes K:record G:given
    calls begin_to_believe
sample_reserve commands.believed first c takes A:arm rows:f8[samples,A.chain.n*(A.chain.n+3)] samples
    calls sample
reserve_shares commands.believed first
    takes rows:f8[samples,n*(n+3)] samples n a_max:f8[n] tau_max:f8[n] out:reserve
    calls reserve(rows, n, a_max, tau_max, out)
count_on commands.believed first c
    takes K:record G:given rows:f8[samples,K.chain.n*(K.chain.n+3)] samples out:reserve
hold_up commands.stops first c takes K:record A:arm joint
ask_for_brake latches.settling c takes K:record joint
    calls ask_for_brake(K.watch, K.feedback, joint)
start commands.stops first c takes K:record G:given q:f8[K.chain.n] v:f8[K.chain.n]
stop commands.stops first c takes K:record reason
    calls stop(K.watch, reason)
resume commands.stops first c takes K:record
    calls resume(K.watch, K.feedback, K.chain)
begins_anew commands.going first takes K:record W:going
aim_going search.on_the_way first takes K:record W:going asks
is_on_way search.on_the_way first takes W:going S:ways
lead_going search.on_the_way first takes K:record A:arm W:going J:joints S:ways copies:i8[rows,3] rows
    calls lead_going(K, A, W, J, S, copies)
follow_going search.on_the_way first takes K:record W:going S:ways code
begin_going search.on_the_way c takes K:record G:given W:going J:joints S:ways seeks q:f8[K.chain.n]
begin_going_to_pose search.on_the_way c takes K:record G:given W:going J:joints S:ways goal:f8[16]
begin_way_out ticks.way_trials c
    takes K:record G:given W:going J:joints S:ways copies:i8[copied,3] copied O:way_out
          came:f8[rows,K.chain.n] rows count home:f8[K.chain.n] kind fewer
    calls begin_way_out(K, G, W, J, S, copies, O, came, count, home, kind, fewer)
try_way_out ticks.way_trials nogil c
    takes K:record G:given A:arm W:going J:joints S:ways copies:i8[copied,3] copied O:way_out looks
    calls try_way_out(K, G, A, W, J, S, copies, O, looks)
begin_way ticks.way_trials c takes K:record G:given W:going J:joints S:ways O:way_out
remember ticks.way_trials c takes K:record came:f8[rows,K.chain.n] rows facts:i8[3] code
    calls remember(K, came, facts, code)
carry commands.believed first c takes K:record A:arm G:given payload:load
hold commands.surroundings first c takes K:record G:given place:f8[16]
    calls hold(K.chain, G, place)
aim commands.surroundings c takes K:record G:given task target:f8[TARGET_SIZE]
    calls aim(K.terms, G, task, target)
aim_joints commands.surroundings c takes K:record task q:f8[K.chain.n]
    calls aim_joints(K.terms, task, K.chain.n, q)
move_thing commands.surroundings c takes K:record thing place:f8[16] twist:f8[6]
    calls move_thing(K.scene, thing, place, twist)
give_up latches.settling takes K:record
    calls give_up(K.task, K.terms, K.qp)
begin_path commands.stops c-path takes path:path
    calls begin
miss_tick ticks.accepted_inputs
    takes K:record target:object row left q:f8[K.chain.n] later:f8[TARGET_SIZE] out:f8[TARGET_SIZE]
listen ticks.listening takes K:record q:f8[K.chain.n] reference:f8[3,K.chain.n] tau:f8[K.chain.n]
solve_qp entry.standalone_entries alone takes Q:standalone
    calls solve_standalone
solve_networks entry.standalone_entries nogil alone
    takes problems:f8[many,n*n+n+(m+p)*n+2*(n+m+p)] many solutions:f8[count,2*n+m+p] count found:f8[count,3]
          memory:f8[memory_size] memory_size numbers:f8[OPTIONS] trace:f8[trace_rows,4] trace_rows n m p
          warm first last
    calls solve_networks(problems, solutions, found, memory, numbers, trace, n, m, p, warm, first, last)
study_values entry.study_entries nogil
    takes S:study count q:f8[count,S.chain.n] e:f8[count,S.study.m] A:f8[count,S.study.m,S.chain.n]
          D:f8[count,S.study.m,S.chain.n] H:f8[count*rates,S.chain.n,S.study.m,S.chain.n] rates
    calls values_at
study_clearances entry.study_entries nogil takes S:study count q:f8[count,S.chain.n] out:f8[count]
    calls clearances_at
study_solutions entry.study_entries demo nogil
    takes S:study count q:f8[count,S.chain.n] many goals:f8[many,GOAL_SIZE] left:f8[count,2] bounded near
    calls solutions_from
study_curve entry.study_entries nogil
    takes S:study q:f8[S.chain.n] path:f8[size,S.chain.n] size parts:f8[size]
    calls curve_through
study_self_motions entry.study_entries nogil
    takes S:study k starts quiet c p goals:f8[k,GOAL_SIZE] start:f8[starts,S.chain.n] q:f8[k,c,p,S.chain.n]
          counts:i8[k] facts:f8[k,c,4] windings:i8[k,c,S.chain.n] path:f8[size,S.chain.n] size
          parts:f8[size] firsts:i8[c+1] first last
    calls self_motions_of(S, goals, start, quiet, q, counts, facts, windings, path, parts, firsts, p, first,
          last)
study_runs study.law_runs nogil
    takes S:study L:law count most starts:f8[count,S.chain.n] locked:i8[count] endings:i8[count]
          ends:f8[count,S.chain.n] facts:f8[count,3] trace:f8[most,S.chain.n+3] first last
    calls drive(S, L, starts, locked, first, last, endings, ends, facts, trace)
study_lines study.law_lines nogil
    takes S:study L:law count parts keep starts:f8[count,S.chain.n]
          box:f8[S.chain.n,L.intervals,2] turns:i8[S.chain.n] inside:f8[count,S.chain.n+1]
          failed:i8[count] q:f8[count*keep,parts+1,S.chain.n] within:i1[count*keep,parts+1,S.chain.n+1]
          first last
    calls lines(S, L, starts, parts, box, turns, inside, failed, q, within, first, last)
continuations entry.study_entries nogil
    takes S:study C:continuation k samples keep bounded goals:f8[samples,GOAL_SIZE] q:f8[k,S.chain.n] at:i8[k]
          failed:i8[k,FAILED_JOINTS] speed:f8[k,FAILED_JOINTS] facts:f8[k,FACTS] path:f8[samples,S.chain.n]
          first last
    calls continuations(S, C, goals, q, at, failed, speed, facts, path, keep, bounded, first, last)
self_speed_tracks entry.study_entries nogil
    takes S:study C:continuation k samples goals:f8[samples,GOAL_SIZE] speeds:f8[k,samples-1]
          q:f8[k,samples,S.chain.n] facts:f8[k,2] first last
begin_asked search.asking demo nogil takes W:ways K:record q:f8[W.chain.n] seed
aim_at search.asking demo nogil takes W:ways goal:f8[16]
add_goal search.trees demo nogil takes W:ways q:f8[W.chain.n]
find_posture search.trees demo nogil c takes W:ways looks
explore search.trees demo nogil takes W:ways looks
lead_to search.trees demo nogil takes W:ways node
follow_path search.trees demo nogil takes W:ways looks
search_step search.motion demo nogil takes W:ways looks
deployed_step ticks.steps c
    takes K:record G:given F:free q:f8[K.chain.n] v:f8[K.chain.n] target:f8[TARGET_SIZE] ticks
          work:f8[TARGET_SIZE+2*K.chain.n]
deployed_seek search.asking c takes W:ways K:record G:given goal:f8[16]
    calls seek
deployed_go ticks.steps c
    takes K:record A:arm W:going J:joints S:ways copies:i8[rows,3] rows q:f8[K.chain.n] v:f8[K.chain.n]
    calls deployed_go(K, A, W, J, S, copies, q, v)
deployed_follow ticks.steps c-path
    takes K:record G:given F:free path:path table:f8[rows,COLUMNS] rows q:f8[K.chain.n] v:f8[K.chain.n]
          ticks work:f8[TARGET_SIZE+2*K.chain.n]
"""
"""An entry point: its name, the module of ``ftqp.kernel`` where the names in its calls are found, and words:
``first`` and ``demo`` (what the demo needs), ``alone`` (it knows no robot), ``nogil``, and ``c``,
``c-path`` (``ftqp build`` puts it into a library, always, with a path). Then
what it takes, the call that may find a mistake in that, and the call whose answer is its own: where only a
name is said, or nothing, which is its own name, that is called with all that is taken but sizes of arrays."""


def _read(text: str) -> dict[str, tuple[Spec, list[str]]]:
    """The specification of every entry point, and the words that it has, by name."""
    found: dict[str, tuple[Spec, list[str]]] = {}
    for block in re.split(r"\n(?=\w)", text.strip()):
        head, *said = re.split(r" (takes|after|calls) ", " ".join(block.split()))
        name, module, *words = head.split()
        given = dict(zip(said[::2], said[1::2], strict=True))
        call = given.get("calls", name)
        spec = Spec(f"ftqp.kernel.{module}", given["takes"], call, given.get("after", ""))
        found[name] = spec, words
    return found


_READ: Final = _read(TEXT)


def __getattr__(name: str) -> Any:
    """What makes the function of an entry point for so many joints, by its name."""
    if name not in _READ:
        raise AttributeError(f"there is no entry point {name!r}")

    def factory(joints: int = JOINTS) -> Callable[..., int]:
        return _READ[name][0].function(name, joints)

    return factory


ENTRIES: Final = {
    name: EntryPoint(
        name=name,
        module=__name__,
        factory=name,
        signature=spec.signature,
        nogil="nogil" in words,
        alone="alone" in words,
    )
    for name, (spec, words) in _READ.items()
}
"""By name."""


def _having(*words: str) -> tuple[EntryPoint, ...]:
    """The entry points that Python calls and that have one of some words, all without one."""
    return tuple(
        ENTRIES[name]
        for name, (_, has) in _READ.items()
        if (not words or set(words) & set(has)) and not name.startswith("deployed")
    )


def _from_c(word: str) -> tuple[EntryPoint, ...]:
    return tuple(replace(ENTRIES[name], caller="c") for name, (_, has) in _READ.items() if word in has)


PARTS: Final = {"first": _having("first"), "demo": _having("first", "demo"), "all": _having()}
"""What may be built by itself: what the demo's first
picture and a planner of a small arm need that is given targets; what the demo needs; everything."""
DEPLOYED: Final = _from_c("c")
"""The ways in from C: what ``ftqp build`` puts into a library."""
FOLLOWING: Final = _from_c("c-path")
"""The ways in along a path from C, for libraries that are built with one."""
