"""A run as a ROS 2 bag: what Foxglove, PlotJuggler, RViz and ``ros2 bag play`` show."""

from pathlib import Path

from ftqp.control.planner.status import STATUSES
from ftqp.model.robot import Robot
from ftqp.sim.export.ros_bag import RosBag
from ftqp.sim.export.ticks import Ticks
from ftqp.sim.export.topics import STEP, Topics, facts_of, step_definition
from ftqp.sim.log.log_rows import LogRows
from ftqp.sim.log.table_files import Told, silent
from ftqp.sim.log.whole_files import whole_folder

TEXT = "std_msgs/msg/String"


def write_bag(rows: LogRows, folder: str | Path, robot: Robot | None = None, told: Told = silent) -> int:
    """All ticks of a run in a new bag, a folder with ``metadata.yaml`` and an MCAP file.

    Topics: ``/joint_states`` (what the joints really did), ``/joint_command``, ``/target``, ``/tip``,
    ``/ftqp/step`` and, with a robot, ``/tf`` at every tick; ``/ftqp/status`` where the status changes; with a
    robot ``/robot_description`` once, kept for those who come later. ``/joint_measured`` and
    ``/joint_reference`` are there where the log has them.
    """
    ticks = Ticks(rows)
    sent = 0
    with whole_folder(folder) as part, RosBag(part, {STEP: step_definition()}) as bag:
        topics = Topics(bag, ticks, robot, *facts_of(rows.metadata)).all
        description = None if robot is None else bag.topic("/robot_description", TEXT, latched=True)
        statuses = bag.topic("/ftqp/status", TEXT)
        done, last = 0, None
        for block in rows.blocks():
            now = ticks.of(block)
            times, codes = now.nanoseconds.tolist(), now.scalar("status")[:, 0].tolist()
            if description is not None and robot is not None:
                text = bag.message(TEXT, data=robot.to_urdf())
                bag.write(description, times[0], bag.serialised(text))
                description, sent = None, sent + 1
            messages = [(topic.number, topic.form.filled(topic.data, now)) for topic in topics]
            for k, (time, code) in enumerate(zip(times, codes, strict=True)):
                if code != last:
                    text = bag.message(TEXT, data=_sentence(code))
                    bag.write(statuses, time, bag.serialised(text))
                    last, sent = code, sent + 1
                for number, data in messages:
                    bag.write(number, time, data[k].tobytes())
            done += len(block)
            sent += len(block) * len(topics)
            told(done / rows.count)
    return sent


def _sentence(code: float) -> str:
    """The status of a step in words."""
    known = code in range(len(STATUSES))
    return f"{STATUSES[int(code)].name}: {STATUSES[int(code)].value}" if known else f"status {code:g}"
