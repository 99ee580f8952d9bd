"""What stands at the head of an exported file, and the parts that languages share."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import Any

import numpy as np

from .exported import STATUSES, Exported

WIDTH = 92


def head(given: Exported, language: str, said: Sequence[str]) -> list[str]:
    """Return the lines of the page of comments: what the file is, and what was verified.

    said: lines about the command, the version and what was verified.
    """
    scheme, scene, rule = given.scheme, given.scene, given.scheme.rule
    order = scheme.order
    lines = [f"{scene.name} by {rule.name}, in {language}", ""]
    sites = getattr(scene, "sites", 0)
    of_sites = f" at each of {sites} sites, whose rows follow one another" if sites else ""
    word = "" if sites or scheme.self_adjoint else "not "
    of_adjoint = "" if sites else f"The step is {word}self-adjoint."
    paragraphs = [
        f"System: {scene.name}, on {scene.groupoid.name}{of_sites}. {scene.source}",
        f"Rule: {rule.name}. {' '.join(str(rule.source).split())}",
        f"Order in (x, mu): {'not stated, measure it' if order is None else order}. " + of_adjoint,
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
    always = {"N", "M", *STATUSES}
    for name, value in given.constants.items():
        if name in used | always:
            yield name, np.ravel(value).tolist() if isinstance(value, tuple) else value
