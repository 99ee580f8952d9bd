"""The words by which a command finds rules and scenes, each tried before it is printed.

A command runs in a process of its own. What a script defines is found there by the script's name;
what it makes where no other program sees it, or what a notebook's cells make, is written to a file
in the user's cache: the imports, and of the rest only the statements on which it depends.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from functools import lru_cache
from inspect import signature
from pathlib import Path
from typing import Any

from discmech.integrators import BadInput, Discretisation, Scene
from discmech.integrators.compiler import digest
from discmech.integrators.extensions.steps import WAYS, Varied
from discmech.integrators.files import encoded, prune, write_atomically
from discmech.integrators.numbers import sympy
from discmech.integrators.places import cache_folder, make_private
from discmech.integrators.rules import METHODS, Composition
from discmech.integrators.scene import Opaque, reads

from . import lookup
from .environment import absolute
from .userfile import OF_USER, UserFile, binds, is_of_bench, loaded, program, things_in


def address_of(thing: Any) -> str:
    """Return the word by which a command finds a rule or scene; its name if none does.

    A scene may be in another chart, which an option of the command gives.
    """
    return next(_words(thing), thing.name)


def is_found(thing: Any) -> bool:
    """Return True if the word of `address_of` finds this very object, with its values."""
    return next(_words(thing), None) is not None


def _words(thing: Any) -> Iterator[str]:
    """Yield words that find it, after a trial, the shortest first."""
    if isinstance(thing, Composition | Varied):
        made = METHODS if isinstance(thing, Composition) else WAYS
        for base in _words(thing.base):
            words = (f"{name}:{base}" for name in made)
            yield from (word for word in words if lookup.find(lookup.RULE, word) == (thing,))
    kind = lookup.RULE if isinstance(thing, Discretisation) else lookup.SCENE
    # of one that varies, or beside others of its name, the values stand behind it
    for end in [None, *(sign.start() for sign in re.finditer("[.-]", thing.name))]:
        name = thing.name[:end]
        with suppress(BadInput):
            yield from _by_values(kind.called(name), thing, name)
    for file in reversed(loaded()):
        yield from _words_in(file, thing, file.path, _text_of(thing) == str(absolute(file.path)))
    yield from _words_of_programs(thing)


def _words_in(file: UserFile, thing: Any, path: str, by_text: bool = True) -> Iterator[str]:
    """Yield the words for an object in a file: its own name, then a call of what made it.

    by_text: False if only the very objects of the file count.
    """
    own = {**lookup.SCENE.in_file(file), **file.rules, **file.made}
    for name in sorted(own, key=lambda name: name != thing.name):
        yield from _by_values(own[name], thing, f"{path}:{name}", by_text)
    maker, values = _maker(thing)
    if by_text and callable(file.variables.get(maker)) and values:
        kind = lookup.RULE if isinstance(thing, Discretisation) else lookup.SCENE
        with suppress(BadInput):
            if _same(lookup.in_this(file, kind, f"{maker}:{values}")[0], thing):
                yield f"{path}:{maker}:{values}"


def _by_values(base: Any, thing: Any, word: str, by_text: bool = True) -> Iterator[str]:
    """Yield the word if it finds the thing, or the word with other values of a scene."""
    if _same(base, thing, by_text):
        yield word
    elif isinstance(base, Scene) and isinstance(thing, Scene) and base.laws == thing.laws:
        changed = {name: getattr(thing, name) for name in ("duration", "step")
                   if getattr(base, name) != getattr(thing, name)}  # fmt: skip
        changed |= {name: value for name, value in thing.parameters.items()
                    if base.parameters.get(name) != value}  # fmt: skip
        with suppress(BadInput, TypeError, ValueError):  # rows are not written as words
            values = _written(changed)
            if changed and _same(lookup.with_words(base, values), thing):
                yield f"{word}:{values}"


def _maker(thing: Any) -> tuple[str, str]:
    """Return (name of the function that made a rule or scene, its arguments in words)."""
    function: Any = getattr(thing, "formula", None) or getattr(thing, "lagrangian", None)
    bound = getattr(function, "bound", None)
    if bound is not None:  # a rule with values for its open numbers
        return getattr(bound[0].formula, "__name__", ""), _written(bound[1])
    maker, inside, _ = getattr(function, "__qualname__", "").partition(".<locals>.")
    made = getattr(function, "__globals__", {}).get(maker)
    if not inside or made is None:
        return "", ""
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    with suppress(ValueError, TypeError):  # an empty cell, a maker without a signature
        read = {name: cell.cell_contents for name, cell in cells}
        return maker, _written({n: read[n] for n in signature(made).parameters if n in read})
    return "", ""


def _written(values: dict[str, Any]) -> str:
    texts = {name: str(sympy.sympify(value) if not isinstance(value, str) else value)
             for name, value in values.items()}  # fmt: skip
    return ",".join(f"{name}={text}" for name, text in texts.items())


def _text_of(thing: Any) -> str:
    """Return the name of the file whose text makes a rule's or a scene's function."""
    function = getattr(thing, "formula", None) or getattr(thing, "lagrangian", None)
    return str(getattr(getattr(function, "__code__", None), "co_filename", ""))


def _same(one: Any, other: Any, by_text: bool = True) -> bool:
    """True for one object, for two with the same fields, or made by the same text and values.

    Of a scene the chart may differ, and the name of either, under which a file has it.
    """
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, Scene):
        try:
            one = replace(one, groupoid=other.groupoid)
        except BadInput:  # of other dimensions
            return False
    values = [[getattr(each, f.name) for f in fields(each) if f.name != "name"]
              for each in (one, other)]  # fmt: skip
    try:
        return values[0] == values[1] or (by_text and reads(values[0]) == reads(values[1]))
    except Opaque:  # a program, of which the name is known
        return bool(one.name == other.name)


def _words_of_programs(thing: Any) -> Iterator[str]:
    """Yield words for what a script, a module that it loads, or a notebook makes."""
    main = sys.modules.get("__main__")
    made = _text_of(thing)
    for key, module in list(sys.modules.items()):  # not all of which are modules
        space = getattr(module, "__dict__", {})
        name = str(space.get("__file__") or "")
        # a command loads a file by its path, so it is no part of a package
        if (
            module is main
            or OF_USER in key
            or name != made
            or space.get("__package__")
            or not _is_file(name)
        ):
            continue
        with suppress(BadInput):
            yield from _words_in(lookup.in_file(name)[0], thing, name)  # type: ignore[arg-type]
    space = getattr(main, "__dict__", {})
    script = str(space.get("__file__") or "")
    if _is_file(script):
        yield from _words_of_text(thing, space, [Path(script).read_text("utf-8")], script)
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if shell is not None:
        cells = shell.user_ns.get("In") or ()
        yield from _words_of_text(thing, dict(shell.user_ns), cells, "")


def _words_of_text(
    thing: Any, space: dict[str, Any], cells: Sequence[str], script: str
) -> Iterator[str]:
    """Yield words for what the cells of a notebook, or the one text of a script, define."""
    names = [name for name, value in space.items() if name[:1] != "_"
             and any(each is thing for each in things_in({name: value}))]  # fmt: skip
    texts = [text_of(name, cells) for name in dict.fromkeys((*names, _maker(thing)[0]))]
    place = script or str(Path.cwd() / "cells.py")
    for text, alone in sorted(texts, key=lambda each: not each[1]):
        with suppress(BadInput):
            file = program(place, text)
            if script and alone:  # the script makes it when it is loaded, too
                yield from _words_in(file, thing, script)
            elif any(_words_in(file, thing, "")) and (kept := _kept(text, Path(place).parent)):
                yield from _words_in(file, thing, kept)


def _kept(text: str, folder: Path) -> str:
    """Write a program, which may import its neighbours in a folder; return its path, or ""."""
    whole = f"import sys\nsys.path.append({str(folder)!r})\n{text}"
    path = cache_folder() / "notebooks" / _name(encoded(whole))
    try:
        if not _is_ours(path):  # damaged or missing
            make_private(path.parent)
            write_atomically(path, whole)
            prune(path.parent, _is_ours)
    except OSError:  # a full disk: there is no file to name
        return ""
    return str(path)


def _name(text: bytes) -> str:
    return f"{digest(text)[:16]}.py"


def _is_ours(path: Path) -> bool:
    return path.is_file() and path.name == _name(path.read_bytes())


@lru_cache(maxsize=4096)
def _is_file(name: str) -> bool:
    return name.endswith(".py") and Path(name).is_file()


def text_of(name: str, cells: Sequence[str]) -> tuple[str, bool]:
    """Return the program that defines a name: all imports, and the statements that it depends on;
    and whether they run in a module, too, which is not `__main__`.

    If several statements bind a name, the last one before its use counts. Expressions, whose values
    are not kept, are left out. It is empty if no cell binds the name.
    """
    statements = [pair for cell in cells for pair in _statements(cell)]
    bound: dict[str, list[int]] = {}
    for k, (node, _) in enumerate(statements):
        for each in binds(node):
            bound.setdefault(each, []).append(k)
    if name not in bound:
        return "", False
    needed, waiting = set[int](), [bound[name][-1]]
    while waiting:
        if (k := waiting.pop()) in needed:
            continue
        needed.add(k)
        node = statements[k][0]
        # its names are read when it is called
        later = isinstance(node, ast.FunctionDef | ast.ClassDef)
        read = (
            e for e in ast.walk(node) if isinstance(e, ast.Name) and isinstance(e.ctx, ast.Load)
        )
        for used in read:
            before = [at for at in bound.get(used.id, ()) if at < k or later]
            waiting += before[-1:]
    kept = [node for k, (node, _) in enumerate(statements)
            if k in needed or isinstance(node, ast.Import | ast.ImportFrom)]  # fmt: skip
    text = "".join(f"{ast.unparse(node)}\n" for node in kept)
    return text, not any(statements[k][1] for k in needed)


def _statements(cell: str) -> Iterator[tuple[ast.stmt, bool]]:
    """Yield the statements of a cell, or of a script, with True for those of __main__ alone.

    Notebook lines (%, !) and bad cells have none.
    """
    lines = [e for e in cell.splitlines() if not e.lstrip().startswith(("%", "!"))]
    with suppress(SyntaxError):
        for node in ast.parse("\n".join(lines)).body:
            if isinstance(node, ast.If) and "__main__" in ast.unparse(node.test):
                yield from ((each, True) for each in node.body)
            else:
                yield node, False


def names_apart(rules: Sequence[Any]) -> list[str]:
    """Return the names of rules; of several with one name those of their files stand before it.

    What has one file, too, is numbered. One of the bench keeps its name.
    """
    names = {rule: str(getattr(rule, "name", "")) for rule in rules}

    def with_file(rule: Any) -> str:
        return f"{_file_of(rule)}-{names[rule]}".lstrip("-")

    def with_number(rule: Any) -> str:
        return f"{names[rule]} ({[r for r in names if names[r] == names[rule]].index(rule) + 1})"

    for made in (with_file, with_number):
        often = Counter(names.values())
        names = {rule: made(rule) if often[name] > 1 and not is_of_bench(rule) else name
                 for rule, name in names.items()}  # fmt: skip
    return [names[rule] for rule in rules]


def _file_of(rule: Any) -> str:
    """Return the name of the file that has a rule's function."""
    with suppress(AttributeError, TypeError, OSError):  # a program and a notebook have none
        return Path(inspect.getfile(inspect.unwrap(rule.formula))).stem
    return ""
