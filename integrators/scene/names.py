"""The names that code looks up: of variables, of attributes, and of the modules that it imports."""

from __future__ import annotations

import dis
import sys
from functools import lru_cache
from itertools import accumulate, pairwise
from types import CodeType, ModuleType

#: instructions that read a variable of another place, and those that name an attribute
_OF_VARIABLES = (
    "LOAD_CLASSDEREF", "LOAD_DEREF", "LOAD_FROM_DICT_OR_DEREF", "LOAD_FROM_DICT_OR_GLOBALS",
    "LOAD_GLOBAL", "LOAD_NAME",
)  # fmt: skip
_OF_ATTRIBUTES = {code for code in dis.hasname if dis.opname[code] not in _OF_VARIABLES}


@lru_cache(maxsize=4096)
def names_in(code: CodeType) -> frozenset[str]:
    """Return all names that the code and its inner functions look up."""
    inner = (names_in(c) for c in code.co_consts if isinstance(c, CodeType))
    return frozenset(code.co_names).union(*inner)


@lru_cache(maxsize=4096)
def attributes_in(code: CodeType, name: str, inside: bool) -> frozenset[str | None]:
    """Return the attributes of a name that the code and its inner functions look up.

    None is among them if they do anything else with the name, such as to give it to a function.
    inside: True for the name of an attribute, False for that of a variable outside.
    """
    inner = (attributes_in(c, name, inside) for c in code.co_consts if isinstance(c, CodeType))
    steps = (step for step in dis.get_instructions(code) if step.opname != "EXTENDED_ARG")
    asked = (
        after.argval if after.opname in ("LOAD_ATTR", "LOAD_METHOD") else None
        for step, after in pairwise(steps)
        if step.argval == name
        and (step.opcode in _OF_ATTRIBUTES if inside else step.opname in _OF_VARIABLES)
    )
    return frozenset(asked).union(*inner)


@lru_cache(maxsize=4096)
def imported_in(code: CodeType) -> frozenset[tuple[int, str]]:
    """Return the modules that the code and its inner functions import: level and name."""
    modules = {name for c in code.co_consts if isinstance(c, CodeType) for name in imported_in(c)}
    if dis.opmap["IMPORT_NAME"] in code.co_code[::2]:
        steps = list(dis.get_instructions(code))
        for level, _, step in zip(steps, steps[1:], steps[2:], strict=False):
            if step.opname == "IMPORT_NAME":
                modules.add((level.argval, step.argval))
    return frozenset(modules)


def packages(name: str) -> list[ModuleType]:
    """Return the module of that name, and the packages that it is in, if they are loaded."""
    names = accumulate(name.split("."), lambda package, part: f"{package}.{part}")
    return [sys.modules[each] for each in names if each in sys.modules]
