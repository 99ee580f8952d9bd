"""A user's file: the rules, scenes and studies that it defines, errors with their line."""

from __future__ import annotations

import ast
import contextlib
import hashlib
import pickle
import sys
import traceback
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

from discmech.integrators import BadInput, Discretisation, Lattice, Scene, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.errors import RAISED
from discmech.integrators.scenes import lattices as systems

from .environment import absolute


@dataclass(frozen=True)
class UserFile:
    """The definitions at a file's top level and in lists there, by the names of rules, scenes and
    studies.

    Lattices are among the scenes. `path` is as it was first given, `digest` identifies its text
    and that of the files beside it which it imports.
    """

    path: str
    digest: str
    rules: dict[str, Discretisation]
    scenes: dict[str, Scene]
    studies: dict[str, Any]  # instances of `Study`
    variables: dict[str, Any]  # the values of all variables of the file


_loaded: dict[tuple[Path, bytes], UserFile] = {}


def loaded() -> tuple[UserFile, ...]:
    """Return the files that this process has run, the most recently used last."""
    return tuple(_loaded.values())


def word_for_study(name: str) -> str:
    """Return the word that finds the study of that name: with its file, if it is in one."""
    for file in reversed(loaded()):
        if name in file.studies:
            return f"{file.path}:{name}"
    return name


def stamps(packed: bytes) -> tuple[tuple[str, str], ...]:
    """Return (path, digest) of the files whose objects are in a pickle.

    They are for `expect_unchanged` in another process, which needs no other file. Raises
    `pickle.PicklingError` for objects of an earlier text of a file.
    """
    last = {file.path: file for file in loaded()}
    needed = [f for f in loaded() if f.variables["__name__"].encode() in packed]
    if any(last[f.path].digest != f.digest for f in needed):
        raise pickle.PicklingError("a file was changed; the other process would read its new text.")
    words = [
        f for f in last.values() if f"{f.path}:".encode("utf-8", "surrogatepass") in packed
    ]  # of its studies
    return tuple({(f.path, f.digest): None for f in (*needed, *words)})


def expect_unchanged(files: Iterable[tuple[str, str]]) -> None:
    """Raise `BadInput` for a file of which this process has another text."""
    for path, digest in files:
        if load(path).digest != digest:
            raise BadInput(f"{path} has another text here, or was changed; begin again.")


def load(path: str) -> UserFile:
    """Run the file and collect its rules and scenes; a text is run only once.

    A file that imports those of discmech does not define them. Raises `BadInput`, with the line, if
    the file cannot be read or run, defines neither, or gives one name to two objects.
    """
    file = absolute(path)
    try:
        source = file.read_bytes()
    except OSError as error:
        raise BadInput(
            f"{path} cannot be read ({error.strerror}); give a Python file with rules or scenes."
        ) from None
    found = _loaded.pop((file, source), None)
    if found is None:
        digest, module = _run(path, file, source)
        found = UserFile(path, digest, *_collect(path, module), vars(module))
    _loaded[file, source] = found
    return found


def things_in(variables: Mapping[str, Any]) -> Iterator[Any]:
    """Yield the values of a file's variables, and after them the entries of its lists."""
    values = [*variables.values()]
    yield from values
    for value in values:
        if type(value) in (list, tuple):
            yield from value


def _collect(
    path: str, module: ModuleType
) -> tuple[dict[str, Discretisation], dict[str, Scene], dict[str, Any]]:
    rules: dict[str, Discretisation] = {}
    own: dict[str, Scene] = {}
    studies: dict[str, Any] = {}
    top = [*vars(module).values()]
    for thing in things_in(vars(module)):
        known: Any = None
        names: dict[str, Any]
        if isinstance(thing, Discretisation):
            known, names = discretisations.BUILT_IN.get(thing.name), rules
        elif isinstance(thing, Lattice):
            known = systems.get(thing.name) if thing.name in systems.NAMES else None
            names = own
        elif isinstance(thing, Scene):
            known, names = (
                scenes.get(thing.name) if thing.name in scenes.every_name() else None,
                own,
            )
        elif getattr(type(thing), "is_study", False) and type(thing).__module__ == module.__name__:
            if trouble := thing.trouble() or thing.clash():
                raise BadInput(f"{path}: {trouble}.")
            names = studies
        else:
            continue
        if thing is known:
            continue
        if known is not None or names.get(thing.name, thing) is not thing:
            if all(thing is not each for each in top):  # a list may hold variants of one name
                continue
            whose = "discmech's own" if known is not None else "given twice in this file"
            raise BadInput(f"{path}: the name {thing.name} is {whose}; choose another name.")
        names[thing.name] = thing
    classes = [e for e in vars(module).values() if isinstance(e, type)
               and getattr(e, "is_study", False) and e.__module__ == module.__name__]  # fmt: skip
    if classes and not studies:
        raise BadInput(
            f"{path}: {classes[-1].__name__} is a class: write STUDY = {classes[-1].__name__}() at "
            "the top level."
        )
    if not (rules or own or studies):
        plain = [
            name
            for name, thing in vars(module).items()
            if isinstance(thing, FunctionType) and thing.__module__ == module.__name__
        ]
        held = (
            f" {', '.join(plain)} {'is a plain function' if len(plain) == 1 else 'are functions'}:"
        )
        raise BadInput(
            f"{path} defines no rule and no scene:{held if plain else ''} decorate a function with "
            "@discretisation() or @one_step(), one of numbers with @black_box(), or make a "
            "Scene(...), a Lattice(...) or external([...]) at the top level."
        )
    return rules, own, studies


def _run(path: str, file: Path, source: bytes) -> tuple[str, ModuleType]:
    """Run the source, with its output on standard error; return (digest, module)."""
    module = ModuleType(f"discmech_user_{file.stem}_{hashlib.sha256(source).hexdigest()[:8]}")
    module.__file__ = str(file)
    sys.modules[module.__name__] = module
    sys.path.insert(0, str(file.parent))  # its neighbours may be imported
    try:
        with contextlib.redirect_stdout(sys.stderr):
            exec(compile(source, str(file), "exec"), vars(module))
    except SyntaxError as error:
        where = path if error.filename in (None, str(file)) else error.filename
        raise BadInput(f"{where}, line {error.lineno}: {error.msg}; mend the line.") from None
    except MemoryError:
        raise
    except RAISED as error:
        what = str(error) if isinstance(error, BadInput) else f"{type(error).__name__}: {error}"
        if isinstance(error, BadInput) and what.startswith(f"{file.name}, line "):
            raise  # the line is in the message
        line = _line_in(file, error)
        raise BadInput(f"{path}{f', line {line}' if line else ''}: {what}") from None
    finally:
        sys.path.remove(str(file.parent))
    return _digest_of(file, source), module


def _digest_of(file: Path, source: bytes) -> str:
    """Return the digest of a source, and of all files that it imports from its folder.

    They are found by the texts, so that every process finds the same, whatever it loaded before.
    """
    texts, pending = {file: source}, [file]
    while pending:
        place = pending.pop()
        for each in _imported(place, texts[place], file.parent):
            if each not in texts and each.is_file():
                texts[each] = each.read_bytes()
                pending.append(each)
    beside = (texts[each] for each in sorted(texts) if each != file)
    return hashlib.sha256(b"\0".join((source, *beside))).hexdigest()


def _imported(file: Path, source: bytes, folder: Path) -> Iterator[Path]:
    """Yield the paths at which the modules that a source imports may be, in a folder or below."""
    try:
        statements = list(ast.walk(ast.parse(source)))
    except SyntaxError:  # of a file that is imported only in some cases
        return
    for node in statements:
        if isinstance(node, ast.Import):
            found = [(folder, each.name) for each in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = file.parents[node.level - 1] if node.level else folder
            found = [(base, f"{node.module or ''}.{each.name}") for each in node.names]
        else:
            continue
        for place, name in found:
            for part in filter(None, name.split(".")):  # every package on the way is run
                place /= part
                yield place.with_name(f"{part}.py")
                yield place / "__init__.py"


def _line_in(file: Path, error: BaseException) -> int | None:
    """Return the last line of the file that was run when the error arose."""
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(file)]
    return lines[-1] if lines else None
