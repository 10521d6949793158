"""``ftqp/FaultyArm-v0``: Gymnasium's own checker, seeds, and what failures do to policies."""

import importlib
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import ftqp

gymnasium = pytest.importorskip("gymnasium", reason='needs the extra "dev": pip install -e ".[dev]"')
FOLDER = Path(__file__).parents[2] / "integrations" / "gym"
LAYERS = ("tip", "joints", "below")


@pytest.fixture(scope="module")
def package():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER / "src"))
        yield importlib.import_module("ftqp_gym")
        gymnasium.registry.pop("ftqp/FaultyArm-v0")
        for name in [one for one in sys.modules if one.startswith("ftqp_gym")]:
            del sys.modules[name]


@pytest.mark.long
@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize("physics", [True, False])
def test_gymnasiums_checker_has_nothing_to_say(package, layer, physics):
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("ftqp/FaultyArm-v0", layer=layer, physics=physics).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=True)


def episode(env, seed, steps=40, **options):
    """All that is seen of an episode with actions of a generator of its own."""
    draw, told = np.random.default_rng(seed), []
    seen, info = env.reset(seed=seed, options=options or None)
    for _ in range(steps):
        told.append(
            (seen.tobytes(), info["left"], info["status"], tuple(info["failed"]), tuple(info["believed"]))
        )
        seen, reward, reached, over, info = env.step(draw.uniform(-1, 1, env.action_space.shape))
        told.append((reward, reached, over))
    return told


@pytest.mark.long
@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize("physics", [True, False])
def test_a_seed_repeats_an_episode_bit_by_bit_whatever_was_before(package, layer, physics):
    given = {"layer": layer, "physics": physics, "failures": package.Failures(share=1.0, between=(0.1, 0.4))}
    env, fresh = package.FaultyArm(**given), package.FaultyArm(**given)
    first = episode(env, 3)
    episode(env, 4, failure=(2, package.LOCKED, 0.1))
    episode(env, 5, steps=3, failure=(5, package.WEAK, 0.0))
    assert episode(env, 3) == first == episode(fresh, 3)
    assert any(sum(one[3]) for one in first[::2])


def test_a_reset_in_mid_fault_begins_with_a_healthy_arm(package):
    env = package.FaultyArm(physics=False)
    episode(env, 1, failure=(3, package.LOCKED, 0.0))
    seen, info = env.reset(seed=2, options={"failure": None})
    assert not info["failed"].any() and not info["believed"].any() and not env.planner.faults
    assert (seen[17:].reshape(7, 4)[:, 0] == 1.0).all()
    before = env.plant.q[3]
    for _ in range(10):
        _, _, _, _, info = env.step(np.ones(3, dtype=np.float32))
    assert env.plant.q[3] != before and not info["failed"].any()


@pytest.mark.parametrize(("after", "told"), [(0.0, 5), (0.1, 10), (np.inf, None)])
def test_what_is_believed_is_what_was_told_and_when(package, after, told):
    env = package.FaultyArm(layer="joints", physics=False, failures=package.Failures(after=after))
    env.reset(seed=0, options={"failure": (2, package.WEAK, 0.1)})
    for k in range(20):
        seen, _, _, _, info = env.step(np.zeros(7, dtype=np.float32))
        assert info["failed"][2] == (package.WEAK if k >= 5 else 0)
        knows = told is not None and k >= told
        assert info["believed"][2] == (package.WEAK if knows else 0)
        assert seen[17:].reshape(7, 4)[2, package.WEAK] == knows


def reached(package, layer, failure):
    """How near a simple policy comes to the point [m]; of joints, by the healthy arm's pseudoinverse."""
    env = package.FaultyArm(layer=layer, physics=False, seconds=6.0)
    left = []
    for seed in range(6):
        seen, info = env.reset(seed=seed, options={"failure": failure})
        over = at = False
        while not (over or at):
            way = np.clip(seen[14:17] / 0.05, -1.0, 1.0)
            if layer != "tip":
                J = env.robot.jacobian(seen[:7])[:3]
                way = np.linalg.pinv(J) @ (0.25 * way) / (0.5 * env.robot.limits.v_max)
            seen, _, at, over, info = env.step(way.astype(np.float32))
        left.append(info["left"])
    return float(np.mean(left))


@pytest.mark.long
def test_a_policy_of_joints_reaches_with_ftqp_below_it_what_it_misses_without(package):
    lock = (1, package.LOCKED, 0.2)
    assert reached(package, "joints", None) < 0.011 and reached(package, "below", None) < 0.011
    alone, below = reached(package, "joints", lock), reached(package, "below", lock)
    assert below < alone
    assert reached(package, "tip", lock) < 0.011


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"layer": "wrist"}, "layer is 'wrist', expected one of tip, joints, below"),
        ({"period": 0.0}, "expected 0.004 <= period <= seconds"),
        ({"seconds": 0.001}, "expected 0.004 <= period <= seconds"),
    ],
)
def test_what_is_no_environment_is_refused(package, given, words):
    with pytest.raises(ftqp.InputError, match=words):
        package.FaultyArm(physics=False, **given)


@pytest.mark.parametrize("failure", [(9, 1, 0.0), (0, 5, 0.0), (0, 1, -1.0), (0, 1, np.nan), 3, (0, 1)])
def test_a_failure_that_cannot_be_is_refused(package, failure):
    env = package.FaultyArm(physics=False)
    with pytest.raises(ftqp.InputError):
        env.reset(options={"failure": failure})


@pytest.mark.parametrize(
    "given", [{"share": 1.5}, {"kinds": ()}, {"kinds": (0,)}, {"after": -1.0}, {"between": (2.0, 1.0)}]
)
def test_failures_that_cannot_be_drawn_are_refused(package, given):
    with pytest.raises(ftqp.InputError):
        package.Failures(**given)
