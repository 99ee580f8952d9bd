"""Text of `watch`: what the driver looks at after each solution, to know when a chart ends.

It keeps the largest size of a run's solutions (from `neighbourhoods.chart_extents`) and stops the
loop with EDGE where a size passes `reach`; where L_d is given on the group also with STRAYED, where
the number that tells branches apart jumps. It also says whether the edge is near. Where there is
no edge it is nothing at all.

In `totals` behind the three counts: the largest size, reach, last branch number (HUGE: none yet),
the largest change of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..groupoids.chart_margin import chart_extents
from ..numbers.printing import function_text

if TYPE_CHECKING:
    from .kernels import KernelBuilder

_NOTHING = """
@helper
def load_guard(a):
    return ()

@helper
def save_guard(a, guard):
    pass

@helper
def watch(x, w, guard, c):
    return guard, OK, False
"""

_WATCH = """
@helper
def load_guard(a):
    return a[3], a[4], a[5], a[6]

@helper
def save_guard(a, guard):
    a[3], a[4], a[5], a[6] = guard

@helper
def of_rest(rest):
    return 1 / (rest * rest) if rest > 0 else HUGE

@helper
def watch(x, w, guard, c):
    far, reach, last, slack = guard
    {letters} = extents(x, w, c)
    size = {size}
    if not size <= reach:
        return guard, EDGE, False
{branch}
    return (size if size > far else far, reach, last, slack), OK, size > NEAR
"""

# After every step: near the singular set of FL one small correction may lead to another branch
# (looked at only where Newton took more, a million steps of moser-veselov hold wrong ones).
_BRANCH = """
    (now,) = branch(x, w, c)
    if last < HUGE and abs(now - last) > slack:
        return guard, STRAYED, False
    last = now
"""


GUARD = 7  # entries of `totals`
NEAR = 2**10  # a size from which Newton begins anew at the next step (`driver.forget`)


def watch_text(builder: KernelBuilder) -> list[str]:
    """`watch` and what it calls, for the scheme of a builder."""
    scheme = builder.scheme
    codes = f"EDGE, STRAYED, NEAR = 3, 4, {NEAR}\n"
    extents = chart_extents(scheme.scene.groupoid, scheme.x, scheme.u, scheme.h)
    if not extents:
        return [codes, _NOTHING]

    def text(name: str, values: list[Any]) -> str:
        results = [[builder._hoist(e) for e in values]]
        before = [*builder._define_xi, *builder._points(values)]
        arguments = {"x": builder.x, "w": builder.w, "c": builder.coefficient_names}
        return f"@kernel\n{function_text(name, arguments, results, before)}"

    letters = [f"e{i}" for i in range(len(extents))]
    sizes = [f"abs({e})" if kind == "size" else f"of_rest({e})"
             for e, (kind, _) in zip(letters, extents, strict=True)]  # fmt: skip
    texts, branch = [codes, text("extents", [value for _, value in extents])], ""
    if scheme.element is not None:
        texts.append(text("branch", [scheme.element.branch]))
        branch = _BRANCH
    size = sizes[0] if len(sizes) == 1 else f"max({', '.join(sizes)})"
    return [*texts, _WATCH.format(letters=", ".join(letters) + ",", size=size, branch=branch)]
