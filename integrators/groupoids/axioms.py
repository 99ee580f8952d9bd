"""The axioms of a Lie groupoid near its identities, as named laws (paper, section 3.2)."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Any

from ..errors import BadInput
from ..numbers import is_zero, random_columns
from ..numbers.types import Column


def axioms(groupoid: Any, point: dict[str, Column]) -> dict[str, Column]:
    """Return expressions that must vanish at a point, by the name of the law.

    The point has columns x, u, v, w and steps h, k. The laws are units, inverses, β(gh) = β(h),
    associativity (paper, section 3.2), and that u is scaled by h.
    """
    g = groupoid
    x, u, v, w, h, k = (point[name] for name in ("x", "u", "v", "w", "h", "k"))
    zero, y, uv = 0 * u, g.target(x, u, h), g.product(x, u, v, h)
    laws = {
        "b(x, 0) = x (the identities are (x, 0))": g.target(x, zero, h) - x,
        "p(x, u, 0) = u (right unit)": g.product(x, u, zero, h) - u,
        "p(x, 0, v) = v (left unit)": g.product(x, zero, v, h) - v,
        "b(b(x, u), v) = b(x, p(x, u, v)) (target of a product)": g.target(y, v, h)
        - g.target(x, uv, h),
        "p(x, p(x, u, v), w) = p(x, u, p(y, v, w)) (associativity)": g.product(x, uv, w, h)
        - g.product(x, u, g.product(y, v, w, h), h),
        "b(x, u; h) = b(x, hu/k; k) (u is scaled by the step)": g.target(x, u, h)
        - g.target(x, h * u / k, k),
        "p(x, u, v; h) = (k/h) p(x, hu/k, hv/k; k) (u is scaled by the step)": uv
        - g.product(x, h * u / k, h * v / k, k) * k / h,
    }
    if g._inversion is not None:
        laws["p(x, u, ι(x, u)) = 0 (inverses)"] = g.product(x, u, g.inversion(x, u, h), h)
    return laws


@lru_cache(maxsize=64)
def check_axioms(groupoid: Any) -> None:
    """Raise `BadInput` unless a user's maps make a groupoid.

    The axioms are evaluated at random rational points, exactly or to 40 digits, where a false
    identity between analytic functions shows in practice. The algebra of a matrix group must be
    closed. For groupoids of this package the tests check the laws.
    """
    groupoid.check()
    if not groupoid.by_user:
        return
    lengths = {"x": groupoid.dim_x, "u": groupoid.dim_u, "v": groupoid.dim_u, "w": groupoid.dim_u}
    for seed in range(2):
        point = random_columns(lengths, small=("u", "v", "w"), seed=seed)
        for law, difference in axioms(groupoid, point).items():
            if not all(is_zero(entry) for entry in difference):
                shown = ", ".join(
                    f"{k} = {[float(n) for n in v]}"
                    for k, v in point.items()
                    if k in lengths and len(v) and re.search(rf"\b{k}\b", law)
                )
                place = f"{groupoid.place}: " if groupoid.place else ""
                raise BadInput(
                    f"{place}{groupoid.name} is not a groupoid: {law} fails at "
                    f"{shown}{groupoid.fix}."
                )
