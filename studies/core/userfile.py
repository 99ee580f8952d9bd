"""A user's file: the rules, scenes and studies that it defines, errors with their line."""

from __future__ import annotations
import __future__

import ast
import contextlib
import hashlib
import itertools
import pickle
import sys
import traceback
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

from discmech.integrators import BadInput, Discretisation, Lattice, Scene, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.errors import RAISED
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.files import encoded

from .environment import absolute


@dataclass(frozen=True)
class UserFile:
    """The definitions at a file's top level and in lists and dicts there, by the names of rules,
    scenes and studies.

    Lattices are among the scenes. `path` is as it was first given, `digest` identifies its text
    and that of the files beside it which it imports.
    """

    path: str
    digest: str
    rules: dict[str, Discretisation]
    scenes: dict[str, Scene]
    studies: dict[str, Any]  # instances of `Study`
    lists: dict[str, list[Any]]  # the rules and scenes in the lists and dicts of these names
    variables: dict[str, Any]  # the values of all variables of the file
    refused: dict[str, str]  # names of objects that could not be made, and why
    made: dict[str, Any] = field(default_factory=dict)  # by words that give values to a name

    @property
    def empty(self) -> str:
        """Why the file defines no rule, scene or study; empty if it defines one."""
        if self.rules or self.scenes or self.studies:
            return ""
        if self.refused:
            return next(iter(self.refused.values()))
        plain = [name for name, thing in self.variables.items()
                 if isinstance(thing, FunctionType)
                 and thing.__module__ == self.variables["__name__"]]  # fmt: skip
        verb = "is a plain function" if len(plain) == 1 else "are functions"
        said = f" {', '.join(plain)} {verb}:" if plain else ""
        return (
            f"{self.path} defines no rule and no scene:{said} decorate a function with "
            "@discretisation() or @one_step(), one of numbers with @black_box(), or make a "
            "Scene(...), a Lattice(...) or external([...]) at the top level."
        )


_loaded: dict[tuple[Path, bytes], UserFile] = {}
OF_USER = "discmech_user_"  # begins the names of the modules of these files
_running: list[Path] = []  # files whose text runs now
#: modules beside files that were run, by the name under which they are imported, with their texts
_beside: dict[str, tuple[ModuleType, bytes]] = {}
_FUTURE = sum(getattr(__future__, name).compiler_flag for name in __future__.all_feature_names)


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
    the file cannot be read or run.
    """
    file = absolute(path)
    try:
        source = file.read_bytes()
    except OSError as error:
        raise BadInput(
            f"{path} cannot be read ({error.strerror}); give a Python file with rules or scenes."
        ) from None
    user_file = _loaded.pop((file, source), None)
    now = _digest_of(source, _neighbours(file, source))
    if user_file is None or user_file.digest != now:  # what it imports may be another text
        digest, module, refused = _run(path, file, source)
        user_file = UserFile(path, digest, *_collect(path, module), vars(module), refused)
    _loaded[file, source] = user_file
    return user_file


def things_in(variables: Mapping[str, Any]) -> Iterator[Any]:
    """Yield the values of a file's variables, and after them the entries of its lists and dicts."""
    values = [value for name, value in variables.items() if name[:2] != "__"]
    yield from values
    for value in values:
        yield from _entries(value)


def _entries(value: Any, depth: int = 3) -> Iterator[Any]:
    """Yield the entries of a list, a tuple or the values of a dict, and of those in them."""
    if type(value) not in (list, tuple, dict) or not depth:
        return
    for each in [*(value.values() if type(value) is dict else value)]:
        yield each
        yield from _entries(each, depth - 1)


def is_of_bench(thing: Any) -> bool:
    """True for an object that comes with discmech, and not for another one of its name."""
    if isinstance(thing, Discretisation):
        return thing is discretisations.BUILT_IN.get(thing.name)
    room: Any = systems if isinstance(thing, Lattice) else scenes
    names = systems.NAMES if isinstance(thing, Lattice) else scenes.every_name()
    return thing.name in names and thing is room.get(thing.name)


def _collect(
    path: str, module: ModuleType
) -> tuple[dict[str, Discretisation], dict[str, Scene], dict[str, Any], dict[str, list[Any]]]:
    """Return the rules, scenes and studies of a module by name, and the lists of the former two.

    A second object of a name, and recorded runs without one, get the name of the variable, or of
    the list with a number.
    """
    rules: dict[str, Discretisation] = {}
    own: dict[str, Scene] = {}
    studies: dict[str, Any] = {}
    known: dict[int, Any] = {}  # by the address of what was seen, which the module keeps alive

    def take(thing: Any, where: str, own_name: Sequence[str] = ()) -> Any:
        """Return a rule or scene as it is named here; None for anything else."""
        if not isinstance(thing, Discretisation | Scene | Lattice) or is_of_bench(thing):
            return thing if isinstance(thing, Discretisation | Scene | Lattice) else None
        if id(thing) in known:
            return known[id(thing)]
        names: dict[str, Any] = rules if isinstance(thing, Discretisation) else own
        named = next((e for e in names.values() if e is thing or e == thing), thing)
        recorded: Any = thing
        if own_name and getattr(recorded, "unnamed", False):
            named = replace(recorded, name=own_name[0], unnamed=False)
        if names.get(named.name, named) is not named:
            free = itertools.chain(own_name, (f"{where}-{k}" for k in itertools.count(1)))
            named = replace(thing, name=next(word for word in free if word not in names))
        names[named.name] = known[id(thing)] = named
        return named

    top = {name: value for name, value in vars(module).items() if name[:2] != "__"}
    for name, value in top.items():
        take(value, name, [name])
        if getattr(type(value), "is_study", False) and type(value).__module__ == module.__name__:
            if trouble := value.trouble() or value.clash():
                raise BadInput(f"{path}: {trouble}.")
            if studies.setdefault(value.name, value) is not value:
                raise BadInput(
                    f"{path}: the name {value.name} is given twice in this file; choose another "
                    "name."
                )
    lists = {name: [e for each in _entries(value) if (e := take(each, name)) is not None]
             for name, value in top.items()}  # fmt: skip
    classes = [e for e in top.values() if isinstance(e, type)
               and getattr(e, "is_study", False) and e.__module__ == module.__name__]  # fmt: skip
    if classes and not studies:
        raise BadInput(
            f"{path}: {classes[-1].__name__} is a class: write STUDY = {classes[-1].__name__}() at "
            "the top level."
        )
    return rules, own, studies, {name: each for name, each in lists.items() if each}


def program(path: str, text: str) -> UserFile:
    """Return what a text defines that stands in place of a file; `load` does not find it."""
    file = absolute(path)
    digest, module, refused = _run(path, file, encoded(text))
    return UserFile(path, digest, *_collect(path, module), vars(module), refused)


def _run(path: str, file: Path, source: bytes) -> tuple[str, ModuleType, dict[str, str]]:
    """Run the source, with its output on standard error; return (digest, module, refused).

    A statement whose object is refused, or an entry of a list, leaves the others as they are:
    refused has the names that it and those that need it would bind, with the sentence that refuses
    it; of an entry the list's with a number.
    """
    key = hashlib.sha256(encoded(f"{file}\0") + source).hexdigest()[:8]
    module = ModuleType(f"{OF_USER}{file.stem}_{key}")
    module.__file__ = str(file)
    refused: dict[str, str] = {}
    if file in _running:
        raise BadInput(f"{path} is running: its objects have no words before it ends.")
    beside = _neighbours(file, source)
    _running.append(file)
    sys.modules[module.__name__] = module
    sys.path.insert(0, str(file.parent))  # its neighbours may be imported
    _forget_others(file.parent, beside)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            code, rest = compile(source, str(file), "exec"), ast.parse(source).body
            while True:
                try:
                    exec(code, vars(module))
                    break
                except Exception as error:
                    raised_at = next(iter(_places_in(file, error)), None)
                    if raised_at is None:  # a syntax error of a neighbour
                        raise
                    rest = _from(rest, raised_at[0])
                    known = isinstance(error, BadInput) or getattr(error, "name", "") in refused
                    if not (names := binds(rest[0])) or not (known or _makes(rest[0])):
                        raise  # it makes nothing: it is the mistake
                    if _take_entry(rest[0], raised_at):
                        names = [f"{names[0]}[{len(refused)}]"]
                    else:
                        rest.pop(0)
                    lost = refused.get(getattr(error, "name", ""), "") or _said(path, file, error)
                    refused |= dict.fromkeys(names, lost)
                    tree, flags = ast.Module(rest, []), code.co_flags & _FUTURE
                    code = compile(tree, str(file), "exec", flags, dont_inherit=True)
    except SyntaxError as error:
        where = path if error.filename in (None, str(file)) else error.filename
        raise BadInput(f"{where}, line {error.lineno}: {error.msg}; mend the line.") from None
    except MemoryError:
        raise
    except RAISED as error:
        raise BadInput(_said(path, file, error)) from None
    finally:
        _running.remove(file)
        sys.path.remove(str(file.parent))
        for place, text in beside.items():
            helper = sys.modules.get(name := _name_of(place, file.parent))
            if helper is not None and getattr(helper, "__file__", None) == str(place):
                _beside[name] = helper, text
    if refused:
        _refuse_users(source, module, refused)
    return _digest_of(source, beside), module, refused


def _refuse_users(source: bytes, module: ModuleType, refused: dict[str, str]) -> None:
    """Refuse the functions and classes that ask for a refused name when they run."""
    for each in ast.parse(source).body:
        if not isinstance(each, ast.FunctionDef | ast.ClassDef) or not hasattr(module, each.name):
            continue
        names = [node for node in ast.walk(each) if isinstance(node, ast.Name | ast.arg)]
        own = {e.arg if isinstance(e, ast.arg) else e.id for e in names
               if isinstance(e, ast.arg) or isinstance(e.ctx, ast.Store)}  # fmt: skip
        asked = [e.id for e in names if isinstance(e, ast.Name) and e.id in refused]
        if need := next((name for name in asked if name not in own | vars(module).keys()), ""):
            delattr(module, each.name)
            refused[each.name] = (
                f"{each.name} needs {need}, which could not be made: {refused[need]}; mend that "
                "line, or the file that it reads."
            )


def _from(statements: list[ast.stmt], line: int) -> list[ast.stmt]:
    """Return the statements from the one on with this line, which may be a decorator's."""
    first = [min(node.lineno, *(e.lineno for e in getattr(node, "decorator_list", ())), node.lineno)
             for node in statements]  # fmt: skip
    return statements[sum(begin <= line for begin in first) - 1 :]


def _makes(statement: ast.stmt) -> bool:
    """True for a definition, and for a variable with the result of a call, or a list of such."""
    return isinstance(statement, ast.FunctionDef | ast.ClassDef) or any(
        isinstance(each, ast.Call) for each in _columns(statement)[-1]
    )


def _columns(statement: ast.stmt) -> list[list[Any]]:
    """Return the entries of the list that a statement assigns, or keys and values, or its value."""
    value: Any = getattr(statement, "value", None)
    if isinstance(value, ast.Dict):
        return [value.keys, value.values]
    return [getattr(value, "elts", [value])]


def _take_entry(statement: ast.stmt, place: tuple[int, int]) -> bool:
    """Take out of the list or dict that a statement assigns the entry at that place, if any."""
    value, columns = getattr(statement, "value", None), _columns(statement)
    for k, entry in enumerate(columns[-1]):
        if entry is value:
            return False
        end = entry.end_lineno, entry.end_col_offset
        if (entry.lineno, entry.col_offset) <= place < end:
            for column in columns:
                del column[k]
            return True
    return False


def _said(path: str, file: Path, error: BaseException) -> str:
    """Return what is said of an error of a file, with its line."""
    what = str(error) if isinstance(error, BadInput) else f"{type(error).__name__}: {error}"
    if isinstance(error, BadInput) and what.startswith(f"{file.name}, line "):
        return what  # the line is in the message
    places = _places_in(file, error)
    return f"{path}{f', line {places[-1][0]}' if places else ''}: {what}"


def binds(node: ast.stmt) -> list[str]:
    """Return the names that a statement binds where it stands."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return [node.name]
    if isinstance(node, ast.Import | ast.ImportFrom):
        return [e.asname or e.name.partition(".")[0] for e in node.names]
    if isinstance(node, ast.Expr | ast.For | ast.While | ast.With):  # it may do anything else
        return []
    return [
        e.id for e in ast.walk(node) if isinstance(e, ast.Name) and isinstance(e.ctx, ast.Store)
    ]


def _digest_of(source: bytes, beside: Mapping[Path, bytes]) -> str:
    """Return the digest of a source and of the files beside it that it imports."""
    return hashlib.sha256(b"\0".join((source, *(beside[e] for e in sorted(beside))))).hexdigest()


def _neighbours(file: Path, source: bytes) -> dict[Path, bytes]:
    """Return the texts of the files that a source imports from its folder, or that these import.

    They are found by the texts, so that every process finds the same, whatever it loaded before.
    Raises `BadInput` for one of a standard module's name: what was loaded before decides which of
    the two an import finds.
    """
    texts, pending = {file: source}, [file]
    while pending:
        place = pending.pop()
        for each in filter(Path.is_file, _imported(place, texts[place], file.parent)):
            if (top := _name_of(each, file.parent).partition(".")[0]) in sys.stdlib_module_names:
                raise BadInput(
                    f"{each} has the name of a standard module, {top}, and one of them hides the "
                    "other: rename it."
                )
            if each not in texts:
                texts[each] = each.read_bytes()
                pending.append(each)
    del texts[file]
    return texts


def _name_of(place: Path, folder: Path) -> str:
    """Return the name by which a file in a folder, or below it, is imported from there."""
    parts = place.with_suffix("").relative_to(folder).parts if place.is_relative_to(folder) else ()
    return ".".join(parts[:-1] if parts[-1:] == ("__init__",) else parts)


def _forget_others(folder: Path, beside: Mapping[Path, bytes]) -> None:
    """Take modules out of Python's memory that hide a file's neighbours, or their present texts.

    Another file may have a neighbour of the same name in its own folder. If one has to go, all of
    them are run again, for they may import one another.
    """
    names = {_name_of(place, folder): place for place in beside}
    known = {name: _beside[name] for name in names if name in _beside}
    if any(str(names[name]) != helper.__file__ or beside[names[name]] != text
           for name, (helper, text) in known.items()):  # fmt: skip
        for name, (helper, _) in known.items():
            if sys.modules.get(name) is helper:
                del sys.modules[name]


def _imported(file: Path, source: bytes, folder: Path) -> Iterator[Path]:
    """Yield the paths at which the modules that a source imports may be, in a folder or below."""
    try:
        statements = list(ast.walk(ast.parse(source)))
    except SyntaxError:  # of a file that is imported only in some cases
        return
    for node in statements:
        if isinstance(node, ast.Import):
            modules = [(folder, each.name) for each in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = file.parents[node.level - 1] if node.level else folder
            modules = [(base, f"{node.module or ''}.{each.name}") for each in node.names]
        else:
            continue
        for place, name in modules:
            for part in filter(None, name.split(".")):  # every package on the way is run
                place /= part
                yield place.with_name(f"{part}.py")
                yield place / "__init__.py"


def _places_in(file: Path, error: BaseException) -> list[tuple[int, int]]:
    """Return lines and columns of the file that ran when the error arose, the outermost first."""
    frames = traceback.extract_tb(error.__traceback__)
    return [(f.lineno, f.colno or 0) for f in frames
            if f.filename == str(file) and f.lineno is not None]  # fmt: skip
