"""The ways in from Python and from C: every entry point, its formula, and what it takes; see ``spec``."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from ftqp.kernel.compiled.library import EntryPoint
from ftqp.kernel.entry.spec import Spec
from ftqp.kernel.layout.enums import JOINTS

TEXT: Final = """
write_target ticks.accepted_inputs first alone
    takes target_at pose:object twist:object acceleration:object
    calls write_target(target_at, pose, twist, acceleration)
step ticks.steps first
    takes K:record q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls run_cascade(K, prepare_plain(K), SOLVED)
step_rich ticks.steps
    takes K:record q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls settle(K, run_cascade(K, prepare_rich(K), SOLVED))
prepare_clock ticks.steps
    takes K:record flat_at q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls settle(K, hand_over(K, prepare_rich(K), flat_at))
network_clock ticks.steps
    takes K:record memory:f8[numbers] numbers q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls settle(K, solve_by_network(K, memory, K.qp.warm, prepare_rich(K)))
finish_clock ticks.steps
    takes K:record solution_at claim iterations
    calls settle(K, take_back(K, solution_at, claim, iterations))
step_path ticks.steps
    takes K:record path:path table:f8[rows,COLUMNS] rows q:object v:object
    after accept_on_path(K, path, table, q, v)
    calls settle_on_path(K, path, run_cascade(K, prepare_on_path(K, path), SOLVED))
prepare_path ticks.steps
    takes K:record flat_at path:path table:f8[rows,COLUMNS] rows q:object v:object
    after accept_on_path(K, path, table, q, v)
    calls settle_on_path(K, path, hand_over(K, prepare_on_path(K, path), flat_at))
network_path ticks.steps
    takes K:record memory:f8[numbers] numbers path:path table:f8[rows,COLUMNS] rows q:object v:object
    after accept_on_path(K, path, table, q, v)
    calls settle_on_path(K, path, solve_by_network(K, memory, K.qp.warm, prepare_on_path(K, path)))
finish_path ticks.steps
    takes K:record path:path solution_at claim iterations
    calls settle_on_path(K, path, take_back(K, solution_at, claim, iterations))
step_base ticks.steps
    takes K:record base:base q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls settle_on_base(K, base, run_cascade(K, prepare_on_base(K, base), SOLVED))
prepare_base ticks.steps
    takes K:record flat_at base:base q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls settle_on_base(K, base, hand_over(K, prepare_on_base(K, base), flat_at))
network_base ticks.steps
    takes K:record memory:f8[numbers] numbers base:base q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls settle_on_base(K, base, solve_by_network(K, memory, K.qp.warm, prepare_on_base(K, base)))
finish_base ticks.steps
    takes K:record base:base solution_at claim iterations
    calls settle_on_base(K, base, take_back(K, solution_at, claim, iterations))
step_free ticks.steps
    takes K:record F:free q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls settle_beside_free(K, run_cascade(K, prepare_free(K, F), SOLVED))
step_joints ticks.steps demo
    takes K:record joints:joints q:object v:object
    after accept_on_joints(K.state, K.task, K.gate, K.chain, q, v)
    calls step_on_joints(K, joints)
closed_form_clock ticks.steps
    takes K:record P:reduced q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls resolve(K, P, prepare_plain(K))
closed_form_base ticks.steps
    takes K:record P:reduced base:base q:object v:object target:object row
    after accept(K, q, v, target, row)
    calls settle_on_base(K, base, resolve(K, P, prepare_on_base(K, base)))
resolve_reduced closed_forms.closed_form_tick
    takes P:reduced
    calls resolve_reduced(P)
kappa closed_forms.closed_form_tick
    takes P:reduced
    calls damp_reduced(P)
kinematics ticks.arm_states first
    takes K:arm nq
    calls kinematics(K, nq)
inverse_dynamics ticks.arm_states first
    takes K:arm nq
    calls inverse_dynamics(K, nq)
torques ticks.arm_states first c
    takes K:record
    calls torques(K)
servo_torques ticks.arm_states first
    takes K:arm S:servo q:object v:object limit:object
    calls servo_torques(K, S, q, v, limit)
pair_distances scene.clearance demo nogil
    takes K:record q:f8[samples,K.chain.n] out:f8[samples,K.scene.pairs] samples
    calls measure_all(K, q, out)
block ticks.block_of_ticks first
    takes K:record tick:object q:object v:object targets:object state:f8[2*K.chain.n] first count
          has_inertia rows:f8[count,width] width places:i8[PLACES]
    calls block(K, tick, q, v, targets, state, first, has_inertia, rows, places)
rollout entry.rollout nogil
    takes model:i8[words] B:batch own:i8[words] K:record F:free n first last
    calls rollout(model, B, own, K, F, n, first, last)
write_together told.stops first alone
    takes table:i8[rows,3] rows
    calls write_together(table)
follow_plan rows.plan_posture
    takes K:record P:plan
    calls follow_plan(K, P)
believe told.believed first c
    takes K:record G:given fault:fault goes_on
    calls believe(K.faults, K.limits, G, fault, goes_on)
believed told.believed first c
    takes K:record G:given
    calls begin_to_believe(K, G)
sample_reserve told.believed first c
    takes A:arm rows:f8[samples,A.chain.n*(A.chain.n+3)] samples
    calls sample(A, rows)
reserve_shares told.believed first
    takes rows:f8[samples,n*(n+3)] samples n a_max:f8[n] tau_max:f8[n] out:reserve
    calls reserve(rows, n, a_max, tau_max, out)
count_on told.believed first c
    takes K:record G:given rows:f8[samples,K.chain.n*(K.chain.n+3)] samples out:reserve
    calls count_on(K, G, rows, out)
hold_up told.stops first c
    takes K:record A:arm joint
    calls hold_up(K, A, joint)
ask_for_brake told.stops
    takes K:record joint
    calls ask_for_brake(K.watch, K.feedback, joint)
start told.stops first c
    takes K:record G:given q:f8[K.chain.n] v:f8[K.chain.n]
    calls start(K, G, q, v)
stop told.stops first c
    takes K:record reason
    calls stop(K.watch, reason)
resume told.stops first c
    takes K:record
    calls resume(K.watch, K.feedback, K.chain)
carry told.believed first c
    takes K:record A:arm G:given payload:load
    calls carry(K, A, G, payload)
give_up latches.settling
    takes K:record
    calls give_up(K.task, K.terms, K.qp)
begin_path told.stops c-path
    takes path:path
    calls begin(path)
miss_tick ticks.accepted_inputs
    takes K:record target:object row left q:f8[K.chain.n] later:f8[TARGET_SIZE] out:f8[TARGET_SIZE]
    calls miss_tick(K, target, row, left, q, later, out)
detect entry.detect_entries first
    takes D:detector A:arm q:object tau:object q_ref:object v_ref:object a_ref:object effort:object
    after accept(D, q, tau, q_ref, v_ref, a_ref, effort)
    calls detect_tick(D, A)
watch entry.detect_entries first c-detector
    takes K:record D:detector A:arm tau:f8[D.n*(tau_at!=0)]
    calls watch(K, D, A, tau)
tell_detector detection.told_detector first c-detector
    takes D:detector joint what
    calls tell(D, joint, what)
detect_log entry.detect_entries nogil
    takes D:detector A:arm q:f8[rows,D.n] tau:f8[rows*(tau_at!=0),D.n] q_ref:f8[rows,D.n] v_ref:f8[rows,D.n]
          a_ref:f8[rows,D.n] effort:f8[rows*(effort_at!=0),D.n] rows first last block
          peaks:f8[rows//block,RESIDUALS,len(D.q)] trace:f8[rows] until
    calls detect_log(D, A, q, tau, q_ref, v_ref, a_ref, effort, first, last, block, peaks, trace, until)
solve_qp entry.standalone_entries alone
    takes Q:standalone
    calls solve_standalone(Q)
kkt entry.standalone_entries alone
    takes problem:f8[n*n+n+(m+p)*n+2*(n+m+p)] solution:f8[2*n+m+p] out:f8[4] n m p
    calls kkt(problem, solution, out, n, m, p)
solve_network entry.standalone_entries alone
    takes problem:f8[n*n+n+(m+p)*n+2*(n+m+p)] solution:f8[2*n+m+p] memory:f8[memory_size] memory_size
          numbers:f8[OPTIONS+2] trace:f8[trace_rows,4] trace_rows n m p warm
    calls solve_network(problem, solution, memory, numbers, trace, n, m, p, warm)
solve_network_batch entry.standalone_entries nogil alone
    takes n m p count H:f8[many_H,n,n] many_H g:f8[many_g,n] many_g A:f8[many_A,m,n] many_A b:f8[many_b,m]
          many_b C:f8[many_C,p,n] many_C l:f8[many_l,p] many_l u:f8[many_u,p] many_u lb:f8[many_lb,n]
          many_lb ub:f8[many_ub,n] many_ub numbers:f8[OPTIONS] x:f8[count,n] y:f8[count,m] z:f8[count,p]
          z_box:f8[count,n] code:i8[count] iterations:i8[count] size:f8[count] memory:f8[memory_size]
          memory_size first last
    calls solve_network_batch(n, m, p, H, g, A, b, C, l, u, lb, ub, numbers, x, y, z, z_box, code,
          iterations, size, memory, first, last)
study_values entry.study_entries nogil
    takes S:study count q:f8[count,S.chain.n] e:f8[count,S.study.m] A:f8[count,S.study.m,S.chain.n]
          D:f8[count,S.study.m,S.chain.n] H:f8[count*rates,S.chain.n,S.study.m,S.chain.n] rates
    calls values_at(S, q, e, A, D, H)
study_clearances entry.study_entries nogil
    takes S:study count q:f8[count,S.chain.n] out:f8[count]
    calls clearances_at(S, q, out)
study_solutions entry.study_entries demo nogil
    takes S:study count q:f8[count,S.chain.n] many goals:f8[many,GOAL_SIZE] left:f8[count,2] bounded near
    calls solutions_from(S, q, goals, left, bounded, near)
study_curve entry.study_entries nogil
    takes S:study q:f8[S.chain.n] path:f8[size,S.chain.n] size parts:f8[size]
    calls curve_through(S, q, path, parts)
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
          boxes:f8[L.boxes,S.chain.n,L.intervals,2] turns:i8[S.chain.n] inside:f8[count,S.chain.n+1]
          failed:i8[count] q:f8[count*keep,parts+1,S.chain.n] within:i1[count*keep,parts+1,S.chain.n+1]
          first last
    calls lines(S, L, starts, parts, boxes, turns, inside, failed, q, within, first, last)
exact_continuations entry.study_entries nogil
    takes S:study C:continuation k samples keep goals:f8[samples,GOAL_SIZE] q:f8[k,S.chain.n] at:i8[k]
          failed:i8[k,FAILED_JOINTS] speed:f8[k,FAILED_JOINTS] facts:f8[k,FACTS] path:f8[samples,S.chain.n]
          first last
    calls exact_continuations(S, C, goals, q, at, failed, speed, facts, path, keep, first, last)
bounded_continuations entry.study_entries nogil
    takes S:study C:continuation k samples keep goals:f8[samples,GOAL_SIZE] q:f8[k,S.chain.n] at:i8[k]
          failed:i8[k,FAILED_JOINTS] speed:f8[k,FAILED_JOINTS] facts:f8[k,FACTS] path:f8[samples,S.chain.n]
          first last
    calls bounded_continuations(S, C, goals, q, at, failed, speed, facts, path, keep, first, last)
self_speed_tracks entry.study_entries nogil
    takes S:study C:continuation k samples goals:f8[samples,GOAL_SIZE] speeds:f8[k,samples-1]
          q:f8[k,samples,S.chain.n] facts:f8[k,2] first last
    calls self_speed_tracks(S, C, goals, speeds, q, facts, first, last)
deployed_step ticks.deployed_step c
    takes K:record G:given F:free q:f8[K.chain.n] v:f8[K.chain.n] target:f8[TARGET_SIZE] ticks
          work:f8[TARGET_SIZE+2*K.chain.n]
    calls deployed_step(K, G, F, q, v, target, ticks, work)
deployed_follow ticks.deployed_step c-path
    takes K:record G:given F:free path:path table:f8[rows,COLUMNS] rows q:f8[K.chain.n] v:f8[K.chain.n]
          ticks work:f8[TARGET_SIZE+2*K.chain.n]
    calls deployed_follow(K, G, F, path, table, q, v, ticks, work)
"""
"""An entry point: its name, the module of ``ftqp.kernel`` where the names in its calls are found, and words:
``first`` and ``demo`` (what the demo needs), ``alone`` (it knows no robot), ``nogil``, and ``c``,
``c-detector``, ``c-path`` (``ftqp build`` puts it into a library, always, with a detector, with a path). Then
what it takes, the call that may find a mistake in that, and the call whose answer is its own."""


def _read(text: str) -> dict[str, tuple[Spec, list[str]]]:
    """The specification of every entry point, and the words that it has, by name."""
    found: dict[str, tuple[Spec, list[str]]] = {}
    for block in re.split(r"\n(?=\w)", text.strip()):
        head, *lines = (" ".join(line.split()) for line in re.split(r"\n    (?=\w)", block))
        name, module, *words = head.split()
        said = dict(line.split(" ", 1) for line in lines)
        spec = Spec(f"ftqp.kernel.{module}", said["takes"], said["calls"], said.get("after", ""))
        found[name] = (spec, words)
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
WATCHING: Final = _from_c("c-detector")
"""The ways in to a detector from C, for libraries that are built with it."""
FOLLOWING: Final = _from_c("c-path")
"""The ways in along a path from C, for libraries that are built with one."""
