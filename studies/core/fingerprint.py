"""What a result depends on, as one digest: a stored result is used only where all of it agrees."""

from __future__ import annotations

import ast
import hashlib
import inspect
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import cache, lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from discmech.integrators import Lattice, Scheme, scenes
from discmech.integrators.compiler import text_key
from discmech.integrators.equations import step_system
from discmech.integrators.lattices import LatticeScheme, systems
from discmech.integrators.rules import Composition, Discretisation
from discmech.integrators.scene import Opaque, Scene, reads

from .case import Case, scheme_of
from .record import machine, processor, versions
from .study import Study, StudyFolder
from .userfile import loaded

ROOT = Path(__file__).resolve().parents[2]
STUDIES = (ROOT / "studies", ROOT / "tests" / "bench")
#: what is data of single scenes and rules: each has its own text in the fingerprints of its cases
RULES = tuple(Path("integrators/rules") / name for name in ("simple.py", "galerkin.py"))
DATA = (Path("integrators/scenes"), *RULES, Path("reference/tables"))
#: what only shows results, or says what a study is
VIEWS = tuple(Path("studies") / name for name in ("report", "command", "user", "__init__.py"))
VIEW_FILES = ("view.py", "plot*.py", "__init__.py")


def of_case(study: Study, case: Case, timed: bool) -> str:
    """Of one case: the study's text, the case's words, its scene and rules, all versions, and the
    processor, on whose instructions the last bits depend.

    timed: the result is a time, so the machine counts as well.
    """
    rules: Iterable[Discretisation] = getattr(case, "rules", (case.rule,))
    words = [study.name, case.label, case.command, str(versions()), processor()]
    words.append(str(machine()) if timed else "")
    words += [text_of_study(study), *of_scene(case.scene)]
    words.append(study.depends_on(case))
    words += [part for rule in study.rules_beside(case) for part in _facts(rule)]
    return _digest(*words, *(part for rule in rules for part in of_rule(case.scene, rule)))


def text_of_study(study: Study) -> str:
    """Of the bench's own study what its measuring rests on; else all of the bench and its file.

    Of a study in a package the text of all files of its folder count.
    """
    if isinstance(study, StudyFolder):
        return text_of(str(study.measuring.__file__))
    for file in reversed(loaded()):
        if file.studies.get(study.name) is study:
            return of_everything(file.digest)
    module = sys.modules[type(study).__module__]
    if module.__name__ == "__main__" or not getattr(module, "__file__", None):
        raise Opaque(f"{study.name} is in no file")
    place = Path(str(module.__file__))
    files = sorted(place.parent.rglob("*.py")) if module.__package__ else [place]
    return of_everything(*(p.read_text("utf-8") for p in files))


def known_by_text(case: Case) -> bool:
    """Whether the fingerprint needs nothing derived: scene and rules are the bench's own."""
    rules = getattr(case, "rules", (case.rule,))
    return is_ours(case.scene) and all(map(is_ours, rules))


def of_scene(scene: Scene) -> Iterator[str]:
    """All fields of a scene or lattice, with what its functions read beside their arguments, and
    the text that defines a scene of the bench's own.

    Raises `Opaque` where something in it hides what it holds.
    """
    yield reads(scene)
    if is_ours(scene) and not isinstance(scene, Lattice):
        yield _text_of_scene(scene.name)


def of_rule(scene: Scene, rule: Discretisation) -> Iterator[str]:
    """A rule's facts, and the text of one of the bench's own; else the equations that it makes.

    What a user's file imports or reads is in the equations and the numbers, or has no effect; what
    the formula reads counts all the same, as a number that is asked for at each precision.
    """
    yield from _facts(rule)
    if rule.is_formula:  # another integrator says itself what it depends on
        yield reads(rule)
    if not (is_ours(rule) and is_ours(scene)):
        yield _derived(scheme_of(scene, rule))


def _facts(rule: Discretisation) -> Iterator[str]:
    base = rule.base if isinstance(rule, Composition) else rule
    yield repr((rule.name, rule.order, rule.stages, rule.splits, base.name, base.order))
    if rule.effective is not None:
        yield f"effective {rule.effective}"
    yield base.digest
    if isinstance(rule, Composition):
        method = rule.method
        yield f"{method.order} {method.in_turn} {method.coefficients(60)}"
    if is_ours(base):
        yield _text_of_rule(base)


def of_answer(about: Callable[[Scheme], Any], scene: Scene, rule: Discretisation) -> str:
    """Of what a function says about a scheme."""
    file = Path(inspect.getfile(about))  # it may be one that shows results
    shown = _digest(*(p.read_text("utf-8") for p in imported_files([file], views=True)))
    words = (
        about.__qualname__,
        str(versions()),
        processor(),
        text_of(str(file)),
        shown,
        rule.source,
    )
    return _digest(*words, *of_scene(scene), *of_rule(scene, rule))


def is_ours(thing: Scene | Discretisation) -> bool:
    """Whether the bench itself defines the scene or rule, values and composition aside."""
    if isinstance(thing, Lattice):
        return thing.name in systems.NAMES and systems.get(thing.name) is thing
    if isinstance(thing, Scene):
        own = scenes.get(thing.name) if thing.name in scenes.every_name() else None
        return own is not None and own.laws == thing.laws
    base = thing.base if isinstance(thing, Composition) else thing
    formula = base.formula
    return base.is_formula and str(formula.__module__).startswith("discmech.integrators.")


@lru_cache(maxsize=64)  # cases of one scheme ask in turn
def _derived(scheme: Scheme) -> str:
    """The equations of a step, the groupoid, the Lagrangian and the conserved quantities."""
    if isinstance(scheme, LatticeScheme):
        return text_key(scheme.system, _values_of(scheme.system))
    s, scene = scheme.s, scheme.scene
    if scene.in_numbers:  # its functions may read files and chance, as those of a program
        return reads(scene.numeric_hamiltonian, scene.gradient, pure=True)
    groups = scene.with_attitude() if any(q.attitude for q in scene.symmetries) else scene
    own = scene.discrete_lagrangian
    facts: list[Any] = [(q.kind, q.attitude, q.value, q.stretch) for q in scene.symmetries]
    facts.append((getattr(own, "order", None), getattr(own, "kept", None)))
    parts: list[Any] = [repr(facts)]
    if scheme.rule.is_formula:
        system = step_system(scheme.equations)
        parts += [system, _values_of(system), *scheme.equations.fields]
    if scene.lagrangian is not None:
        parts.append([s.phase_lagrangian, *s.force])
    if scene.contact is not None:  # gaps φ, or (φ, coordinates of its plane)
        gaps = s.evaluated(scene.contact, "its contact", s.position, s.parameters)
        for e in gaps:
            split = isinstance(e, (tuple, list))
            parts += ["gap", [e[0], *e[1]] if split else [e]]
    for q in scene.symmetries:
        x: Any = s.position
        if q.attitude:
            whole = scheme_of(groups, scheme.rule).s
            size = scene.groupoid.algebra.size  # type: ignore[attr-defined]
            x = whole.x.reshape(size, size)
        found = q.at(x, s.mu, s.parameters, s.h)
        parts += [q.name, list(found) if hasattr(found, "shape") else [found]]
    return text_key(*parts)


def _values_of(system: Any) -> str:
    """The constants of a step, which are numbers of a rule that no equation shows."""
    return repr([str(value(60)) for value in getattr(system, "constants", {}).values()])


def of_everything(*words: str) -> str:
    """Of some words and the whole text of the bench: for what tests the bench itself."""
    return _digest(*words, str(versions()), _text_of_all())


def of_views(*words: str) -> str:
    """Of some words and the text of all that shows results: for pictures."""
    return _digest(*words, _text_of_views(), version("matplotlib"))


@cache
def _text_of_views() -> str:
    files = sorted(p for folder in STUDIES for p in folder.rglob("*.py"))
    return _digest(*(p.read_text("utf-8") for p in files if _shows(p)))


@cache
def _text_of_all() -> str:
    folders = (ROOT / name for name in ("integrators", "reference", "studies", "tests/bench"))
    files = (p for folder in folders for p in sorted(folder.rglob("*")))
    return _digest(*(p.read_text("utf-8") for p in files if p.suffix in (".py", ".json", ".c")))


@cache
def text_of(file: str) -> str:
    """Digest of a module's text and of all of ours that it rests on, scenes and rules excepted."""
    base = (p for f in ("integrators", "reference") for p in sorted((ROOT / f).rglob("*.py")))
    files = [p for p in base if not _within(p, DATA)]
    files += imported_files([Path(file), ROOT / "studies" / "core" / "running.py"])
    files += sorted(Path(file).parent.glob("*.c"))  # what it compiles
    return _digest(*(f"{p.relative_to(ROOT)}\n{p.read_text(encoding='utf-8')}" for p in files))


def imported_files(files: Iterable[Path], views: bool = False) -> list[Path]:
    """These files and those of the same package that they import, also inside functions.

    views: with those that only show results.
    """
    seen, pending = set[Path](), [p.resolve() for p in files]
    while pending:
        file = pending.pop()
        if file not in seen and (views or not _shows(file)):
            seen.add(file)
            pending += _imports(file)
    return sorted(seen)


@cache
def _imports(file: Path) -> tuple[Path, ...]:
    """The files that one imports itself."""
    nodes = ast.walk(ast.parse(file.read_text(encoding="utf-8")))
    found = (_files(file, node) for node in nodes if isinstance(node, ast.ImportFrom))
    return tuple(path for several in found for path in several)


def _files(file: Path, node: ast.ImportFrom) -> Iterator[Path]:
    words = (node.module or "").split(".") if node.module else []
    if node.level:
        folder = file.parents[node.level - 1]
    elif words[0] == "discmech" and words[1:2] in (["studies"], ["tests"]):
        folder, words = ROOT, words[1:]
    else:
        return
    target = folder.joinpath(*words)
    for place in (target, *(target / alias.name for alias in node.names)):
        for path in (place.with_suffix(".py"), place / "__init__.py"):
            if path.is_file():
                yield path.resolve()


def _shows(file: Path) -> bool:
    of_a_study = file.parent.parent in STUDIES and any(map(file.match, VIEW_FILES))
    return _within(file, VIEWS) or of_a_study


def _within(file: Path, places: Iterable[Path]) -> bool:
    return any((ROOT / place) in (file, *file.parents) for place in places)


@cache
def _text_of_scene(name: str) -> str:
    """Of its file and of the scenes that it builds on, and of its table of reference digits."""
    file = ROOT / "integrators" / "scenes" / f"{name.replace('-', '_')}.py"
    files = [p for p in imported_files([file]) if p.parent == file.parent]
    table = ROOT / "reference" / "tables" / f"{name}.json"
    return _digest(*(p.read_text(encoding="utf-8") for p in [*files, table] if p.exists()))


@cache
def _text_of_rule(rule: Discretisation) -> str:
    """Of a file of several rules its function, what that calls there, and what is no function.

    Of a file of one kind all that is data in it and in what it imports. Comments and docstrings
    are no part.
    """
    file = ROOT.joinpath(*str(rule.formula.__module__).split(".")[1:]).with_suffix(".py")
    if file != ROOT / RULES[0]:
        files = [p for p in imported_files([file]) if _within(p, RULES[1:])]
        return "\n".join(ast.unparse(_without_docstrings(p)) for p in files)
    nodes = _without_docstrings(file).body
    functions = {node.name: node for node in nodes if isinstance(node, ast.FunctionDef)}
    wanted, named = set[str](), {str(rule.formula.__name__)}
    while named:
        wanted |= named
        within = (e for name in named for e in ast.walk(functions[name]))
        named = {e.id for e in within if isinstance(e, ast.Name) and e.id in functions} - wanted
    others = functions.keys() - wanted
    return "\n".join(ast.unparse(e) for e in nodes if getattr(e, "name", "") not in others)


def _without_docstrings(file: Path) -> ast.Module:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.FunctionDef) and ast.get_docstring(node) is not None:
            del node.body[0]
    return tree


def _digest(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()
