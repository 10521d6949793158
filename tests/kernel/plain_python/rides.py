"""Short rides of small arms, one for each way in which a planner can be made, led and studied.

    python tests/kernel/plain_python/rides.py [NAME...]    prints what each commanded, as one JSON object

Run as compiled code and as plain Python they have to command the same.
"""

import json
import sys

import planner_rides as _planner_rides
import study_rides as _study_rides
from riding import RIDES

__all__ = ["RIDES"]
ROOMS = (_planner_rides, _study_rides)
"""The modules whose rides there are."""


def main() -> None:
    """Those that are named, or all."""
    print(json.dumps({name: RIDES[name]() for name in sys.argv[1:] or RIDES}))


if __name__ == "__main__":
    main()
