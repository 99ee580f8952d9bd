"""Rules and scenes by the words of a command: names, FILE.py:NAME, or FILE.py for all in a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

from discmech.integrators import BadInput, Discretisation, Lattice, Scene, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.errors import misplaced, nearest, shown, unknown
from discmech.integrators.rules import METHODS, Composition, compose
from discmech.integrators.scenes import lattices as systems
from discmech.integrators.steps import WAYS, Varied, vary

from .notebook import place_of
from .parts import parts_of
from .userfile import UserFile, load, loaded

_Held = TypeVar("_Held")
_Thing = TypeVar("_Thing", Discretisation, Scene)


def rules(words: Sequence[str]) -> tuple[Discretisation, ...]:
    """Return the rules that words such as these name, each once:

    midpoint, gauss-3, kahan-li-8:midpoint, my.py:two_thirds, triple-jump:my.py:two_thirds, my.py.
    Raises `BadInput` for unknown names and for two rules of one name.
    """
    found = dict.fromkeys(rule for word in words for rule in _rules(word))
    return _told_apart(found, "rules")


def scenes_of(words: Sequence[str]) -> tuple[Scene, ...]:
    """Return the scenes that words such as pendulum, my.py:my-scene, my.py name; like `rules`."""
    found = dict.fromkeys(scene for word in words for scene in _scenes(word))
    return _told_apart(found, "scenes")


def maps_of(words: Sequence[str]) -> tuple[Discretisation, ...]:
    """Return the maps with states of their own among what FILE.py:NAME words of scenes name."""
    files = (in_file(word) for word in words if ".py:" in word)
    named = (file.variables.get(name) for file, name in files if file is not None)
    return tuple(
        m for m in named if isinstance(m, Discretisation) and getattr(m, "own_scene", None)
    )


def named(word: str) -> tuple[tuple[Discretisation, ...], tuple[Scene, ...]]:
    """Return the rules and the scenes that a word names: of FILE.py all, of FILE.py:NAME by the
    name.

    Any other word is a rule's. Raises the errors of `rules`.
    """
    if word.partition(":")[0] in (*METHODS, *WAYS):
        return _rules(word), ()
    file, name = in_file(word)
    if file is None:
        return _rules(word), ()
    both: dict[str, Any] = {**file.scenes, **file.rules}
    called = of_file(file, both, name, "rule or scene")[0].name
    if not name:
        return tuple(file.rules.values()), tuple(file.scenes.values())
    rule, scene = file.rules.get(called), file.scenes.get(called)
    return (rule,) if rule else (), (scene,) if scene else ()


def rule(word: str) -> Discretisation:
    """Return the one rule of that name; raises `BadInput` if a file has several."""
    return _only(rules([word]), word, "rules")


def scene(thing: Scene | str) -> Scene:
    """Return `scene_given`, but raise `BadInput` for a lattice."""
    found = scene_given(thing)
    if "sites" in parts_of(found):
        word = thing if isinstance(thing, str) else found.name
        others = {
            "order": "end",
            "symplecticity": "form",
            "momentum": "momenta",
            "energy": "energy",
        }
        asked = ["lattices", *(study for study, part in others.items() if part in parts_of(found))]
        raise BadInput(
            f"{found.name} is a lattice: `discmech run {word}` runs it, and it is judged by "
            f"{', '.join(f'`discmech {study}`' for study in asked)}."
        )
    return found


def control(word: str) -> Any:
    """Return the optimal control problem of a built-in one's name, or of FILE.py:VARIABLE."""
    from discmech.integrators import Control
    from discmech.integrators.scenes import control as problems

    file, name = in_file(word)
    if file is None:
        return problems.get(word)
    held = {v: thing for v, thing in file.variables.items() if isinstance(thing, Control)}
    return of_file(file, held, name, "Control(...)")[0]


def problem_named(word: str) -> Any:
    """The problem of control that a word names, by a built-in name or its variable; else None."""
    from discmech.integrators import Control
    from discmech.integrators.scenes import control as problems

    file, name = in_file(word)
    if file is None:
        return problems.get(word) if word in problems.NAMES else None
    thing = file.variables.get(name)
    return thing if isinstance(thing, Control) else None


def problem_of(scene: Scene) -> Any:
    """Return the optimal control problem with that scene, in any chart; None if there is none."""
    from discmech.integrators import Control
    from discmech.integrators.scenes import control as problems

    if scene.name in problems.NAMES and problems.get(scene.name).scene.laws == scene.laws:
        return problems.get(scene.name)
    for file in reversed(loaded()):
        held = {v: thing for v, thing in file.variables.items() if isinstance(thing, Control)
                and thing.scene.laws == scene.laws}  # fmt: skip
        if len(set(held.values())) > 1:
            raise BadInput(
                f"{file.path}: {', '.join(held)} are problems of one scene, {scene.name}; give "
                "each a scene of its own (scene.with_values(name=...))."
            )
        if held:
            return next(iter(held.values()))
    return None


def rule_given(thing: Any) -> Discretisation:
    """Return a rule, or the one that a word names; raises `BadInput` for anything else."""
    return _given(thing, Discretisation, rule, "rule")


def scene_given(thing: Any) -> Scene:
    """Return a scene or lattice, or the one that a word names; raises `BadInput` otherwise."""
    kinds: Any = (Scene, Lattice)
    return _given(thing, kinds, lambda word: _only(scenes_of([word]), word, "scenes"), "scene")


def word_for(thing: Discretisation | Scene) -> str:
    """Return the word by which `rule` or `scene` finds it: with its file, if it comes from one."""
    file = file_of(thing)
    if file is not None:
        return f"{file.path}:{thing.name}"
    if isinstance(thing, Composition):
        return f"{thing.method.name}:{word_for(thing.base)}"
    if isinstance(thing, Varied) and thing.sigma is None:
        return f"{thing.way}:{word_for(thing.base)}"
    return thing.name


def address_of(thing: Discretisation | Scene) -> str:
    """Return the word by which a command finds it: `word_for`, or the file of a script or notebook.

    An object that neither a name nor a file gives again is called by its name (`is_found`).
    """
    word = word_for(thing)
    if file_of(thing) is not None or isinstance(thing, Composition):
        return word
    place = _place_of(thing)
    return word if place is None else f"{place}:{thing.name}"


def is_found(thing: Any) -> bool:
    """Return True if the word of `address_of` finds this very object, with its values.

    A scene may be in another chart, which an option of the command gives.
    """
    file = file_of(thing)
    if file is not None:
        return _alike({**file.scenes, **file.rules}[thing.name], thing)
    if isinstance(thing, Composition | Varied):
        return word_for(thing) in _words_over(thing.base) and is_found(thing.base)
    if _place_of(thing) is not None:
        return True
    try:
        kind = "rule" if isinstance(thing, Discretisation) else "scene"
        return _alike(_called(thing.name, kind), thing)
    except BadInput:
        return False


def _words_over(base: Discretisation) -> list[str]:
    return [f"{name}:{word_for(base)}" for name in (*METHODS, *WAYS)]


def _place_of(thing: Discretisation | Scene) -> str | None:
    function = getattr(thing, "formula", None) or getattr(thing, "lagrangian", None)
    return place_of(thing, function, _alike)


def _alike(held: Any, thing: Any) -> bool:
    """True if both are one object, but for a scene's chart."""
    if isinstance(held, Discretisation) and isinstance(thing, Discretisation):
        return held == thing
    if held is thing or not (isinstance(held, Scene) and isinstance(thing, Scene)):
        return held is thing
    names = [f.name for f in fields(thing) if f.name != "groupoid"]
    return all(getattr(held, name) == getattr(thing, name) for name in names)


def file_of(thing: Discretisation | Scene) -> UserFile | None:
    """Return the loaded file that defines it, or None; a scene may be in any chart."""
    for file in reversed(loaded()):
        if isinstance(thing, Discretisation):
            if file.rules.get(thing.name) == thing:
                return file
        elif (held := file.scenes.get(thing.name)) is not None and _same(held, thing):
            return file
    return None


def _same(held: Any, thing: Any) -> bool:
    """True if both are one system, except for values; a lattice is only itself."""
    laws = getattr(held, "laws", None)
    return held is thing or (laws is not None and laws == getattr(thing, "laws", None))


def _given(thing: Any, kind: type[_Thing], named: Callable[[str], _Thing], noun: str) -> _Thing:
    if isinstance(thing, kind):
        return thing
    if isinstance(thing, str):
        return named(thing)
    if isinstance(thing, Scene | Discretisation):
        raise misplaced(thing.name, "rule" if noun == "scene" else "scene", noun)
    if kind is Discretisation and callable(thing):
        discretisations.check_rule(thing)  # the error says how a function becomes a rule
    raise BadInput(f"{shown(thing)} is no {noun}: give one, or its name.")


def _rules(word: str) -> tuple[Discretisation, ...]:
    method, colon, base = word.partition(":")
    if colon and method in METHODS:
        return tuple(compose(rule, method) for rule in _rules(base))
    if colon and method in WAYS:
        return tuple(vary(rule, way=method) for rule in _rules(base))
    file, name = in_file(word)
    if file is None:
        return (_called(word, "rule"),)
    return of_file(file, file.rules, name, "rule")


def _scenes(word: str) -> tuple[Scene, ...]:
    file, name = in_file(word)
    if file is not None:
        thing = file.variables.get(name)
        # of a Control(...), or of a map's own states
        own = getattr(thing, "own_scene", None) or getattr(thing, "scene", None)
        return (own,) if isinstance(own, Scene) else of_file(file, file.scenes, name, "scene")
    return (_called(word, "scene"),)


def _called(word: str, kind: str) -> Any:
    """Return the rule or scene of that name; raises `BadInput` for others, with their kind."""
    get: dict[str, Callable[[str], Any]] = {"rule": discretisations.get, "scene": _scene_called}
    (other,) = {*get} - {kind}
    try:
        return get[kind](word)
    except BadInput as error:
        said = error
    try:
        said = misplaced(get[other](word).name, other, kind)
    except BadInput:
        if word and Path(word).exists():  # an empty word is this folder's
            said = BadInput(f"{word} is no Python file: name a .py file with rules or scenes.")
    raise said


def _scene_called(word: str) -> Any:
    """Return the scene of that name, also of a problem of control, or the lattice."""
    if word in scenes.every_name():
        return scenes.get(word)
    from discmech.integrators.scenes import control as problems

    if word in problems.NAMES:
        return problems.get(word).scene
    if word in systems.NAMES:
        return systems.get(word)
    raise unknown("scene", word, (*scenes.every_name(), *problems.NAMES, *systems.NAMES))


def in_file(word: str) -> tuple[UserFile | None, str]:
    """Return (the file, the name in it) of FILE.py:NAME or FILE.py; no file for any other word."""
    path, found, name = word.partition(".py:")
    path += ".py" if found else ""
    if not path.endswith(".py"):
        return None, word
    method, colon, base = path.partition(":")
    if colon and not Path(path).exists() and Path(base).exists():
        raise unknown("composition", method, METHODS)
    return load(path), name


def of_file(file: UserFile, held: Mapping[str, _Held], name: str, kind: str) -> tuple[_Held, ...]:
    """Return the objects of that name, of its variable's, or in the list of that name; all without
    a name.

    Raises `BadInput` for a name that no object of this kind has.
    """
    listed = file.variables.get(name)
    if isinstance(listed, list | tuple) and (
        several := tuple(e for e in held.values() if any(e is each for each in listed))
    ):
        return several
    variable = getattr(listed, "name", "")
    names = (name, variable, name.replace("_", "-"))
    others: dict[str, tuple[str, Mapping[str, Any]]]
    others = {"rule": ("scene", file.scenes), "scene": ("rule", file.rules)}
    other, theirs = others.get(kind, ("", {}))
    swapped = [n for n in names if n in theirs]
    if swapped and not {*names} & {*held}:
        raise misplaced(swapped[0], other, kind)
    if not held:
        raise BadInput(f"{file.path} defines no {kind}.")
    if not name:
        return tuple(held.values())
    asked = next((n for n in names if n in held), name)
    if asked not in held:
        near = nearest(asked, held)
        there = f"there {'is' if len(held) == 1 else 'are'} {', '.join(held)}."
        hint = f"did you mean {near}?" if near else there
        raise BadInput(f'{file.path} has no {kind} "{name}": {hint}')
    return (held[asked],)


def _told_apart(found: Mapping[Any, None], kind: str) -> tuple[Any, ...]:
    names = [thing.name for thing in found]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(f"two {kind} are called {name}: give one of them another name.")
    return tuple(found)


def _only(found: Sequence[_Thing], word: str, kind: str) -> _Thing:
    if len(found) > 1:
        names = ", ".join(thing.name for thing in found)
        raise BadInput(f"{word} has several {kind} ({names}): say {word}:{found[0].name}.")
    return found[0]
