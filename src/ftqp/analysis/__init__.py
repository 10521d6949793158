"""Studies of an arm before it moves."""

from ftqp.analysis.circular_intervals import CircularIntervals as CircularIntervals
from ftqp.analysis.effectiveness import Effectiveness as Effectiveness
from ftqp.analysis.falling import fall_energy as fall_energy
from ftqp.analysis.learned_law import LearnedLaw as LearnedLaw
from ftqp.analysis.learned_law import LearnedRun as LearnedRun
from ftqp.analysis.learned_law import learned_run as learned_run
from ftqp.analysis.manifolds.joint_ranges import joint_ranges as joint_ranges
from ftqp.analysis.manifolds.manifold import Manifold as Manifold
from ftqp.analysis.manifolds.reachability import reachable_after as reachable_after
from ftqp.analysis.manifolds.self_motion import self_motion as self_motion
from ftqp.analysis.map_chunks import WorkspaceTask as WorkspaceTask
from ftqp.analysis.map_chunks import map_chunk as map_chunk
from ftqp.analysis.map_chunks import points as points
from ftqp.analysis.map_chunks import workspace_task as workspace_task
from ftqp.analysis.outcomes.after_failure import Outcome as Outcome
from ftqp.analysis.outcomes.after_failure import outcome as outcome
from ftqp.analysis.outcomes.basin_map import Basins as Basins
from ftqp.analysis.outcomes.basin_map import basins as basins
from ftqp.analysis.outcomes.real_time_law import PointToPoint as PointToPoint
from ftqp.analysis.outcomes.real_time_law import point_to_point as point_to_point
from ftqp.analysis.outcomes.real_time_law import qp_rates as qp_rates
from ftqp.analysis.workspace_map import WorkspaceReport as WorkspaceReport
from ftqp.analysis.workspace_map import workspace as workspace
