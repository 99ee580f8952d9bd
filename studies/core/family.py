"""What is measured of each kind of scene if nothing is chosen: rules of orders 4 to 8, 50 digits.

The built-in rules are of order 1 and 2, except `imex`; beside them, at 50 digits, are rules that
are used for accuracy. Runs are short, for a step costs as much as its order.
"""

from __future__ import annotations

from collections.abc import Iterable

from discmech.integrators import Scene

#: on the pair groupoid, a group, an action and a product, each on its cheapest scene
FAMILY = {
    "pendulum": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "gauss-3", "gauss-4",
                 "kahan-li-8:midpoint"),
    "rigid-body": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "gauss-3",
                   "kahan-li-8:midpoint"),
    "heavy-top": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "kahan-li-8:midpoint"),
    "reduced-kepler": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "gauss-3", "gauss-4",
                       "kahan-li-8:midpoint"),
}  # fmt: skip
DIGITS = 50
#: the forms and momenta of these are judged too; the family's other rules show nothing more there
KEPT = {
    "pendulum": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "kahan-li-8:midpoint"),
    "rigid-body": ("lobatto-3", "triple-jump:midpoint", "kahan-li-8:midpoint"),
    "heavy-top": ("lobatto-3", "triple-jump:midpoint"),
    "reduced-kepler": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "kahan-li-8:midpoint"),
}


def of_each_kind(scenes: Iterable[Scene]) -> frozenset[str]:
    """Return the name of a scene of each kind: of groupoid, and of what the equations contain.

    These the report measures in more digits than a double has. The single steps of every case are
    of 50 digits, so that runs of other scenes of a kind show nothing more in them.
    """
    found: dict[tuple[object, ...], str] = {}
    for scene in sorted(scenes, key=lambda scene: scene.name not in FAMILY):
        parts = (scene.force, scene.fast, scene.one_form, scene.hamiltonian,
                 scene.discrete_lagrangian)  # fmt: skip
        kind = (type(scene.groupoid), *(part is None for part in parts), bool(scene.holonomic),
                bool(scene.nonholonomic), scene.timed, scene.in_numbers)  # fmt: skip
        found.setdefault(kind, scene.name)
    return frozenset(found.values())
