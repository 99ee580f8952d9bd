"""Text of `watch`: what the driver looks at after each solution, to know when a chart ends.

It keeps the farthest solution of the run and stops the loop with EDGE where the chart's extent
(`charts.chart_extent`) passes `reach`; where L_d is given on the group also with STRAYED, where the
number that tells branches apart jumps. Where there is no edge it is nothing at all.

In `totals` behind the three counts: extent of the farthest, reach, last branch number (HUGE: none
yet), the largest change of it, then the farthest w.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .charts import chart_extent
from .printing import function_text

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
    return guard, OK
"""

_WATCH = """
@helper
def load_guard(a):
    return a[3], a[4], a[5], a[6], ({loads}, )

@helper
def save_guard(a, guard):
    a[3], a[4], a[5], a[6] = guard[0], guard[1], guard[2], guard[3]
{saves}

@helper
def watch(x, w, guard, c):
    far, reach, last, slack, at = guard
    size = abs(extent(w, c))
    if not size <= reach:
        return guard, EDGE
{branch}
    if size > far:
        return (size, reach, last, slack, w), OK
    return (far, reach, last, slack, at), OK
"""

_BRANCH = """
    now = branch(x, w, c)
    if last < HUGE and abs(now - last) > slack:
        return guard, STRAYED
    last = now
"""


def guard_length(m: int) -> int:
    """Entries of `totals`, with m unknowns a step."""
    return 7 + m


def watch_text(builder: KernelBuilder) -> list[str]:
    """`watch` and what it calls, for the scheme of a builder."""
    scheme, m = builder.scheme, len(builder.w)
    codes = "EDGE, STRAYED = 3, 4\n"
    size = chart_extent(scheme.scene.groupoid, scheme.u, scheme.h)
    if size is None or builder.affine:
        return [codes, _NOTHING]

    def text(name: str, vectors: dict[str, Any], value: Any) -> str:
        result = builder._hoist(value)
        before = [*builder._define_xi, *builder._points([value])]
        arguments = {**vectors, "w": builder.w, "c": builder.coefficient_names}
        return f"@kernel\n{function_text(name, arguments, [result], before)}"

    texts, branch = [codes, text("extent", {}, size)], ""
    if scheme.element is not None:
        texts.append(text("branch", {"x": builder.x}, scheme.branch_at_points))
        branch = _BRANCH
    return [
        *texts,
        _WATCH.format(
            loads=", ".join(f"a[{7 + i}]" for i in range(m)),
            saves="\n".join(f"    a[{7 + i}] = guard[4][{i}]" for i in range(m)),
            branch=branch,
        ),
    ]
