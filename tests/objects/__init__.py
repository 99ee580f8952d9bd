"""Everything that is tested, in one list: algebras, groupoids, retractions, scenes and rules.

A law is written once and runs over all objects here in every stratum. An object that is added is
held to every law by being listed in the file of its kind.
"""

from tests.objects.algebras import ALGEBRAS
from tests.objects.groupoids import (
    GROUPOIDS,
    LARGE,
    affine_action,
    affine_group,
    compose,
    cross,
    frame,
    framed_plane,
    rotate_back,
)  # fmt: skip
from tests.objects.retractions import RETRACTIONS, fits
from tests.objects.rules import PLAIN, RULES, two_thirds
from tests.objects.scenes import ALIKE, BUILT_IN, OWN_SCENES, SCENES, exact_parameters, exact_start
from tests.objects.schedule import ALWAYS, EXPENSIVE, TURN, named
from tests.objects.schemes import (
    BUILT_IN_SCHEMES,
    SCHEMES,
    flow,
    scheme,
    scheme_of,
    with_wrong_force,
)
from tests.objects.strata import ARROWS, STEPS, arrows

__all__ = [
    "ALGEBRAS", "ALIKE", "ALWAYS", "ARROWS", "BUILT_IN", "BUILT_IN_SCHEMES", "EXPENSIVE",
    "GROUPOIDS", "LARGE", "OWN_SCENES", "PLAIN", "RETRACTIONS", "RULES", "SCENES", "SCHEMES",
    "STEPS", "TURN", "affine_action", "affine_group", "arrows", "compose", "cross",
    "exact_parameters", "exact_start", "fits", "flow", "frame", "framed_plane", "named",
    "rotate_back", "scheme", "scheme_of", "two_thirds", "with_wrong_force",
]  # fmt: skip
