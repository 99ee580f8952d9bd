"""The limits of steps that vary; the energy has those of its own study."""

from ..core.limits import Limit

LIMITS = {
    "order": Limit(
        0.1, "distance of a slope at 50 digits from the order of the base",
        "derived: runs are made until two slopes differ by less than 0.05, so the next powers of ε "
        "are at most a quarter of what they were at the row before",
    ),
    "back": Limit(
        1e-30, "miss of a run and back at 60 digits",
        "derived: half of the digits are left for what 48 steps make of round-off, which is 10⁻⁷⁰",
    ),
    "form": Limit(
        1e-25, "defect of the form of the extended phase space",
        "derived: differences of order 4 over 10⁻¹² are off by 10⁻⁴⁰ where a fifth derivative is "
        "10¹⁵ times a first",
    ),
}  # fmt: skip
