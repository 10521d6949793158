"""What the log says of an arm that holds short of its target."""

import logging
from typing import final

from ftqp.control.planner.step import Step
from ftqp.kernel.entry.session import Session

_LOG = logging.getLogger("ftqp")


@final
class Rest:
    """Says when the arm begins and ends to hold, once each.

    Args:
        session: The planner's.

    Attributes:
        held: Whether the arm held when this was last asked.
    """

    def __init__(self, session: Session) -> None:
        self._holding = session.field("calm", "holding")
        self.held = False

    def tell(self, step: Step) -> None:
        """Log a change.

        Args:
            step: The last step.
        """
        held = bool(self._holding[0])
        if held == self.held:
            return
        self.held = held
        if held:
            turned = f" and {step.rotation_error:.3g} rad" if step.rotation_error > 0.0 else ""
            _LOG.info("holding, out of reach by %.3g mm%s", 1e3 * step.position_error, turned)
        else:
            _LOG.info("no longer holding: the target, the working joints or the place of the arm has changed")
