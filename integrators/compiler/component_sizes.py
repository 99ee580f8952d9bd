"""Measure how far a sweep changed each component of the stages, and whether that is round-off.

Like `sweeps`, whose text it follows, this file is part of a generated module's text.
"""

# ruff: noqa: F821, B905 (names are supplied; the compiled language has no strict=)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def scales(sizes):
    """Return 1/size of each component, at most about 1024 times that of the largest."""
    most = largest_of(sizes)
    return tuple([1 / larger(e, most / 1024 + 1 / HUGE) for e in sizes])


def differ(sizes):
    """Return True if some component is so small that `scales` hides its last digits."""
    most, least = largest_of(sizes), HUGE
    for e in sizes:
        least = e if e > 0 and e < least else least
    return least * 1024 < most


def settle(change, before, best, stale, count, pending):
    """Return (True if the sweeps have ended, the least change, sweeps since it last shrank).

    Sweeps end when the next change would be below round-off, or when changes are round-off and no
    longer shrink. While `pending` (some component still shrinks) they do not end.
    """
    rate = change / before if before < HUGE else 1.0
    stale = 0 if change < best else stale + 1
    best = change if change < best else best
    ended = over(change, before, SMALLEST * EPS, change * rate, stale > 0 and change < 64 * EPS)
    return count > 1 and ended and not pending, best, stale


def any_shrinks(moved, left, sizes):
    """Return True if some component still shrinks above its own round-off.

    Its change must be less than half its least change so far. The next change is estimated to be
    smaller than this one by the same factor. Round-off of larger components, however large, does
    not shrink and so does not count.
    """
    answer = 1 < 0
    for e, least, size in zip(moved, left, sizes):
        answer = answer or (2 * e < least and e * e > SMALLEST * EPS * size * least)
    return answer


def largest_of(numbers):
    """Return the largest number, or the largest in each lane."""
    most = numbers[0]
    for e in numbers[1:]:
        most = larger(most, e)
    return most


def smallest(numbers):
    """Return the least of the numbers."""
    least = HUGE
    for e in numbers:
        least = e if e < least else least
    return least
