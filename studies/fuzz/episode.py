"""A fuzzed episode: a planner, some hundred ticks of which most are corrupted, and calls in between."""

import copy
import pickle
import sys
import warnings
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

import ftqp
from ftqp.core.errors import InputError
from fuzz import calls, cases, damage, forms, judging
from fuzz.account import Account, Epoch
from fuzz.world import World, last_line

Array = np.ndarray[Any, Any]
TICKS = 500
CALLED, MISTAKEN, LOOKED_AT = 0.08, 0.05, 0.05
"""Shares of ticks before which something is called, with a mistake in the place of the tick, and after which
what came back is looked at."""
TWINS = 0.12
"""Share of the episodes with a twin, which is handed the same numbers in the plainest form."""
KINDS, POSE_KINDS = tuple(damage.KINDS), tuple(damage.POSE_KINDS)
SEVERE = (0.1, 0.3, 1.0)
"""How often numbers are damaged, beside what is usual: an arm that is stopped at once shows little."""
BUSY = (0.05, 0.05, 0.3, 1.0)
"""How often something is called, mistaken or looked at, beside what is usual."""
FASTEST = 15.0
"""A joint that swings is never faster [rad/s or m/s]."""
PLAIN_FORMS = 0.35
"""Share of arrays that are handed in as they are."""
EXACT, LOSSY = tuple(forms.EXACT), tuple(forms.LOSSY)
MISTAKES = tuple(forms.MISTAKES)
READ = (
    "status", "tau", "tau_brake", "reference", "brakes", "tau_stop", "rows", "impact", "notice",
    "position_error", "rotation_error", "holding", "slack", "scale", "jacobian", "measures", "sigma_min",
    "manipulability", "condition", "kappa", "lower", "upper", "torque_excess", "outside", "limits_active",
    "certificate", "qp",
)  # fmt: skip
"""What can be read of a step."""


@final
@dataclass(slots=True, kw_only=True)
class Outcome:
    """What came of an episode.

    Attributes:
        number: Its number.
        sentence: What it was about.
        steps: How many steps were made.
        corrupted: How many of them had something corrupted: numbers, form, lifetime, or a call before them.
        mistakes: How many calls of ``step`` were mistakes, all of which were refused.
        done: How often each other call was made.
        statuses: How many steps claimed what.
        damages: How many steps were handed each kind of damage.
        wrong: What was not as promised.
    """

    number: int
    sentence: str = ""
    steps: int = 0
    corrupted: int = 0
    mistakes: int = 0
    done: dict[str, int] = field(default_factory=dict)
    statuses: dict[str, int] = field(default_factory=dict)
    damages: dict[str, int] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)


def run(seed: int, number: int, *, ticks: int = TICKS, arms: tuple[str, ...] = cases.ROBOTS) -> Outcome:
    """Draw, run and judge an episode; the same seed and number give the same one."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        return _Run(seed, number, ticks, arms).run()


class _Run:
    """One episode as it runs."""

    def __init__(self, seed: int, number: int, ticks: int, arms: tuple[str, ...]) -> None:
        rng = self.rng = np.random.default_rng([seed, number])
        kept = copy.deepcopy(rng.bit_generator.state)
        case = self.case = cases.drawn(rng, arms)
        self.ticks, n = ticks, case.robot.nv
        twin = None
        if rng.random() < TWINS and not case.watched:
            again = np.random.default_rng(0)
            again.bit_generator.state = kept
            twin = cases.drawn(again, arms).planner
        self.only_position = not set(case.rows) & {"rx", "ry", "rz"} and bool(rng.random() < 0.5)
        self.world = World(case=case, rng=rng, target=None, twin=twin)
        self.account = Account(ticks, n)
        self.outcome = Outcome(number=number, sentence=case.sentence)
        self.gives_v, self.gives_tip, self.gives_tau = (rng.random(3) < (0.6, 0.15, 0.25)).tolist()
        severe, self.busy = float(rng.choice(SEVERE)), float(rng.choice(BUSY))
        hurts = [damage.bursts(rng, ticks, severe * share, KINDS) for share in (0.15, 0.12, 0.1, 0.15)]
        self.hurt = dict(zip(("q", "v", "tau", "twist"), hurts, strict=True))
        self.hurt |= {name: damage.bursts(rng, ticks, severe * 0.15, POSE_KINDS) for name in ("pose", "tip")}
        self.dice = rng.random((8, ticks)).tolist()
        self.first: dict[str, Array] = {}
        self.kept: list[tuple[Any, Array]] = []
        self.told: dict[int, Any] = {}
        self.begin_anew(case.robot.neutral, np.zeros(n))

    def begin_anew(self, q: Array, v: Array, move_target: bool = True) -> None:
        """The planner is said to be at (q, v)."""
        self.past_q, self.past_v = [q.copy()], [v.copy()]  # of the arm
        self.q, self.v = q.copy(), v.copy()  # of the planner's reference
        if move_target:
            T = self.case.robot.pose(q)
            if self.world.target is None:
                self.base = T
                self.world.target = self.new_target(T)
            elif np.isfinite(T).all():
                self.base = T
            way, pace = self.rng.normal(0.0, 0.05, 3), float(self.rng.uniform(0.0, 6.0))
            phase = pace * self.case.dt * np.arange(self.ticks)[:, None]
            self.poses, self.twists = np.tile(self.base, (self.ticks, 1, 1)), np.zeros((self.ticks, 6))
            if self.only_position:
                self.poses[:, :3, :3] = np.eye(3)
            self.poses[:, :3, 3] += np.sin(phase) * way
            self.twists[:, :3] = pace * np.cos(phase) * way

    def new_target(self, T: Array) -> Any:
        """A target of the kind of this episode."""
        return ftqp.Target(position=T[:3, 3]) if self.only_position else ftqp.Target(pose=T)

    def run(self) -> Outcome:
        """Everything."""
        world, outcome = self.world, self.outcome
        world.refused(
            "step before reset", lambda: world.planner.step(self.past_q[0], None, world.target), "reset"
        )
        calls.reset(world)
        for k in range(self.ticks):
            called = self.dice[0][k] < self.busy * CALLED
            if called:
                calls.make(world)
            try:
                self.tick(k, called)
            except Exception as error:  # a step has raised: that is the result, not to be hidden
                world.wrong.append(f"tick {k}: {last_line(error)}")
                break
            if len(world.wrong) > 5:
                break
        for step, q in self.kept:
            self.look_at_kept(step, q)
        outcome.done = world.done
        for name in self.account.status:
            outcome.statuses[name] = outcome.statuses.get(name, 0) + 1
        world.wrong += judging.broken(self.case, self.account, world)
        outcome.wrong = world.wrong
        return outcome

    def hurt_numbers(self, name: str, k: int, x: Array) -> Array:
        """The numbers of a channel at a tick, damaged or not."""
        kind = self.hurt[name][k]
        if kind is None:
            self.first.pop(name, None)
            return x
        first = self.first.setdefault(name, x.copy())
        hurt = damage.POSE_KINDS[kind](x, self.rng, first)
        key = f"{name}: {kind}"
        self.outcome.damages[key] = self.outcome.damages.get(key, 0) + 1
        return hurt

    def formed(self, x: Array, dice: float) -> tuple[Any, Array]:
        """The numbers in some form, and what they then are."""
        if dice < PLAIN_FORMS:
            return x, x
        share = (dice - PLAIN_FORMS) / (1.0 - PLAIN_FORMS)
        if share < 0.03:
            self.lossy = True
            given = forms.LOSSY[LOSSY[int(share / 0.03 * len(LOSSY))]](x)
            return given, np.asarray(given, dtype=np.float64)
        return forms.EXACT[EXACT[int((share - 0.03) / 0.97 * len(EXACT))]](x), x

    def put_target(self, k: int) -> tuple[Array, bool]:
        """Move the target, damaged or not: its pose as it then is, and whether it is one."""
        T, twist = self.poses[k], self.twists[k]
        target, way = self.world.target, self.dice[1][k]
        hurt = self.hurt["pose"][k] is not None or self.hurt["twist"][k] is not None
        if hurt:
            T = self.hurt_numbers("pose", k, T.ravel()).reshape(4, 4)
            twist = self.hurt_numbers("twist", k, twist)
        where = T[:3, 3] if self.only_position else T
        if way < 0.7:
            target.at(where, twist)
        elif way < 0.85:
            place = target.position if self.only_position else target.pose
            place[...] = where
            target.twist[:] = twist
        elif way < 0.95:
            setattr(target, "position" if self.only_position else "pose", where.tolist())
            target.twist = twist.tolist()
        else:
            target.at(np.asfortranarray(where), list(twist))
        if self.only_position and hurt:
            T = np.eye(4)
            T[:3, 3] = where
        return T, not hurt or self.is_pose(T, twist)

    def is_pose(self, T: Array, twist: Array) -> bool:
        """Whether a target is finite and its rotation is one, to what no rounding makes."""
        R = T[:3, :3]
        if not (np.isfinite(T).all() and np.isfinite(twist).all()):
            return False
        return bool(np.abs(R @ R.T - np.eye(3)).max() < 1e-5 and np.linalg.det(R) > 0.0)

    def tick(self, k: int, called: bool) -> None:
        """One tick, or a mistake in its place."""
        world, case, dice = self.world, self.case, self.dice
        if world.begins is not None:
            self.begin_anew(*world.begins, move_target=dice[2][k] < 0.7)
        late = min(case.latency, len(self.past_q) - 1)
        self.lossy = False
        true_q, true_v = self.past_q[-1 - late].copy(), self.past_v[-1 - late].copy()
        q = self.hurt_numbers("q", k, true_q)
        v = self.hurt_numbers("v", k, true_v) if self.gives_v else None
        target, sound = self.put_target(k)
        given = {"q": q, "v": v}
        plain = dict(given)
        given["q"], plain["q"] = self.form_of_q(q, dice[3][k])
        if v is not None:
            given["v"], plain["v"] = self.formed(v, dice[4][k])
        if self.gives_tau and dice[5][k] < 0.5:
            given["tau"] = plain["tau"] = self.hurt_numbers(
                "tau", k, self.rng.normal(0.0, 5.0, case.robot.nv)
            )
        if self.gives_tip and dice[5][k] > 0.4:
            flat = self.hurt_numbers("tip", k, case.robot.pose(true_q).ravel())
            given["tip"] = plain["tip"] = flat.reshape(4, 4)
        if dice[6][k] < self.busy * MISTAKEN:
            self.mistake(given)
            if dice[6][k] < 0.5 * self.busy * MISTAKEN:
                return
        self.step(k, called, given, plain, target, sound)

    def form_of_q(self, q: Array, dice: float) -> tuple[Any, Array]:
        """Positions in some form: of joints that turn without end their cosines and sines, too."""
        case = self.case
        if case.robot.nq != case.robot.nv and dice < 0.3:
            pairs = np.stack([np.cos(q), np.sin(q)], axis=1).ravel()
            return pairs, pairs
        return self.formed(q, dice)

    def mistake(self, given: dict[str, Any]) -> None:
        """A call of ``step`` that is a mistake: refused, and nothing has changed."""
        world, rng = self.world, self.rng
        name = ("q", "v", "tau", "tip", "target")[int(rng.integers(5))]
        kind = MISTAKES[int(rng.integers(len(MISTAKES)))]
        arguments = {**given, "target": world.target}
        if name == "target":
            arguments[name] = (None, "home", 3, np.eye(4), ftqp.Target, object())[int(rng.integers(6))]
        else:
            arguments[name] = forms.MISTAKES[kind](self.past_q[-1] if name != "tip" else np.eye(4).ravel())
        before = sys.getrefcount(arguments[name])
        world.refused(f"step({name} {kind})", lambda: world.planner.step(**arguments), name)
        if name != "target" and sys.getrefcount(arguments[name]) > before:
            world.wrong.append(f"step({name} {kind}) keeps what it was given")
        self.outcome.mistakes += 1

    def step(
        self, k: int, called: bool, given: dict[str, Any], plain: dict[str, Any], target: Array, sound: bool
    ) -> None:
        """One step, written down."""
        world, account = self.world, self.account
        at, hurt = account.count, self.hurt
        clean = hurt["q"][k] is hurt["v"][k] is hurt["pose"][k] is hurt["twist"][k] is None and not (
            "tau" in given or "tip" in given or self.lossy
        )
        step = world.planner.step(target=world.target, **given)
        if world.twin is not None:
            self.beside_twin(k, step, plain)
        self.new_epoch(at)
        reference = step.reference
        account.q_before[at], account.v_before[at] = self.q, self.v
        account.q[at], account.v[at], account.a[at] = reference.q, reference.v, step.a
        account.sent_q[at], account.sent_v[at] = step.q, step.v
        account.given_q[at] = plain["q"] if len(plain["q"]) == len(step.q) else self.q
        account.target[at] = target
        finite = clean or all(x is None or np.isfinite(x).all() for x in plain.values())
        account.sound[at] = sound and finite
        account.has_tip[at] = "tip" in plain
        account.asked[at] = world.asked_to_stop
        account.status.append(step.status.name)
        account.count = at + 1
        self.q, self.v = account.q[at], account.v[at]
        self.obey(account.a[at])
        self.outcome.steps += 1
        formed = given["q"] is not plain["q"] or given["v"] is not plain["v"]
        self.outcome.corrupted += bool(not clean or formed or called)
        if self.dice[7][k] < self.busy * LOOKED_AT:
            self.look(step, at, given)

    def obey(self, a: Array) -> None:
        """The arm does what it is told; a joint that swings falls between its end stops."""
        if not self.world.told:
            self.past_q.append(self.q)
            self.past_v.append(self.v)
            return
        q, v = self.q.copy(), self.v.copy()
        limits, dt = self.case.robot.limits, self.case.dt
        for i, fault in self.world.told.items():
            if isinstance(fault, ftqp.FreeSwinging):
                v[i] = np.clip(self.past_v[-1][i] + dt * a[i], -FASTEST, FASTEST)
                q[i] = np.clip(self.past_q[-1][i] + dt * v[i], limits.q_min[i], limits.q_max[i])
                if not limits.q_min[i] < q[i] < limits.q_max[i]:
                    v[i] = 0.0
            elif isinstance(fault, ftqp.Locked) and v[i] == 0.0:
                q[i], v[i] = self.past_q[-1][i], 0.0
        self.past_q.append(q)
        self.past_v.append(v)

    def new_epoch(self, at: int) -> None:
        """Write down what is believed from this tick on, if it has changed."""
        world = self.world
        if self.case.watched:
            robot = self.case.robot
            told = {robot.joint(name): fault for name, fault in world.planner.faults.items()}
            world.changed = world.changed or told != world.told
            world.told = told
        if at == 0 or world.changed or world.begins is not None:
            told = world.told
            self.account.epochs.append(
                Epoch(
                    first=at,
                    told=dict(told),
                    fresh=frozenset(i for i, fault in told.items() if self.told.get(i) is not fault),
                    healed=frozenset(i for i in self.told if i not in told or told[i].works),
                    again=world.begins is not None,
                )
            )
            self.told = dict(told)
        world.begins, world.changed = None, False

    def beside_twin(self, k: int, step: Any, plain: dict[str, Any]) -> None:
        """The twin is handed the same numbers, and must command the same, bit by bit."""
        other = self.world.twin.step(target=copy.copy(self.world.target), **plain)
        if other.status is not step.status or any(
            getattr(step, name).tobytes() != getattr(other, name).tobytes() for name in ("q", "v", "a")
        ):
            self.world.wrong.append(
                f"tick {k}: a planner that was handed the same numbers commands something else: "
                f"{step.status.name}, {other.status.name}"
            )
            self.world.twin = None

    def look(self, step: Any, at: int, given: dict[str, Any]) -> None:
        """Read, keep, pickle and spoil what came back and what was handed in."""
        way, account = int(self.rng.integers(6)), self.account
        if way == 0:
            for name in READ:
                getattr(step, name)
            repr(step)
        elif way == 1:
            self.kept.append((step.copy(), account.sent_q[at].copy()))
        elif way == 2:
            self.kept.append((pickle.loads(pickle.dumps(step)), account.sent_q[at].copy()))
        elif way == 3:
            self.kept.append((copy.deepcopy(step), account.sent_q[at].copy()))
        elif way == 4:
            self.spoil(step, at, given)
        else:
            tau = step.tau
            if self.case.robot.has_inertia and not np.isfinite(tau).all():
                self.world.wrong.append(f"tick {at}: a torque is not finite: {tau}")

    def spoil(self, step: Any, at: int, given: dict[str, Any]) -> None:
        """Change what was handed in after the call: what came back stays as it is."""
        for value in given.values():
            if isinstance(value, np.ndarray) and value.flags.writeable and value.dtype == np.float64:
                value[...] = np.nan
        if step.q.tobytes() != self.account.sent_q[at].tobytes():
            self.world.wrong.append(f"tick {at}: the command changed with what had been handed in")

    def look_at_kept(self, step: Any, q: Array) -> None:
        """A step that was kept is what it was, and everything of it can be read."""
        if step.q.tobytes() != q.tobytes():
            self.world.wrong.append("a step that was kept has changed")
        for name in READ:
            try:
                getattr(step, name)
            except Exception as error:  # any exception here is wrong
                self.world.wrong.append(f"{name} of a step that was kept {last_line(error)}")


__all__ = ["TICKS", "InputError", "Outcome", "run"]
