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


def vector(package, count=4, **given):
    given = {"failures": package.Failures(share=1.0, between=(0.1, 0.3)), "seconds": 0.8, **given}
    return package.FaultyArmVec(count, **given)


@pytest.mark.long
@pytest.mark.parametrize("after", [0.0, 0.1, np.inf])
@pytest.mark.parametrize("layer", LAYERS)
def test_each_arm_of_the_vector_is_the_environment_by_itself(package, layer, after):
    given = {
        "layer": layer,
        "failures": package.Failures(1.0, after=after, between=(0.1, 0.3)),
        "seconds": 0.8,
    }
    many, alone = vector(package, **given), [package.FaultyArm(physics=False, **given) for _ in range(4)]
    seen, info = many.reset(seed=11)
    for i, one in enumerate(alone):
        np.testing.assert_allclose(seen[i], one.reset(seed=11 + i)[0], rtol=0.0, atol=1e-12)
    draw, over, found = np.random.default_rng(1), [False] * 4, 0
    for _ in range(90):
        actions = draw.uniform(-1, 1, many.action_space.shape).astype(np.float32)
        seen, reward, reached, late, info = many.step(actions)
        for i, one in enumerate(alone):
            if over[i]:
                (own, told), asked, ended = one.reset(), 0.0, (False, False)
            else:
                own, asked, *ended, told = one.step(actions[i])
            over[i] = any(ended)
            np.testing.assert_allclose(seen[i], own, rtol=0.0, atol=1e-9)
            assert abs(reward[i] - asked) < 1e-9 and (reached[i], late[i]) == tuple(ended)
            for name in ("failed", "believed", "status"):
                assert np.array_equal(info[name][i], told[name]), name
            found += bool(told["believed"].any())
    assert found or (layer != "tip" and after == np.inf)


@pytest.mark.parametrize("layer", LAYERS)
def test_the_vector_keeps_to_its_spaces_and_a_seed_repeats_it_bit_by_bit(package, layer):
    def run(env, seed):
        (seen, info), told = env.reset(seed=seed), []
        env.action_space.seed(seed)
        for _ in range(60):
            assert seen in env.observation_space and seen.dtype == np.float64
            told.append((seen.tobytes(), *(info[name].tobytes() for name in sorted(info))))
            seen, reward, reached, late, info = env.step(env.action_space.sample())
            assert reward.dtype == np.float64 and reached.dtype == late.dtype == bool
            assert reward.shape == reached.shape == late.shape == (4,)
        return told

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make_vec("ftqp/FaultyArm-v0", num_envs=4, layer=layer, seconds=0.8)
        assert isinstance(env.unwrapped, package.FaultyArmVec) and env.spec.id == "ftqp/FaultyArm-v0"
        first = run(env, 3)
        run(env, 4)
        env.reset(seed=5, options={"failure": (2, package.LOCKED, 0.0)})
        env.step(env.action_space.sample())
        assert run(env, 3) == first == run(vector(package, failures=None, layer=layer), 3)
        env.close()


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_episodes_of_the_vector_begin_anew_as_gymnasium_has_it(package, mode):
    env = vector(package, seconds=0.2, autoreset_mode=mode)
    assert env.metadata["autoreset_mode"].value == mode
    env.reset(seed=1)
    zero = np.zeros(env.action_space.shape, dtype=np.float32)
    for _ in range(10):
        seen, reward, reached, late, info = env.step(zero)
    assert late.all() and not reached.any()
    if mode == "SameStep":
        assert info["_final_obs"].all() and not info["failed"].any()
        assert info["final_info"]["failed"].any() and (info["final_obs"] != seen).any()
    else:
        assert info["failed"].any() and "final_obs" not in info
    if mode == "Disabled":
        half = np.array([True, False, True, False])
        anew, info = env.reset(options={"reset_mask": half})
        assert (anew[~half] == seen[~half]).all() and (anew[half] != seen[half]).any(axis=1).all()
        assert info["failed"][~half].any() and not info["failed"][half].any()
        _, reward, _, late, _ = env.step(zero)
        assert (reward[~half] == 0.0).all() and (reward[half] < 0.0).all() and not late.any()
        return
    seen, reward, reached, late, info = env.step(zero)
    assert not late.any() and not info["failed"].any()
    assert ((reward == 0.0) if mode == "NextStep" else (reward < 0.0)).all()


def test_an_arm_of_the_vector_reset_in_mid_fault_begins_healthy_and_moves_all_joints(package):
    env = vector(package, seconds=4.0, autoreset_mode="Disabled")
    env.reset(seed=1, options={"failure": (3, package.LOCKED, 0.0)})
    up = np.full(env.action_space.shape, 0.5, dtype=np.float32)
    for _ in range(10):
        _, _, _, _, info = env.step(up)
    assert (info["believed"][:, 3] == package.LOCKED).all()
    one = np.array([True, False, False, False])
    seen, info = env.reset(options={"reset_mask": one, "failure": None})
    assert not info["failed"][0].any() and not info["believed"][0].any() and not env.arms.faults(0)
    before = seen[:, 3]
    for _ in range(10):
        seen, *_ = env.step(up)
    assert seen[0, 3] != before[0] and (seen[1:, 3] == before[1:]).all()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"layer": "wrist"}, "layer is 'wrist', expected one of"),
        ({"period": 0.0}, "expected 0.004 <= period <= seconds"),
        ({"num_envs": 0}, "n is 0, expected a whole number from 1"),
    ],
)
def test_what_is_no_vector_is_refused(package, given, words):
    with pytest.raises(ftqp.InputError, match=words):
        package.FaultyArmVec(**given)


def test_free_joints_and_wrong_masks_are_refused_by_the_vector(package):
    with pytest.raises(ftqp.InputError, match="no joint swings freely in FaultyArmVec"):
        package.FaultyArmVec(2, failures=package.Failures(kinds=(package.FREE,)))
    env = vector(package)
    with pytest.raises(ftqp.InputError, match="no joint swings freely in FaultyArmVec"):
        env.reset(options={"failure": (1, package.FREE, 0.1)})
    with pytest.raises(ftqp.InputError, match=r"reset_mask is int64 of shape \(2,\), expected truth values"):
        env.reset(options={"reset_mask": np.array([0, 1])})


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
