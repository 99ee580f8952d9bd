"""`discmech new rule|black-box|scene|groupoid|study NAME`: a file that works, as a start."""

from __future__ import annotations

import argparse
import keyword
import re
import sys
from pathlib import Path
from typing import Any

from discmech.integrators import BadInput, rules, scenes
from discmech.integrators.lattices import systems

from ..core.study import FOLDER
from .output import write

STARTERS = Path(__file__).resolve().parents[1] / "user" / "starters"
KINDS = ("rule", "black-box", "scene", "groupoid", "study")
#: modules that files of the user's import
OTHERS = ("discmech", "mpmath", "numpy", "pytest", "scipy", "sympy", "tests")


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser("new", help="a commented file that works, as a start")
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("name", help="letters, digits and dashes")
    parser.add_argument(
        "--folder", metavar="DIR", default=".", help="where to write it (default: here); a study "
        "goes into the checkout's studies/",
    )  # fmt: skip
    parser.set_defaults(action=_new)


def _new(options: argparse.Namespace) -> int:
    kind, name = options.kind, options.name
    if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name):
        raise BadInput(f"the name is {name!r}: use small letters, digits and dashes between them.")
    word = name.replace("-", "_")
    known = (*scenes.every_name(), *systems.NAMES, *rules.names(), *rules.MAPS)
    if kind != "study" and name in known:
        raise BadInput(f"the name {name} is discmech's own; choose another.")
    hidden = () if kind == "study" else (*sys.stdlib_module_names, *OTHERS)
    if keyword.iskeyword(word) or word in hidden:
        raise BadInput(
            f"{word}.py would hide a module of Python's, or of discmech's, of that name; choose "
            "another."
        )
    if kind == "study":
        target = FOLDER / word
        if not (FOLDER.parent / "pyproject.toml").exists():
            raise BadInput(
                "a study is a folder of discmech's own repository: clone it, and say it there."
            )
        files = {p: target / p.name for p in sorted((STARTERS / kind).glob("*.py"))}
        again = f"discmech {name}"
    else:
        target = Path(options.folder) / f"{word}.py"
        files = {STARTERS / f"{kind.replace('-', '_')}.py": target}
        again = f"discmech verify {target}"
    if target.exists():
        raise BadInput(f"{target} is there already: take another name, or remove it.")
    if kind != "study" and not target.parent.is_dir():
        raise BadInput(f"there is no folder {target.parent}: make it, or name another --folder.")
    target.parent.mkdir(parents=True, exist_ok=True)
    for source, place in files.items():
        text = source.read_text(encoding="utf-8").replace("FILE", str(target))
        named = text.replace("def starter(", f"def {word}(").replace('"starter"', f'"{name}"')
        place.parent.mkdir(exist_ok=True)
        write(str(place), named.replace("NAME", name) if kind != "study" else named)
    print(f"{target} is written; try: {again}")
    return 0
