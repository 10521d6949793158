"""Status words of controllers and drives: plain numbers in, reports out; no socket, no SDK of a maker.

The words of each maker and what follows from them lie in tables; ``Watch`` applies them to a planner,
``begin_again`` leads an arm on after a stop, and ``Spare`` spares a joint that grows hot.
"""

from ftqp.vendors.beginning_again import Again as Again
from ftqp.vendors.beginning_again import begin_again as begin_again
from ftqp.vendors.heat_share import Spare as Spare
from ftqp.vendors.status_words import Table as Table
from ftqp.vendors.status_words import names as names
from ftqp.vendors.status_words import table as table
from ftqp.vendors.verdict import RecoveryStep as RecoveryStep
from ftqp.vendors.verdict import Verdict as Verdict
from ftqp.vendors.word_watch import Recovery as Recovery
from ftqp.vendors.word_watch import Watch as Watch
