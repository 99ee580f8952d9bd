"""A scheme as code to take home: one file without dependencies.

`export(scheme, language)` prints the scheme's own kernels, the driver of `stepping` and a harness.
"""

from .exported import exportable
from .writing import LANGUAGES, as_written, export

__all__ = ["LANGUAGES", "as_written", "export", "exportable"]
