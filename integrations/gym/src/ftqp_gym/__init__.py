"""``ftqp/FaultyArm-v0``: an arm in Gymnasium whose joints fail on the way."""

import gymnasium

from ftqp_gym.faulty_arm import FASTEST as FASTEST
from ftqp_gym.faulty_arm import FREE as FREE
from ftqp_gym.faulty_arm import HEALTHY as HEALTHY
from ftqp_gym.faulty_arm import LOCKED as LOCKED
from ftqp_gym.faulty_arm import SHARE as SHARE
from ftqp_gym.faulty_arm import WEAK as WEAK
from ftqp_gym.faulty_arm import Failures as Failures
from ftqp_gym.faulty_arm import FaultyArm as FaultyArm
from ftqp_gym.faulty_arms import FaultyArmVec as FaultyArmVec

gymnasium.register(
    "ftqp/FaultyArm-v0",
    entry_point="ftqp_gym.faulty_arm:FaultyArm",
    vector_entry_point="ftqp_gym.faulty_arms:FaultyArmVec",
)
