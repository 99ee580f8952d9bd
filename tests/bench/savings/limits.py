"""The limit of savings."""

from discmech.studies.core.limits import Limit

LIMITS = {
    "same": Limit(
        1e-10, "difference of momenta with and without a saving, relative",
        "set: round-off over the steps that are compared is far below, and what a wrong kernel "
        "makes far above; it errs towards a pass",
    ),
}  # fmt: skip
