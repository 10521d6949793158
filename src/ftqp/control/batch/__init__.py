"""Many arms, or many what-ifs of one: through a trajectory in closed loop, or stepped call by call."""

from ftqp.control.batch.arms_between_calls import Arms as Arms
from ftqp.control.batch.many_arms import Rollout as Rollout
from ftqp.control.batch.many_arms import memory as memory
from ftqp.control.batch.many_arms import rollout as rollout
