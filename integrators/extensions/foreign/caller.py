"""The folder of the calling file, from which relative file names are taken."""

from __future__ import annotations

import sys
from pathlib import Path
from types import FrameType

_OURS = Path(__file__).resolve().parents[2]


def folder_of_caller() -> Path:
    """Return the folder of the file that called into this package, or the current folder."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        path = Path(frame.f_code.co_filename)
        if not path.resolve().is_relative_to(_OURS):
            return path.absolute().parent if path.is_file() else Path.cwd()
        frame = frame.f_back
    return Path.cwd()
