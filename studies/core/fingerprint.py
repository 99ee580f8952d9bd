"""One digest of all that a measurement depends on: a kept one is used only if all of it agrees.

Of our own text all of the mathematics counts, and all that measures: the folder of the study, those
of the studies that it imports, and the shared folders. Files that judge or show, and the limits of
a study, do not count, for they are applied anew each time: where measuring asks them, its decisions
are made again (`decisions`), and the limits that it names count. Single scenes and rules are data,
so each case has the text of its own.
"""

from __future__ import annotations

import ast
import decimal
import hashlib
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import cache, lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from discmech.integrators import Lattice, Scheme, scenes
from discmech.integrators.extensions.control import scenes as problems
from discmech.integrators.files import encoded
from discmech.integrators.numbers import mpmath
from discmech.integrators.rules import BUILT_IN, Discretisation
from discmech.integrators.scene import Opaque, Scene, reads

from .case import Case
from .parts import is_built_in, parts_of
from .record import machine, processor, versions
from .study import Study, StudyFolder
from .userfile import loaded

ROOT = Path(__file__).resolve().parents[2]
STUDIES = (ROOT / "studies", ROOT / "tests" / "bench")
RULES, SCENES, TABLES = (
    Path(name) for name in ("integrators/rules", "integrators/scenes", "reference/tables")
)
#: the data of single scenes and rules: a case has in its key the text of its own alone
DATA = (SCENES, TABLES, *(RULES / f"{name}.py" for name in (*BUILT_IN, "galerkin")))
ASKED = {"fast", "target"}  # what a rule asks of the Lagrangian and of the groupoid
SHARED = ("causes", "core", "evidence", "systems")  # folders by which all studies measure
SHOWING = ("command", "report", "user")  # folders that only show results
#: files of a study that measure nothing
NOT_MEASURING = ("__init__.py", "judging*.py", "limits.py", "plot*.py", "view.py")


def of_case(study: Study, case: Case, timed: bool) -> str:
    """Return the digest of one case.

    It has the text that measures it, the case's words, its scene and rules, all versions, and the
    processor, whose instructions change the last bits. timed: the result is a time, so the machine
    counts as well.
    """
    words = [study.name, case.label, case.asked, str(versions()), processor()]
    # the state of the process with which all functions compute: how libraries round
    words.append(repr((decimal.getcontext(), mpmath.mp.prec, np.geterr())))
    words.append(str(machine()) if timed else "")
    words += [text_of_study(study), *of_scene(case.scene)]
    words.append(study.depends_on(case))
    words += [part for rule in study.rules_beside(case) for part in _facts(rule)]
    return _digest(*words, *(part for rule in case.rests_on for part in of_rule(rule)))


def text_of_study(study: Study) -> str:
    """Return the digest of the text by which a study measures.

    For a study that is not the bench's own it has all of the bench, the study's own text (in a
    package, that of all files of its folder) and the values that its functions read. Raises
    `Opaque` for one that reads files, clocks or chance, so that it is measured anew each time.
    """
    if isinstance(study, StudyFolder):
        return text_of(_folder_of(study))
    for file in reversed(loaded()):
        if file.studies.get(study.name) is study:
            return of_everything(file.digest, reads(study, pure=True))
    module = sys.modules[type(study).__module__]
    if module.__name__ == "__main__" or not getattr(module, "__file__", None):
        raise Opaque(f"{study.name} is in no file")
    place = Path(str(module.__file__))
    files = sorted(place.parent.rglob("*.py")) if module.__package__ else [place]
    return of_everything(*(p.read_text("utf-8") for p in files), reads(study, pure=True))


def _folder_of(study: StudyFolder) -> Path:
    return ROOT.joinpath(*study.package.split(".")[1:])


def of_scene(scene: Scene) -> Iterator[str]:
    """Yield all fields of a scene or lattice, with the values that its functions read.

    For a scene of the bench's own also the text that defines it. Raises `Opaque` if some part hides
    its contents.
    """
    if not is_ours(scene):
        yield reads(scene, pure=True)
        return
    yield _fields(scene)
    if "sites" not in parts_of(scene):
        yield _text_of_scene(scene.name)


@lru_cache(maxsize=256)
def _fields(scene: Scene) -> str:
    """Return the digest of a scene of the bench, whose functions read nothing that may change."""
    return reads(scene)


def of_rule(rule: Discretisation) -> Iterator[str]:
    """Yield a rule's facts, with the text of one of the bench's own, and the values that it reads.

    Raises `Opaque` if some part hides its contents. Nothing is derived: the equations follow from
    the rule, the scene and the text of the mathematics.
    """
    yield from _facts(rule)
    if rule.is_formula:  # another integrator lists itself what it depends on
        yield reads(rule, pure=not is_ours(rule))


def _facts(rule: Discretisation) -> Iterator[str]:
    base = rule.of_step
    yield repr((rule.name, rule.order, rule.stages, rule.splits, base.name, base.order))
    if rule.effective is not None:
        yield f"effective {rule.effective}"
    yield base.digest
    if rule.method is not None:
        method = rule.method
        yield f"{method.order} {method.in_turn} {method.coefficients(60)}"
    if is_ours(base):
        yield _instructions(base.formula) or _text_of_rule(str(base.formula.__module__))


def _instructions(formula: Callable[..., Any]) -> str:
    """Return what a formula does that asks for nothing but what it is given; "" for any other.

    So another name of a variable, or another comment, measures nothing anew.
    """
    code, words = getattr(formula, "__code__", None), formula.__doc__
    if code is None or not {*code.co_names} <= ASKED or code.co_freevars:
        return ""
    constants = [e for e in code.co_consts if e != words]
    if getattr(formula, "__defaults__", None) or not {*map(type, constants)} <= {int, type(None)}:
        return ""
    return repr((code.co_code, code.co_names, constants, code.co_argcount))


def of_answer(about: Callable[[Scheme], Any], scene: Scene, rule: Discretisation) -> str:
    """Return the digest of the answer of a function that shows a scheme."""
    words = (about.__qualname__, str(versions()), processor(), rule.source)
    text = (_text_of_mathematics(), _text_of_showing())
    return _digest(*words, *text, *of_scene(scene), *of_rule(rule))


def of_proof(rule: Discretisation, *words: str) -> str:
    """Return the digest of what is proven of a rule, of whatever coefficients.

    words: what was asked beside the order. Scenes and other rules have no part in a proof. Raises
    `Opaque` if some part of it hides its contents.
    """
    text = _text_of_mathematics(), _text_of_judges(STUDIES[0] / "proof")
    return _digest("prove", *words, str(versions()), *text, *of_rule(rule))


def is_ours(thing: Scene | Discretisation) -> bool:
    """True if the bench itself defines the scene or rule, except its values and composition."""
    if isinstance(thing, Lattice):
        return is_built_in(thing)
    if isinstance(thing, Scene):
        own = [scenes.get(thing.name)] if thing.name in scenes.every_name() else []
        own += [problems.get(thing.name).scene] if thing.name in problems.NAMES else []
        return any(scene.laws == thing.laws for scene in own)
    base = thing.of_step
    formula = base.formula
    return base.is_formula and str(formula.__module__).startswith("discmech.integrators.")


def own_name(scene: Any) -> str:
    """Return the name of a scene or lattice of the bench; "" for any other, whatever its name."""
    return str(scene.name) if is_ours(scene) else ""


# -- our own text ---------------------------------------------------------------------------------


def of_everything(*words: str) -> str:
    """Return the digest of some words and the whole text of the bench, for tests of the bench."""
    return _digest(*words, str(versions()), _text_of_all())


def of_search(study: Study, *words: str) -> str:
    """Return the digest of some words and all text by which a study may judge any scene and rule.

    That is all of the mathematics, the folders by which all studies measure, the study's own, and
    those that they import, with judges and limits. For one that is not the bench's it is all text.
    """
    if not isinstance(study, StudyFolder):
        return of_everything(*words)
    return _digest(*words, str(versions()), _text_of_search(_folder_of(study)))


def of_views(*words: str) -> str:
    """Return the digest of some words and the text of all that shows results, for plots."""
    return _digest(*words, _text_of_showing(), version("matplotlib"))


@cache
def _text_of_all() -> str:
    return _text(_all_in(ROOT / "integrators", ROOT / "reference", *STUDIES))


@cache
def _text_of_search(folder: Path) -> str:
    mathematics = _text(_all_in(ROOT / "integrators", ROOT / "reference"))
    return _digest(mathematics, _text_of_judges(folder))


@cache
def _text_of_judges(folder: Path) -> str:
    """Return the digest of all files of the shared folders, a study's, and those it imports."""
    shared = (STUDIES[0] / name for name in SHARED)
    return _text(_all_in(*shared, *_files_by_folder(folder, True)))


def _all_in(*folders: Path) -> Iterator[Path]:
    """Yield all files of folders that functions may depend on."""
    return (p for folder in folders for p in folder.rglob("*")
            if p.suffix in (".py", ".json", ".c"))  # fmt: skip


@cache
def _text_of_mathematics() -> str:
    folders = (ROOT / name for name in ("integrators", "reference"))
    return _text(p for folder in folders for p in folder.rglob("*.py")
                 if not {p, p.parent} & {ROOT / place for place in DATA})  # fmt: skip


@cache
def _text_of_showing() -> str:
    own = (p for folder in STUDIES for p in folder.glob("*/*.py")
           if p.name == "view.py" or p.match("plot*.py"))  # fmt: skip
    return _text([*own, *(p for name in SHOWING for p in (STUDIES[0] / name).rglob("*.py"))])


@cache
def text_of(folder: Path) -> str:
    """Return the digest of the files by which a folder's study measures, and of their imports."""
    folders = _files_by_folder(folder)
    asked = {part for files in folders.values() for p in files if p.suffix == ".py"
             for part in _asked_by(p)}  # fmt: skip
    shared = [p for name in SHARED for p in (STUDIES[0] / name).rglob("*.py")
              if not p.match("judging*.py")]  # fmt: skip
    return _digest(
        _text_of_mathematics(), *sorted(asked),
        _text([*shared, *(p for f in folders.values() for p in f)]),
    )  # fmt: skip


def _files_by_folder(folder: Path, whole: bool = False) -> dict[Path, list[Path]]:
    """Return the files by which a study measures, in its folder and in those that they import.

    whole: True for all files of the folders, also those that judge.
    """
    parts, folders = [STUDIES[0] / name for name in SHARED], dict[Path, list[Path]]()
    pending = [folder]
    while pending:
        place = pending.pop()
        if place in (*folders, *parts) or place.name in SHOWING or not place.is_dir():
            continue
        files = [
            p for p in place.rglob("*.py")
            if whole or p.parent != place or not any(map(p.match, NOT_MEASURING))
        ]  # fmt: skip
        folders[place] = [*files, *place.rglob("*.c")]  # C files that it compiles
        for file in files:
            text = file.read_text("utf-8")
            outside = r"\.\." + r"\." * len(file.relative_to(place).parents[1:])
            beside = re.findall(rf"^\s*from {outside}(\w+)", text, re.M)
            ours = re.findall(r"^\s*from discmech\.studies\.(\w+)", text, re.M)
            pending += [place.parent / name for name in beside]
            pending += [STUDIES[0] / name for name in ours]
    return folders


def _asked_by(file: Path) -> Iterator[str]:
    """Yield the text of what a file that measures reads of judges and of limits.

    Of limits that is what the file names. Of a judge it is all, but nothing where it only decides:
    its decisions are kept with the measurement, and made again (`decisions`).
    """
    text = file.read_text("utf-8")
    tree = ast.parse(text if re.search("judging|limits", text) else "")
    for line in (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)):
        place = file.parents[line.level - 1] if line.level else STUDIES[0]
        place = place.joinpath(*(line.module or "").removeprefix("discmech.studies.").split("."))
        for one in line.names:
            asked, name = place.with_suffix(".py"), one.name
            if not asked.exists():
                asked, name = place / f"{name}.py", ""
            if re.fullmatch(r"judging\w*|limits", asked.stem) and asked.exists():
                yield from _read_of(asked, name, tree, one.asname or name)


def _keys_in(tree: ast.AST, name: str) -> set[Any]:
    """Return the entries of a mapping that code asks for; None is among them for any other use."""
    uses = [node for node in ast.walk(tree) if isinstance(node, ast.Name) and node.id == name]
    keys = dict.fromkeys(uses)
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript) and node.value in uses:
            keys[node.value] = getattr(node.slice, "value", None)
    return set(keys.values())


def _read_of(file: Path, name: str, reader: ast.AST, called: str) -> Iterator[str]:
    """Yield the text of a name in a file of judges or limits; of the whole file if it is "".

    reader: the code that reads it, which calls it so. Of a limit its number alone is read.
    """
    tree = ast.parse(file.read_text("utf-8"))
    defined = {target.id: node for node in tree.body if isinstance(node, ast.Assign)
               for target in node.targets if isinstance(target, ast.Name)}  # fmt: skip
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    node = functions.get(name) or defined.get(name)
    of_limits, entries = file.stem == "limits", dict[Any, ast.expr]()
    if isinstance(node, ast.FunctionDef):
        if "decision" in map(ast.unparse, node.decorator_list):
            return
    elif node is not None and isinstance(node.value, ast.Dict):
        pairs = zip(node.value.keys, node.value.values, strict=True)
        entries = {getattr(key, "value", None): value for key, value in pairs}
    keys = _keys_in(reader, called) if of_limits else set()
    if keys and keys <= entries.keys() - {None}:
        for key in sorted(keys):
            value = entries[key]
            number = value.args[0] if isinstance(value, ast.Call) else value
            yield f"{name} {key} {ast.unparse(number)}"
    elif of_limits and node is not None and not entries:
        yield ast.unparse(node)
        for other in (*defined, *functions):
            if other != name and _keys_in(node, other):
                yield from _read_of(file, other, node, other)
    else:
        yield file.read_text("utf-8")
        yield from _asked_by(file)


@cache
def _text_of_scene(name: str) -> str:
    """Return the digest of a scene's file, the scenes it builds on, and its reference digits."""
    table = ROOT / TABLES / f"{name}.json"
    return _text([*_beside(SCENES / f"{name.replace('-', '_')}.py"), *[table] * table.exists()])


@cache
def _text_of_rule(module: str) -> str:
    """Return the digest of a rule's file and of those of its folder on which it is built."""
    return _text(_beside(RULES / f"{module.rpartition('.')[2]}.py"))


def _beside(place: Path) -> list[Path]:
    """Return a file and those of its folder that it imports, directly or not."""
    files, pending = list[Path](), [ROOT / place]
    while pending:
        if (file := pending.pop()) not in files and file.exists():
            files.append(file)
            names = re.findall(r"^\s*from \.(\w+)", file.read_text("utf-8"), re.M)
            pending += [file.with_name(f"{name}.py") for name in names]
    return files


def _text(files: Iterable[Path]) -> str:
    """Return the digest of files, by their names and texts."""
    return _digest(*(f"{p.relative_to(ROOT)}\n{p.read_text('utf-8')}" for p in sorted(set(files))))


def _digest(*parts: str) -> str:
    return hashlib.sha256(encoded("\0".join(parts))).hexdigest()
