"""The one exception of this package."""

from __future__ import annotations


class ReferenceFailure(ValueError):
    """A reference that cannot be computed: one sentence that names the thing and the mend."""
