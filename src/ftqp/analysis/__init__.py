"""Studies of an arm before it moves."""

from ftqp.analysis.falling import fall_energy as fall_energy
from ftqp.analysis.map_chunks import WorkspaceTask as WorkspaceTask
from ftqp.analysis.map_chunks import map_chunk as map_chunk
from ftqp.analysis.map_chunks import points as points
from ftqp.analysis.map_chunks import workspace_task as workspace_task
from ftqp.analysis.workspace_map import WorkspaceReport as WorkspaceReport
from ftqp.analysis.workspace_map import workspace as workspace
