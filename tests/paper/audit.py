"""The audit itself: which claims of a row fail, on which samples, and what its mutants show."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from sympy import Add, sympify

from discmech.integrators import cayley
from tests.objects import GROUPOIDS, LARGE, STEPS, arrows

from .numbers import agree, entries
from .rows import ACTIONS, CAYLEY, EVERYWHERE, MATRIX, ROWS, SYMBOLIC, Claim, Row
from .sample import OFF, Sample

#: where everything is checked in the fast suite
GENERIC = ("generic", STEPS[0])


#: every groupoid; those of many dimensions in the slow tests alone
ALL = {**GROUPOIDS, **LARGE}


def covered(row: Row) -> list[str]:
    """The names of the groupoids that a row speaks of."""
    fits = {
        EVERYWHERE: lambda g: True,
        MATRIX: lambda g: hasattr(g, "algebra"),
        CAYLEY: lambda g: hasattr(g, "algebra") and g.tau is cayley,
        ACTIONS: lambda g: hasattr(g, "algebra") and g.dim_x,
    }[row.how]
    return [name for name, g in ALL.items() if fits(g)]


@lru_cache(maxsize=128)
def sample(name: str, stratum: str, h: Any, seed: int = 0) -> Sample:
    """One sample for all rows of a process."""
    return Sample(ALL[name], arrows(ALL[name], stratum, h, seed))


@lru_cache(maxsize=64)
def claims(row: Row) -> list[Claim]:
    """The claims of a symbolic row, made once."""
    assert row.check is not None
    return list(row.check())


def failures(row: Row, *arguments: Any) -> Iterator[tuple[Claim, Any, Any]]:
    """The claims that do not hold, each with the first entry that differs and what it should be."""
    assert row.check is not None
    same = symbolically_equal if row.how == SYMBOLIC else agree
    for claim in claims(row) if row.how == SYMBOLIC else row.check(*arguments):
        if (pair := differing(row, claim, same)) is not None:
            yield claim, *pair


def differing(row: Row, claim: Claim, same: Any) -> tuple[Any, Any] | None:
    """The first entry in which the sides differ, None if they do not."""
    found, wanted = entries(claim.found), entries(claim.wanted)
    assert len(found) == len(wanted), f"{row.place}: {claim.says} compares unlike things"
    return next(((a, b) for a, b in zip(found, wanted, strict=True) if not same(a, b)), None)


@lru_cache(maxsize=256)
def examined(row: Row, name: str) -> tuple[list[tuple[Claim, Any, Any]], set[str], set[str]]:
    """A row's failures on a groupoid, the ingredients it reads, its claims: each made once."""
    right = sample(name, *GENERIC).changed()
    assert row.check is not None
    made = list(row.check(right))
    failed = [(claim, *pair) for claim in made if (pair := differing(row, claim, agree))]
    return failed, right.reads, {claim.says for claim in made if not claim.refuted}


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
    """A groupoid of few dimensions, another for each row; the slow tests take all of them.

    Its witnesses meet each row as well, where wrong ingredients are looked for.
    """
    if row.dear:
        return witnesses(row)
    names = [name for name in covered(row) if ALL[name].dim_u <= 4]
    known = [name for name in witnesses(row) if name in names and row.misprints]
    return list(dict.fromkeys([names[ROWS.index(row) % len(names)], *known[:1]]))


def blind_to(row: Row) -> tuple[set[str], set[str]]:
    """On its witnesses: the ingredients whose errors a row does not notice, the claims that no
    error in an ingredient refutes."""
    reads, seen, said, refuted = set[str](), set[str](), set[str](), set[str]()
    for name in (n for n in witnesses(row) if n in covered(row)):
        failed, read, claimed = examined(row, name)
        assert not [c for c, _, _ in failed if not c.refuted]
        reads |= read
        said |= claimed
        # an ingredient that was noticed on one groupoid is asked again for the claims alone
        for mutant in sorted(read, key=lambda one: one in seen):
            if mutant in seen and said == refuted:
                continue
            wrong = sample(name, *GENERIC).changed(mutant)
            found = {claim.says for claim, _, _ in failures(row, wrong) if not claim.refuted}
            refuted |= found
            seen |= {mutant} if found else set()
    return reads - seen, said - refuted


def loses_a_term(expression: Any) -> Any:
    """A symbolic side without one of its terms, or with something it does not have."""
    terms = Add.make_args(sympify(expression).expand())
    return Add(*terms[1:]) if terms[0] != 0 else terms[0] + OFF
