"""matplotlib's figure, which a notebook shows although pyplot knows nothing of it."""

from __future__ import annotations

from io import BytesIO
from typing import Any

from matplotlib import figure

DOTS = 144  # an inch


class Figure(figure.Figure):
    """A figure of matplotlib that shows itself in a notebook, whatever backend is chosen there."""

    def _repr_png_(self) -> bytes:
        """The picture as PNG."""
        picture: Any = BytesIO()
        self.savefig(picture, format="png", dpi=DOTS)
        return bytes(picture.getvalue())
