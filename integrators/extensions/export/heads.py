"""What stands at the head of an exported file, and the parts that languages share."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import Any

from .exported import Exported

WIDTH = 92


def head(given: Exported, language: str, said: Sequence[str]) -> list[str]:
    """Return the lines of the page of comments: what the file is, and what was verified.

    said: lines about the command, the version and what was verified.
    """
    scheme, scene, rule = given.scheme, given.scene, given.scheme.rule
    order = scheme.order
    lines = [f"{scene.name} by {rule.name}, in {language}", ""]
    paragraphs = [
        f"System: {scene.name}, on {scene.groupoid.name}. {scene.source}",
        f"Rule: {rule.name}. {' '.join(str(rule.source).split())}",
        f"Order in (x, mu): {'not stated, measure it' if order is None else order}. "
        + ("The step is self-adjoint." if scheme.self_adjoint else "The step is not self-adjoint."),
        f"x has {given.constants['N']} entries{', the last of which is the time' * given.timed}; "
        f"mu has {given.constants['M']}: momenta in the natural basis, dL/dv on a vector space.",
        "Parameters stay parameters: set them, then start. Sums of x and mu are compensated, so do "
        "not let a compiler reorder additions (no -ffast-math).",
        *said,
    ]
    for text in paragraphs:
        lines += [*wrap(" ".join(text.split()), WIDTH), ""]
    return lines[:-1]


def constants(given: Exported) -> Iterator[tuple[str, Any]]:
    """Yield the constants that the functions use, by name."""
    used = {e.id for f in given.functions for e in ast.walk(f) if isinstance(e, ast.Name)}
    always = {"N", "M", "OK", "NOT_CONVERGED", "SINGULAR", "EDGE", "STRAYED"}
    for name, value in given.constants.items():
        if name in used | always:
            yield name, value


def start_of(given: Exported) -> tuple[list[float], list[float]]:
    """Return the scene's own x (with its time) and mu."""
    start = given.scheme.flow(given.scene.step).starting.own
    return [float(e) for e in start.x], [float(e) for e in start.mu]
