"""The limits of stability."""

from ..core.limits import Limit

LIMITS = {
    "resolved": Limit(
        10.0**-0.3, "hω up to which every rule must be bounded on every stiff scene",
        "set: two radians of the fastest motion in four steps, a cell of both grids; it errs "
        "towards a pass, since sound rules are stable to hω = 2",
    ),
    "exchange": Limit(
        0.1, "error of the exchange of energy at hω = 1/10, over the energy of all springs",
        "set: a run that has the exchange wrong is off by all of it; it errs towards a pass",
    ),
}  # fmt: skip
