"""A matplotlib figure that a notebook shows although pyplot does not know it."""

from __future__ import annotations

import math
from io import BytesIO
from typing import Any

from matplotlib import figure

DOTS = 144  # dots per inch


class Figure(figure.Figure):
    """A matplotlib figure that shows itself in a notebook with any backend.

    room: inches that a line of words beside its axes may take; longer ones are broken. tall: points
    of type that words and numbers ask of the height of its axes.
    """

    room = math.inf
    tall = 0.0

    def _repr_png_(self) -> bytes:
        picture: Any = BytesIO()
        self.savefig(picture, format="png", dpi=DOTS)
        return bytes(picture.getvalue())
