"""Colours of figures, which mean the same in all of them, and their units."""

from math import pi

BLUE, ORANGE, GREEN, RED, PURPLE, SKY, YELLOW = (
    "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442",
)  # fmt: skip
"""Colours that colour-blind readers can tell apart (Okabe and Ito)."""
GREY, WINE = "#7F7F7F", "#882255"
LIMIT = "#C9917D"
FORBIDDEN = "#F4E3DC"
"""Shade of what lies beyond a limit."""
TINT = "#FFF6EC"
"""Background of a joint that fails."""
DEGREES, MILLIMETRES = 180.0 / pi, 1e3
"""In a radian, in a metre."""
