"""Rules of orders 4 to 8 that are added if nothing is chosen: one scene of each kind of groupoid.

The built-in rules are of order 1 and 2, except `imex`; beside them, at 50 digits, are rules that
are used for accuracy. Runs are short, for a step costs as much as its order.
"""

from __future__ import annotations

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
