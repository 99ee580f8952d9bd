"""The check whether a step is beyond the edge of its chart; text of a module, behind its driver."""

# ruff: noqa: F821 (names are supplied)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def watch(system, x, w, guard, c):
    """Return (guard with the largest size so far, status, True if an edge is near).

    This runs after every step: near the singular set of FL one small correction may lead to another
    branch. (When it ran only after steps with many corrections, a million steps of moser-veselov
    contained wrong ones.)
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
    """Return the size 1/rest² of a quantity that is 0 at the edge and negative beyond it."""
    return 1 / (rest * rest) if rest > 0 else HUGE
