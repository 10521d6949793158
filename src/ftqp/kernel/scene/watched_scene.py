"""Whether what stands around the arm is watched at all: what nobody looks at stops the arm."""

from typing import Any

import numpy as np

from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.latches.stop_latch import latch
from ftqp.kernel.layout.enums import STOPPED_BY_SCENE

VERSION_IS = np.dtype(np.int64)


@jit
def is_watched(scene: Any) -> bool:
    """Whether the pairs are those of the scene as it is now, and there are some where anything stands."""
    if scene.version_at != 0:
        now = carray(pointer(scene.version_at), (1,), VERSION_IS)
        if now[0] != scene.version:
            return False
    return bool(scene.pairs > 0 or scene.things == 0)


@jit
def stop_unwatched(scene: Any, watch: Any) -> None:
    """Stop an arm beside a scene that is not watched."""
    if watch.latched == 0 and not is_watched(scene):
        latch(watch, STOPPED_BY_SCENE)
