"""Whether a step is beyond the edge of its chart: text of a module, behind its driver."""

# ruff: noqa: F821 (names are supplied)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def watch(system, x, w, guard, c):
    """(guard, status, whether an edge is near): the largest size so far, and whether it is too big.

    After every step: near the singular set of FL one small correction may lead to another branch
    (looked at only where Newton took more, a million steps of moser-veselov hold wrong ones).
    """
    if not system.watched:
        return guard, OK, False
    farthest, reach, last, slack = guard
    sizes, rests = system.extents(x, w, c)
    near = False
    for size in tuple([abs(e) for e in sizes]) + tuple([of_rest(e) for e in rests]):
        if not size <= reach:
            return guard, EDGE, False
        farthest = size if size > farthest else farthest
        near = near or size > 1024  # = 2¹⁰: ten bits of u are lost
    if system.branched:
        (now,) = system.branch(x, w, c)
        if last < HUGE and abs(now - last) > slack:
            return guard, STRAYED, False
        last = now
    return (farthest, reach, last, slack), OK, near


def of_rest(rest):
    """The size of what is 0 at the edge and negative beyond."""
    return 1 / (rest * rest) if rest > 0 else HUGE
