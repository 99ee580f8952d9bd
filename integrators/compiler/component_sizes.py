"""How far a sweep changed each component of the stages, and whether that is round-off.

As `stage_driver` this is text of a module, behind it.
"""

# ruff: noqa: F821, B905 (names are supplied; strict= is not of the compiled language)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def sizes_of(parts):
    """The largest |component| at a node, of each component."""
    return tuple(
        [largest(largest_of(tuple([abs(part[i]) for part in parts]))) for i in range(len(parts[0]))]
    )


def scales(sizes):
    """1/size, none beyond a thousand times the smallest of them."""
    most = largest_of(sizes)
    return tuple([1 / larger(e, most / 1024 + 1 / HUGE) for e in sizes])


def differ(sizes):
    """Whether a component is so small that `scales` does not see its last digits."""
    most, least = largest_of(sizes), HUGE
    for e in sizes:
        least = e if e > 0 and e < least else least
    return least * 1024 < most


def changes_of(parts, new):
    """The largest change of each component."""
    return sizes_of(
        tuple([tuple([a - e for a, e in zip(one, two)]) for one, two in zip(parts, new)])
    )


def settle(change, before, best, stale, count, pending):
    """(whether sweeps are at their end, the least change, for how many sweeps it has been so).

    They are where the next change would be less than round-off, or changes are round-off and do
    not shrink; pending: unless a component still does.
    """
    rate = change / before if before < HUGE else 1.0
    stale = 0 if change < best else stale + 1
    best = change if change < best else best
    ended = change * rate <= SMALLEST * EPS or (stale > 0 and change < 64 * EPS)
    return count > 1 and ended and not pending, best, stale


def any_shrinks(moved, left, sizes):
    """Whether a component's change is above its own round-off, and less than half the least one.

    The next change is taken to be smaller than this one by as much as this one is. What is
    round-off of larger components does not shrink, however large it is.
    """
    found = 1 < 0
    for e, least, size in zip(moved, left, sizes):
        found = found or (2 * e < least and e * e > SMALLEST * EPS * size * least)
    return found


def largest_of(numbers):
    """The largest of some numbers, or in each lane."""
    most = numbers[0]
    for e in numbers[1:]:
        most = larger(most, e)
    return most


def smallest(numbers):
    """The least of some numbers."""
    least = HUGE
    for e in numbers:
        least = e if e < least else least
    return least


def largest_change(w, new_w, of_w, p, new_p, of_p):
    """The largest change of a component at a node, by the component's size."""
    changes = 0 * w[0][0]
    for a, b, e, f in zip(w, new_w, p, new_p):
        for old, new, scale in zip(a + e, b + f, of_w + of_p):
            changes = larger(abs(old - new) * scale, changes)
    return largest(changes)
