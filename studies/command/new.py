"""`discmech new rule|black-box|scene|groupoid|study NAME`: write a working file to start from."""

from __future__ import annotations

import argparse
import keyword
import re
import sys
from pathlib import Path
from typing import Any

from discmech.integrators import BadInput, rules, scenes
from discmech.integrators.errors import shown
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.files import encoded

from ..core.study import NAME, every_study
from .output import write

STARTERS = Path(__file__).resolve().parents[1] / "user" / "starters"
KINDS = ("rule", "black-box", "scene", "groupoid", "study")
#: modules that users' files import
OTHERS = ("discmech", "mpmath", "numpy", "pytest", "scipy", "sympy", "tests")


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser("new", help="write a commented, working file to start from")
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("name", help="letters, digits and dashes")
    parser.add_argument(
        "--folder",
        metavar="DIR",
        default=".",
        dest="place",
        help="where to write it (default: here)",
    )
    parser.set_defaults(action=_new)


def _new(options: argparse.Namespace) -> int:
    kind, name = options.kind, options.name
    if not re.fullmatch(NAME, name):
        raise BadInput(
            f"the name is {shown(name)}: use small letters, digits and dashes between them."
        )
    word = name.replace("-", "_")
    known = (*scenes.every_name(), *systems.NAMES, *rules.names(), *rules.MAPS, *every_study())
    if name in known:
        raise BadInput(f"the name {name} is discmech's own; choose another.")
    if keyword.iskeyword(word) or word in (*sys.stdlib_module_names, *OTHERS):
        raise BadInput(
            f"{word}.py would hide a module of Python's, or of discmech's, of that name; choose "
            "another."
        )
    target = Path(options.place) / f"{word}.py"
    if target.exists():
        raise BadInput(f"{target} is there already: take another name, or remove it.")
    if not target.parent.is_dir():
        raise BadInput(f"there is no folder {target.parent}: make it, or name another --folder.")
    text = (STARTERS / f"{kind.replace('-', '_')}.py").read_text(encoding="utf-8")
    # it stands in a docstring, where a backslash of a name begins an escape
    place = encoded(str(target)).decode().replace("\\", "\\\\")
    for old, new in (("FILE", place), ("def starter(", f"def {word}("),
                     ('"starter"', f'"{name}"'), ("NAME", name)):  # fmt: skip
        text = text.replace(old, new)
    write(str(target), text)
    again = f"{target}:{name} pendulum" if kind == "study" else f"verify {target}"
    print(f"{target} is written; try: discmech {again}")
    return 0
