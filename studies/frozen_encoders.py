"""Encoders that work, for hours, and encoders that freeze: which of them are found to repeat oddly.

Joints behind the loop of a torque drive follow references that start, reverse, creep, run and rest, with
dry friction, a lag and unknown loads; their encoders show steps of 1e-6 to 1e-3 rad, or none, with jitter or
without. The kernel's own code looks at every sample. A joint that is looked through gets no feedback, so that
a finding which is wrong has its consequences.

    python studies/frozen_encoders.py                30 hours at 1 kHz, and 2,000 that freeze
    python studies/frozen_encoders.py --hours 300
"""

import argparse
import os
import subprocess
import sys
import time
from functools import partial

SWITCH = "FTQP_BUILD_KERNEL"
DT = 1e-3
STEPS = (0.0, 1e-6, 1e-5, 1e-4, 2e-4, 5e-4, 1e-3, 1e-3)
"""Of the encoders of eight joints [rad]; the first has none."""
STUCK, DRIEST = 0.015, 25.0
"""How far friction lets the reference go on before the feedback moves the joint, at most [rad], and what it
takes from the joint's acceleration, at most [rad/s2]: 0.5 N m on a rotor of 0.02 kg m2."""


def main() -> int:
    """Simulates where helpers of the kernel are compiled: 0 when nothing healthy was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=30.0, help="of healthy motion (default %(default)s)")
    parser.add_argument("--frozen", type=int, default=2000, help="encoders that freeze (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    if os.environ.get(SWITCH) != "1":
        command = [sys.executable, __file__, *sys.argv[1:]]
        return subprocess.run(command, env={**os.environ, SWITCH: "1"}, check=False).returncode
    return _simulate(given)


def _simulate(given: argparse.Namespace) -> int:
    import numpy as np
    from numba import njit

    from ftqp.kernel.feedback.repeats import FROZEN, forget_repeats, look_at_repeats
    from ftqp.kernel.layout.enums import TORQUE_DRIVE
    from ftqp.kernel.layout.record import dtype

    @njit
    def ride(records, joint, quantum, jitter, w, friction, load, ticks, freeze, seed):
        """Ticks with a frozen finding, with one looked through, and until both after ``freeze``; the peak."""
        np.random.seed(seed)
        K = records[0]
        state, feedback = K.state, K.feedback
        state.dt = DT
        feedback.kind, feedback.stiffness = TORQUE_DRIVE, w
        forget_repeats(feedback, joint, 0.0)
        feedback.M[joint, joint], K.limits.tau_max[joint] = 0.005, 12.0  # a light wrist
        q = v = q_r = v_r = a_r = 0.0
        wanted, left, stuck = 0.0, 0, 0.0
        feedback.v_hat[joint] = 0.0
        frozen = held = 0
        first_held = first_frozen = -1
        peak = speed = 0.0
        for k in range(ticks):
            if left == 0:  # a new speed: at rest, creeping, running
                kind = np.random.random()
                size = 10.0 ** np.random.uniform(-4.0, 0.3)
                wanted = 0.0 if kind < 0.3 else (size if np.random.random() < 0.5 else -size)
                left = int(np.random.uniform(50.0, 3000.0))
            left -= 1
            a_r = min(max((wanted - v_r) / 0.01, -10.0), 10.0)
            q_r, v_r = q_r + DT * (v_r + 0.5 * DT * a_r), v_r + DT * a_r
            shown = q + jitter * np.random.standard_normal()
            shown = np.floor(shown / quantum + 0.5) * quantum if quantum > 0.0 else shown
            if freeze > 0 and k >= freeze:
                if k == freeze:
                    stuck = shown
                shown = stuck
            look_at_repeats(K, joint, shown, v_r)
            if feedback.held[joint] == FROZEN:
                frozen += 1
                if first_frozen < 0:
                    first_frozen = k - freeze
            if feedback.held[joint] != 0:
                held += 1
                if first_held < 0:
                    first_held = k - freeze
            back = 0.0
            if feedback.held[joint] == 0:
                back = w * w * (q_r - shown) + 2.0 * w * (v_r - feedback.v_hat[joint])
            back = min(max(back, -100.0), 100.0)
            feedback.v_hat[joint] += 0.3 * (v - feedback.v_hat[joint])
            a = a_r + back + load
            if abs(v) < 1e-9 and abs(a) <= friction:  # it sticks
                v = 0.0
            else:
                sign = np.sign(v) if abs(v) >= 1e-9 else np.sign(a)
                after = v + DT * (a - friction * sign)
                if v != 0.0 and after * v < 0.0:
                    after = 0.0
                q, v = q + 0.5 * DT * (v + after), after
            if freeze > 0 and k >= freeze:
                peak = max(peak, abs(v))
            if k == freeze:
                speed = abs(v_r)
        return frozen, held, first_held, first_frozen, peak, speed

    rng = np.random.default_rng(given.seed)
    records = np.zeros(1, dtype("record", 8))
    begun, ticks = time.perf_counter(), 600_000
    runs = int(np.ceil(given.hours * 3600.0 / (ticks * DT)))
    totals = {step: [0.0, 0, 0] for step in STEPS}
    for k in range(runs):
        step = STEPS[k % len(STEPS)]
        jitter = 0.0 if rng.random() < 0.5 else rng.uniform(0.0, 0.5) * step
        w = rng.uniform(30.0, 80.0)
        friction = min(rng.uniform(0.0, STUCK) * w * w, DRIEST) * (rng.random() < 0.7)
        load, drawn = rng.uniform(-1.0, 1.0), int(rng.integers(2**31))
        found = ride(records, k % 8, step, jitter, w, friction, load, ticks, 0, drawn)
        row = totals[step]
        row[0] += ticks * DT / 3600.0
        row[1] += found[0] > 0
        row[2] += found[1]
    print("step of the encoder [rad]   hours   runs with a frozen sensor   ticks looked through")
    for step, (hours, frozen, held) in totals.items():
        print(f"{step:25g}{hours:8.1f}{frozen:28d}{held:23d}")
    wrong, hours = sum(row[1] for row in totals.values()), sum(row[0] for row in totals.values())
    print(f"{hours:.1f} h in {time.perf_counter() - begun:.0f} s: {wrong} findings")
    _freeze(rng, given.frozen, partial(ride, records, 0))
    return 1 if wrong else 0


def _freeze(rng, count, ride) -> None:
    """Encoders that freeze while their joints move: when they are found, and how fast the joints go."""
    import numpy as np

    seen = []
    while len(seen) < count:
        step = STEPS[int(rng.integers(len(STEPS)))]
        jitter = 0.0 if rng.random() < 0.5 else rng.uniform(0.0, 0.5) * step
        _, _, held, frozen, peak, speed = ride(
            step, jitter, 80.0, 0.0, 0.0, 5100, 5000, int(rng.integers(2**31))
        )
        if speed > 0.1:
            seen.append((held if held >= 0 else np.inf, frozen if frozen >= 0 else np.inf, peak - speed))
    held, frozen, faster = np.array(seen).T
    print(f"{count} that freeze at more than 0.1 rad/s, in 0.1 s:")
    for name, ticks in (("looked through", held), ("found", frozen)):
        share, late = 100.0 * np.mean(np.isfinite(ticks)), np.quantile(ticks, 0.95, method="higher")
        print(f"  {name}: {share:.1f} %, after {np.median(ticks):.0f} ms, 95 in 100 within {late:.0f} ms")
    usual = np.quantile(faster, 0.95)
    print(f"  faster than the reference by {usual:.2g} rad/s in 95 of 100, at most {faster.max():.2g} rad/s")


if __name__ == "__main__":
    sys.exit(main())
