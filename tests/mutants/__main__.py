"""Mutate and test: python -m tests.mutants judges|reference [--sample N] [--seed S] [--only WORD]

Cosmic Ray says which mutants there are and writes each into a copy of the checkout; the tests run
in a fork of a process that has loaded sympy and its like, so that a mutant costs about a second.
"""

from __future__ import annotations

import argparse
import ast
import math
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from .targets import TARGETS, Target

ROOT = Path(__file__).resolve().parent.parent.parent
#: what no mutant touches, loaded once
COMMON = (
    "pytest", "numpy", "scipy.linalg", "sympy", "mpmath", "gmpy2", "flint",
    "discmech.integrators",
)  # fmt: skip
#: times as long as the tests take without a mutant: one that takes longer runs for ever
PATIENCE = 5


def mutants(target: Target) -> Iterator[Any]:
    """The mutants of a target as Cosmic Ray has them, but for those of type hints."""
    from cosmic_ray.commands import init
    from cosmic_ray.work_db import WorkDB, use_db

    tree = ast.parse(Path(target.module).read_text(encoding="utf-8"))
    hints, constants = _annotations(tree), _constants(tree)
    with use_db("mutants.sqlite", WorkDB.Mode.create) as session:
        init([Path(target.module)], session, {})
        items = session.work_items
    for (mutation,) in (item.mutations for item in items):
        at = mutation.start_pos
        names = [mutation.definition_name] if mutation.definition_name else []
        names += [name for name, begin, end in constants if begin <= at < end]
        inside = any(map(target.names.search, names or [""]))
        if inside and not any(begin <= at < end for begin, end in hints):
            yield mutation


def _span(node: Any) -> tuple[tuple[int, int], tuple[int, int]]:
    """Where a piece of a text begins and ends."""
    return (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)


def _annotations(tree: ast.Module) -> list[tuple[Any, Any]]:
    """Where type hints begin and end, and what is imported for them: nothing runs there."""
    given = (getattr(node, name, None) for node in ast.walk(tree)
             for name in ("annotation", "returns"))  # fmt: skip
    imported = (node for node in ast.walk(tree) if isinstance(node, ast.If)
                and getattr(node.test, "id", "") == "TYPE_CHECKING")  # fmt: skip
    return [_span(hint) for hint in (*given, *imported) if hint is not None]


def _constants(tree: ast.Module) -> list[tuple[str, Any, Any]]:
    """The names that a module gives to values, and where."""
    assigned = (node for node in tree.body if isinstance(node, ast.Assign))
    return [(name.id, *_span(node)) for node in assigned
            for target in node.targets for name in ast.walk(target)
            if isinstance(name, ast.Name)]  # fmt: skip


def _exit_with(tests: tuple[str, ...]) -> NoReturn:
    """Run them in this fork and end it, whatever happens: the copy is its parent's."""
    code = 1
    try:
        os.setsid()
        with open(os.devnull, "w") as nothing:
            os.dup2(nothing.fileno(), 1)
            os.dup2(nothing.fileno(), 2)
        import pytest

        plain = ["-x", "-q", "-pno:cacheprovider", "-m", "not slow"]
        plain += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of what is loaded already
        code = int(pytest.main([*plain, *tests]))
    finally:
        os._exit(code)


def passes(tests: tuple[str, ...], seconds: float) -> bool:
    """Whether the tests pass in that time, in a fork that imports the mutated module anew."""
    child = os.fork()
    if not child:
        _exit_with(tests)
    last = time.monotonic() + seconds
    while time.monotonic() < last:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status) == 0
        time.sleep(0.02)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return False


@cache
def seconds_without(tests: tuple[str, ...]) -> float:
    """How long they take without a mutant; they have to pass."""
    start = time.monotonic()
    if not passes(tests, math.inf):
        sys.exit(f"Without a mutant these fail: {' '.join(tests)}")
    return time.monotonic() - start


def survivors(target: Target, chosen: list[Any]) -> Iterator[str]:
    """A line for each mutant that the tests do not notice."""
    from cosmic_ray.mutating import use_mutation
    from cosmic_ray.plugins import get_operator

    seconds = 10 + PATIENCE * seconds_without(target.tests)
    for mutation in chosen:
        operator = get_operator(mutation.operator_name)(**mutation.operator_args)
        with use_mutation(mutation.module_path, operator, mutation.occurrence) as (before, after):
            if passes(target.tests, seconds):
                yield _told(mutation, before, after)


def _told(mutation: Any, before: str, after: str) -> str:
    pairs = zip(before.splitlines(), after.splitlines(), strict=False)
    number, old, new = next((i, a, b) for i, (a, b) in enumerate(pairs, 1) if a != b)
    return f"{mutation.module_path}:{number}: {old.strip()}  =>  {new.strip()}"


def _chosen(
    targets: tuple[Target, ...], sample: int | None, each: int | None, seed: int
) -> list[list[Any]]:
    """The mutants of each target: all, so many in all, or so many of each, at random."""
    found = [list(mutants(target)) for target in targets]
    if each is not None:
        return [random.Random(f"{seed} {target.module}").sample(there, min(each, len(there)))
                for target, there in zip(targets, found, strict=True)]  # fmt: skip
    if sample is not None:
        places = [(k, i) for k, there in enumerate(found) for i in range(len(there))]
        taken = random.Random(seed).sample(places, min(sample, len(places)))
        return [[found[k][i] for at, i in taken if at == k] for k in range(len(found))]
    return found


def run(
    targets: tuple[Target, ...], sample: int | None, each: int | None, seed: int, only: str
) -> bool:
    """Print the survivors of each target and the share killed; whether that is 90 % of all."""
    if each is not None:
        targets = tuple(target for target in targets if only in target.module)
    killed = total = 0
    for target, mine in zip(targets, _chosen(targets, sample, each, seed), strict=True):
        if only not in target.module or not mine:
            continue
        alive = 0
        for line in survivors(target, mine):
            print(f"  {line}", flush=True)
            alive += 1
        killed, total = killed + len(mine) - alive, total + len(mine)
        print(f"{target.module}: {len(mine) - alive} of {len(mine)} killed", flush=True)
    print(f"{killed} of {total} killed, {killed / max(total, 1):.1%}")
    return killed >= 0.9 * total


def main() -> int:
    """Work in a copy: whatever interrupts this, no mutant stays in the checkout."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=TARGETS)
    some = parser.add_mutually_exclusive_group()
    some.add_argument("--sample", type=int, help="so many mutants, at random")
    some.add_argument("--each", type=int, help="so many of each module, at random")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="of these, modules with this in their name")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "checkout"
        leave = shutil.ignore_patterns(".*", "__pycache__", "build", "_build")
        shutil.copytree(ROOT, copy, ignore=leave)
        os.chdir(copy)
        sys.path[0] = str(copy)
        for name in list(sys.modules):
            if name.partition(".")[0] in ("tests", "discmech") and name != __name__:
                del sys.modules[name]
        sys.dont_write_bytecode = True
        os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # they are half of the time
        for name in COMMON:
            import_module(name)
        done = run(TARGETS[asked.what], asked.sample, asked.each, asked.seed, asked.only)
        return 0 if done else 1


if __name__ == "__main__":
    sys.exit(main())
