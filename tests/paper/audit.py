"""The audit itself: which claims of a row fail, on which samples, and what its mutants show."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from sympy import Add, sympify

from discmech.integrators import cayley
from tests.objects import GROUPOIDS, STEPS, arrows

from .numbers import agree, entries
from .rows import ACTIONS, CAYLEY, EVERYWHERE, MATRIX, ROWS, SYMBOLIC, Claim, Row
from .sample import OFF, Sample

#: where everything is checked in the fast suite
GENERIC = ("generic", STEPS[0])


def covered(row: Row) -> list[str]:
    """The names of the groupoids that a row speaks of."""
    fits = {
        EVERYWHERE: lambda g: True,
        MATRIX: lambda g: hasattr(g, "algebra"),
        CAYLEY: lambda g: hasattr(g, "algebra") and g.tau is cayley,
        ACTIONS: lambda g: hasattr(g, "algebra") and g.dim_x,
    }[row.how]
    return [name for name, g in GROUPOIDS.items() if fits(g)]


@lru_cache(maxsize=128)
def sample(name: str, stratum: str, h: Any, seed: int = 0) -> Sample:
    """One sample for all rows of a process."""
    return Sample(GROUPOIDS[name], arrows(GROUPOIDS[name], stratum, h, seed))


@lru_cache(maxsize=64)
def claims(row: Row) -> list[Claim]:
    """The claims of a symbolic row, made once."""
    assert row.check is not None
    return list(row.check())


def failures(row: Row, *arguments: Any) -> Iterator[tuple[Claim, Any, Any]]:
    """The claims that do not hold, each with the first entry that differs and what it should be."""
    assert row.check is not None
    for claim in claims(row) if row.how == SYMBOLIC else row.check(*arguments):
        found, wanted = entries(claim.found), entries(claim.wanted)
        assert len(found) == len(wanted), f"{row.place}: {claim.says} compares unlike things"
        same = symbolically_equal if row.how == SYMBOLIC else agree
        for a, b in zip(found, wanted, strict=True):
            if not same(a, b):
                yield claim, a, b
                break


@lru_cache(maxsize=256)
def examined(row: Row, name: str) -> tuple[list[tuple[Claim, Any, Any]], set[str]]:
    """A row's failures on a groupoid, and the ingredients that it reads: each made once."""
    right = sample(name, *GENERIC).changed()
    return list(failures(row, right)), right.reads


def symbolically_equal(found: Any, wanted: Any) -> bool:
    """Whether the difference cancels identically; it is rational in its symbols and functions."""
    difference = (found - wanted).expand()
    return difference == 0 or difference.together().cancel() == 0


def witnesses(row: Row) -> list[str]:
    """Small groupoids of the row's kind on which an error in any ingredient is visible."""
    if row.how == EVERYWHERE:
        return ["affine action", "framed plane"]
    return ["group(so(3))", "action(se(2))"]


def quick(row: Row) -> list[str]:
    """A small groupoid, another for each row; the slow tests take all of them.

    Its witnesses meet each row as well, where wrong ingredients are looked for.
    """
    if row.dear:
        return witnesses(row)
    names = [name for name in covered(row) if GROUPOIDS[name].dim_u <= 3]
    known = [name for name in witnesses(row) if name in names and row.misprints]
    return list(dict.fromkeys([names[ROWS.index(row) % len(names)], *known[:1]]))


def blind_to(row: Row) -> set[str]:
    """The ingredients that a row reads without noticing, on its witnesses, that one is wrong."""
    reads: set[str] = set()
    seen: set[str] = set()
    for name in (n for n in witnesses(row) if n in covered(row)):
        if reads and seen == reads:
            break
        failed, read = examined(row, name)
        assert not [c for c, _, _ in failed if not c.misprint]
        reads |= read
        for mutant in read - seen:
            wrong = sample(name, *GENERIC).changed(mutant)
            if any(not claim.misprint for claim, _, _ in failures(row, wrong)):
                seen.add(mutant)
    return reads - seen


def loses_a_term(expression: Any) -> Any:
    """A symbolic side without one of its terms, or with something it does not have."""
    terms = Add.make_args(sympify(expression).expand())
    return Add(*terms[1:]) if terms[0] != 0 else terms[0] + OFF
