"""Rules, scenes and problems of control by the words of a command.

A word is a name, FILE.py:NAME, or FILE.py for all in a file. NAME is that of an object, of its
variable or of a list of objects. FILE.py:NAME:w=1/6 gives a value to a number that a rule leaves
open, to an argument of a function that makes a rule or a scene, or to a parameter of a scene, its
duration or its step, as pendulum:length=2 does.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast

from discmech.integrators import BadInput, Discretisation, Lattice, Scene, hooks, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.errors import RAISED, misplaced, nearest, shown, unknown
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.extensions.steps import WAYS, vary
from discmech.integrators.numbers import sympy
from discmech.integrators.rules import METHODS, compose, with_parameters

from .parts import parts_of
from .userfile import UserFile, load, loaded

_Thing = TypeVar("_Thing", Discretisation, Scene)
_Answer = TypeVar("_Answer")
_Asked = TypeVar("_Asked")
#: sentences about objects that a file could not make, beside those that a word named with it, and
#: about files of which nothing can be used, beside other words
_LEFT_OUT: dict[str, None] = {}
_VALUE = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?(/\d+)?")


@dataclass(frozen=True)
class Kind:
    """A kind of objects that words name: its noun, those in a file, the bench's own by name."""

    noun: str
    in_file: Callable[[UserFile], Mapping[str, Any]]
    called: Callable[[str], Any]


def _problems() -> Any:
    """The problems of control that come with discmech, which few commands load."""
    from discmech.integrators.extensions.control import scenes as problems

    return problems


def _scene_called(word: str) -> Any:
    """Return the scene of that name, also of a problem of control, or the lattice."""
    problems = _problems()
    if word in problems.NAMES:
        return problems.get(word).scene
    if word in systems.NAMES:
        return systems.get(word)
    known = scenes.every_name()
    if word in known:
        return scenes.get(word)
    raise unknown("scene", word, (*known, *problems.NAMES, *systems.NAMES))


def _problems_in(file: UserFile) -> dict[str, Any]:
    from discmech.integrators import Control

    return {name: each for name, each in file.variables.items() if isinstance(each, Control)}


def boxes(rules: Iterable[Discretisation]) -> tuple[Scene, ...]:
    """Return the boxes of states on which maps are asked, if all the rules are such maps."""
    own = [getattr(rule, "own_scene", None) for rule in rules]
    return () if None in own else tuple(scene for scene in own if scene is not None)


RULE = Kind("rule", lambda file: file.rules, discretisations.get)
SCENE = Kind("scene", lambda file: file.scenes or {
    scene.name: scene for scene in boxes(file.rules.values())}, _scene_called)  # fmt: skip
CONTROL = Kind("Control(...)", _problems_in, lambda word: _problems().get(word))
_OTHER = {RULE: SCENE, SCENE: RULE}  # the kind that is taken for this one


def rules(words: Sequence[str]) -> tuple[Discretisation, ...]:
    """Return the rules that words such as these name, each once:

    midpoint, gauss-3, kahan-li-8:midpoint, my.py:two_thirds, triple-jump:my.py:two_thirds, my.py.
    Rules of one name get the values in their words behind it, or the names of their files before
    it. Raises `BadInput` for unknown names and for two rules of one name.
    """
    return _told_apart(RULE, words)


def scenes_of(words: Sequence[str]) -> tuple[Scene, ...]:
    """Return the scenes that words such as pendulum, my.py:my-scene, my.py name; like `rules`."""
    return _told_apart(SCENE, words)


def maps_of(words: Sequence[str]) -> tuple[Discretisation, ...]:
    """Return the maps with states of their own among what FILE.py[:NAME] words of scenes name."""
    files = ((file, name) for file, name in map(in_file, words) if file is not None)
    named = (rule for file, name in files
             for rule in ([_variable(file, name)] if name else file.rules.values()))  # fmt: skip
    return tuple(m for m in named if isinstance(m, Discretisation) and boxes([m]))


def named(word: str) -> tuple[tuple[Discretisation, ...], tuple[Scene, ...]]:
    """Return the rules and the scenes that a word names: of FILE.py all, of FILE.py:NAME by the
    name.

    Any other word is a rule's. Raises the errors of `rules`.
    """
    file, name = (None, word) if _is_made(word) else in_file(word)
    if file is None:
        return find(RULE, word), ()
    both = [kind for kind in (RULE, SCENE) if not name or _asked(file, kind, name)]
    both = both[:1] if isinstance(file.variables.get(name), Discretisation) else both
    if not both or not (name or file.rules or file.scenes):
        every = Kind("rule or scene", lambda file: {**file.scenes, **file.rules}, str)
        in_this(file, every, name)
    own = {kind: in_this(file, kind, name) for kind in both if name or kind.in_file(file)}
    return own.get(RULE, ()), own.get(SCENE, ())


def find(kind: Kind, word: str) -> tuple[Any, ...]:
    """Return the objects of a kind that a word names; raises `BadInput` if there are none."""
    method, _, base = word.partition(":")
    if kind is RULE and _is_made(word):
        make: Callable[[Any], Any] = lambda rule: (  # noqa: E731
            compose(rule, method) if method in METHODS else vary(rule, way=method)
        )
        return tuple(map(make, find(RULE, base)))
    file, name = in_file(word)
    if file is not None:
        return in_this(file, kind, name)
    return (_of_bench(kind, word),)


def rule(thing: Any) -> Discretisation:
    """Return a rule, or the one that a word names; raises `BadInput` for anything else."""
    return _given(thing, Discretisation, RULE)


def scene(thing: Scene | str) -> Scene:
    """Return `scene_given`, but raise `BadInput` for a lattice."""
    asked = scene_given(thing)
    if "sites" in parts_of(asked):
        word = thing if isinstance(thing, str) else asked.name
        raise BadInput(
            f"{asked.name} is a lattice: `discmech run {word}` runs it, and `discmech lattices "
            f"{word}` judges it."
        )
    return asked


def control(word: str) -> Any:
    """Return the optimal control problem of a built-in one's name, or of FILE.py:VARIABLE."""
    return find(CONTROL, word)[0]


def problem_named(word: str) -> Any:
    """The problem of control that a word names, by a built-in name or its variable; else None."""
    file, name = in_file(word)
    if file is None:
        return _problems().get(word) if word in _problems().NAMES else None
    return _problems_in(file).get(name)


def problems_of(scene: Scene) -> dict[str, Any]:
    """Return the problems of control with that scene, in any chart, by the names of their scenes.

    One problem has the name of the scene that is asked for, each of several that of its own scene
    (`_scene_of`).
    """
    problems = _problems()
    if scene.name in problems.NAMES and problems.get(scene.name).scene.laws == scene.laws:
        return {scene.name: problems.get(scene.name)}
    for file in reversed(loaded()):
        own = [(_scene_of(file, name).name, each) for name, each in _problems_in(file).items()
               if each.scene.laws == scene.laws]  # fmt: skip
        for named in (
            [pair for pair in own if pair[0] == scene.name],
            [pair for pair in own if pair[1].scene.name == scene.name],
            own,
        ):
            if len({problem for _, problem in named}) == 1:
                return {scene.name: named[0][1]}
            if named:
                return dict(named)
    return {}


def _scene_of(file: UserFile, name: str) -> Scene:
    """Return the scene of a problem in a file, with the name of the problem's variable if others
    have it too.
    """
    problem = file.variables[name]
    same = (problem.scene.name, problem.scene.laws)
    kin = {e for e in _problems_in(file).values() if (e.scene.name, e.scene.laws) == same}
    if len(kin) > 1 and name not in file.made:
        file.made[name] = problem.scene.with_values(name=name)
    return cast(Scene, problem.scene if len(kin) == 1 else file.made[name])


def scene_given(thing: Any) -> Scene:
    """Return a scene or lattice, or the one that a word names; raises `BadInput` otherwise."""
    kinds: Any = (Scene, Lattice)
    return _given(thing, kinds, SCENE)


hooks.scene_named.fill(lambda: scene_given)


def varied(
    of_scenes: Sequence[str], of_rules: Sequence[str], name: str, values: Sequence[str]
) -> tuple[tuple[Scene, ...], tuple[Discretisation, ...]]:
    """Return the scenes and the rules, of each that has a number of that name one for each value.

    It is an open number of a rule or an argument of what makes one, or else a parameter of a scene.
    Raises `BadInput` if nothing has it.
    """
    for kind, words in ((RULE, of_rules), (SCENE, of_scenes)):
        taking = {word: full for word in words if (full := _with_number(kind, word, name))}
        if not taking:
            continue
        things: dict[Any, None] = {}
        for word in words:
            if word not in taking:
                things |= dict.fromkeys(find(kind, word))
                continue
            full = taking[word]
            of = in_file(full)[1] or full
            for value in values:
                thing = only(kind, f"{full}{',' if '=' in of else ':'}{name}={value}")
                label = f"{of.partition(':')[0]}:{name}={value}"
                if kind is SCENE:  # whose name may be that of a file
                    label = label.replace(":", ".").replace("=", "-").replace("/", "_")
                things[replace(thing, name=label)] = None
        if kind is RULE:
            return scenes_of(of_scenes), tuple(things)
        return tuple(things), rules(of_rules)
    raise BadInput(
        f"--vary {name}: no rule that is named leaves {name} open, and no scene that is named has "
        f'a parameter {name}: declare it, @discretisation(parameters=("{name}",)), or take a '
        "parameter of the scene."
    )


def _with_number(kind: Kind, word: str, name: str) -> str:
    """Return the word of a single object that has a number of that name to be given; or ""."""
    file, inside = in_file(word)
    made = None if file is None else file.variables.get(inside)
    if isinstance(made, FunctionType):
        return word if name in inspect.signature(made).parameters else ""
    thing = only(kind, word)
    first = getattr(getattr(thing, "formula", None), "bound", (thing,))[0]
    full = word if inside or file is None else f"{word}:{thing.name}"
    return full if name in first.parameters else ""


def left_out(once: bool = True) -> list[str]:
    """Return, once, what is wrong with objects left out beside others of their file, and with
    files.
    """
    said = [*_LEFT_OUT]
    if once:
        _LEFT_OUT.clear()
    return said


def refused_in(words: Sequence[str]) -> list[str]:
    """Return why objects could not be made of the files that are among the words as a whole."""
    files = [load(word) for word in words if _is_whole_file(word)]
    return [*dict.fromkeys(said for file in files for said in file.refused.values())]


def _is_whole_file(word: str) -> bool:
    return word.endswith(".py") and Path(word).is_file()


def answers(
    words: Sequence[_Asked], ask: Callable[[_Asked], _Answer],
    beside: Callable[[Any], bool] = _is_whole_file,
) -> list[tuple[_Asked, _Answer]]:  # fmt: skip
    """Return the words, or the rules, with what `ask` finds for each.

    What cannot be used is left out beside others if `beside` says so. A whole file is, as a
    student's of a class; one that is not there is a mistake of the command itself. Raises
    `BadInput` if nothing stays.
    """
    pairs, lost = [], []
    for word in words:
        try:
            pairs.append((word, ask(word)))
        except BadInput as error:
            if not beside(word):
                raise
            lost.append(str(error))
    if lost and not pairs:
        raise BadInput(" ".join(lost))
    _LEFT_OUT.update(dict.fromkeys(lost))
    return pairs


def only(kind: Kind, word: str) -> Any:
    """Return the one object that a word names; raises `BadInput` for several, or one refused."""
    known = {*_LEFT_OUT}
    several = find(kind, word)
    if len(several) > 1:
        names = ", ".join(thing.name for thing in several)
        one, noun = f"{word}:{several[0].name}", kind.noun.replace("study", "studie")
        raise BadInput(f"{word} has several {noun}s ({names}): say {one}.")
    for said in {*_LEFT_OUT} - known:  # perhaps it was the one that is meant
        _LEFT_OUT.pop(said)
        raise BadInput(said)
    return several[0]


def _given(thing: Any, of: type[_Thing], kind: Kind) -> _Thing:
    if isinstance(thing, of):
        return thing
    if isinstance(thing, str):
        return only(kind, thing)
    if isinstance(thing, Scene | Discretisation):
        raise misplaced(thing.name, _OTHER[kind].noun, kind.noun)
    if kind is RULE and callable(thing):
        discretisations.check_rule(thing)  # the error says how a function becomes a rule
    raise BadInput(f"{shown(thing)} is no {kind.noun}: give one, or its name.")


def _told_apart(kind: Kind, words: Sequence[str]) -> tuple[Any, ...]:
    labels: dict[Any, tuple[str, str]] = {}  # the values in its word, and the stem of its file
    for word, things in answers(words, partial(find, kind)):
        path = word.partition(".py")[0] if ".py" in word else ""
        values = re.sub(r"[^\w.-]", "-", word.rpartition(":")[2]) if "=" in word else ""
        for thing in things:
            labels.setdefault(thing, (values, re.split(r"[/\\:]", path)[-1]))
    pairs = [*labels.items()]
    for of, form in enumerate(("{0}-{1}", "{1}-{0}")):
        taken = [thing.name for thing, _ in pairs]
        pairs = [
            (replace(thing, name=form.format(thing.name, label[of]))
             if label[of] and taken.count(thing.name) > 1 else thing, label)
            for thing, label in pairs
        ]  # fmt: skip
    each = [thing for thing, _ in pairs]
    names = [thing.name for thing in each]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(
                f'two {kind.noun}s are called {name}: give one of them another name="...".'
            )
    return tuple(each)


def _is_made(word: str) -> bool:
    """True for the word of a rule that is made of another one, such as triple-jump:midpoint."""
    method, colon, _ = word.partition(":")
    return bool(colon) and method in (*METHODS, *WAYS)


def _of_bench(kind: Kind, word: str) -> Any:
    """Return the bench's object of that name; raises `BadInput` for others, with their kind."""
    name, colon, values = word.partition(":")
    try:
        return (
            with_words(kind.called(name), values) if colon and kind is SCENE else kind.called(word)
        )
    except BadInput as error:
        said = error
    if kind in _OTHER:
        try:
            said = misplaced(_OTHER[kind].called(word).name, _OTHER[kind].noun, kind.noun, word)
        except BadInput:
            if word and Path(word).exists():  # an empty word is this folder's
                said = BadInput(f"{word} is no Python file: name a .py file with rules or scenes.")
                raise said from None
            for file in loaded():
                if word and _asked(file, kind, word):
                    own = f"{kind.noun} of that name: say {file.path}:{word}."
                    said = BadInput(
                        f"{word} is no {kind.noun} of discmech, but {file.path} has a {own}"
                    )
    raise said


def in_file(word: str) -> tuple[UserFile | None, str]:
    """Return (the file, the name in it) of FILE.py:NAME or FILE.py; no file for any other word."""
    path, colon, name = word.partition(".py:")
    path += ".py" if colon else ""
    if not path.endswith(".py"):
        return None, word
    method, colon, base = path.partition(":")
    if colon and not Path(path).exists() and Path(base).exists():
        raise unknown("composition", method, METHODS)
    return load(path), name


def in_this(file: UserFile, kind: Kind, name: str) -> tuple[Any, ...]:
    """Return the objects of that name, of its variable's, or in the list of that name; all without
    a name.

    Raises `BadInput` for a name that no object of this kind has.
    """
    own = kind.in_file(file)
    if name and (asked := _asked(file, kind, name)):
        entries = (each for each in file.refused if each.startswith(f"{name}["))
        _LEFT_OUT.update(dict.fromkeys(file.refused[each] for each in entries))
        return asked
    if name.replace("-", "_") in file.refused:
        raise BadInput(file.refused[name.replace("-", "_")])
    if kind in _OTHER and name:
        for other in _asked(file, _OTHER[kind], name):
            word = f"{file.path}:{name}"
            raise misplaced(other.name, _OTHER[kind].noun, kind.noun, word)
    if not name and own:
        _LEFT_OUT.update(dict.fromkeys(file.refused.values()))
        return tuple(own.values())
    if isinstance(file.variables.get(name), FunctionType):
        example = next(iter(file.variables[name].__code__.co_varnames), "w")
        raise BadInput(
            f"{file.path}: {name} is a plain function: decorate it, or, if it makes a {kind.noun}, "
            f"say its arguments, {file.path}:{name}:{example}=1."
        )
    if not own:
        lost = next(iter(file.refused.values()), "")  # perhaps it was one of this kind
        none = f"{file.path} defines no {kind.noun}"
        if kind in _OTHER and _OTHER[kind].in_file(file):
            none += ", but a " + ("rule: say --rule " if kind is SCENE else "scene: say ")
            none += f"{file.path}, beside a {kind.noun} such as "
            none += "pendulum" if kind is SCENE else "midpoint"
        raise BadInput(file.empty or lost or f"{none}.")
    near = nearest(name, own)
    there = f"there {'is' if len(own) == 1 else 'are'} {', '.join(own)}."
    hint = f"did you mean {near}?" if near else there
    raise BadInput(f'{file.path} has no {kind.noun} "{name}": {hint}')


def _variable(file: UserFile, name: str) -> Any:
    """Return the variable of that name in a file, or else the rule that has it as its name."""
    return file.variables.get(name, file.rules.get(name))


def _asked(file: UserFile, kind: Kind, name: str) -> tuple[Any, ...]:
    """Return the objects of a kind in a file that a name means there; none if it means none."""
    own, variable = kind.in_file(file), _variable(file, name)
    # of a Control(...), or of a map's own states
    thing = getattr(variable, "own_scene", None) or getattr(variable, "scene", None)
    if kind is SCENE and isinstance(thing, Scene):
        return (_scene_of(file, name) if name in _problems_in(file) else thing,)
    if several := [e for e in file.lists.get(name, ()) if e in own.values() or kind is _kind_of(e)]:
        return tuple(several)
    for each in (name, getattr(variable, "name", ""), name.replace("_", "-")):
        if each in own:
            return (own[each],)
    maker, colon, values = name.partition(":")
    if not colon or kind not in _OTHER:
        return ()
    if name not in file.made:
        made = file.variables.get(maker)
        if isinstance(made, FunctionType):
            file.made[name] = _made(file.path, made, values)
        elif bases := _asked(file, kind, maker):
            file.made[name] = with_words(bases[0], values)
    thing = file.made.get(name)
    return (thing,) if kind is _kind_of(thing) else ()


def _kind_of(thing: Any) -> Kind | None:
    if isinstance(thing, Discretisation):
        return RULE
    return SCENE if isinstance(thing, Scene | Lattice) else None


def _made(path: str, maker: FunctionType, values: str) -> Any:
    """Return what a user's function makes of the values; raises `BadInput` if it raises."""
    try:
        arguments = _arguments(values)
        return maker(*(v for name, v in arguments if not name), **{n: v for n, v in arguments if n})
    except RAISED as error:
        said = error if isinstance(error, BadInput) else f"{type(error).__name__}: {error}"
        raise BadInput(f"{path}: {maker.__name__}({values}) fails: {said}") from None


def with_words(thing: Any, values: str) -> Any:
    """Return a rule with values for its open numbers, or a scene with others for its own."""
    arguments = dict(_arguments(values))
    if isinstance(thing, Discretisation):
        return with_parameters(thing, arguments)
    arguments = {name: str(value) for name, value in arguments.items()}  # "1/3" is exact
    own = {name: arguments.pop(name) for name in [*arguments] if name in thing.parameters}
    return thing.with_values(**arguments, **({"parameters": own} if own else {}))


def _arguments(text: str) -> list[tuple[str, Any]]:
    """Return the pairs (name, or "", value) of w=1/6,n=3; a value is an exact number or a text."""
    pairs: list[tuple[str, Any]] = []
    for part in text.split(","):
        value: Any
        name, equals, value = part.rpartition("=")
        if _VALUE.fullmatch(value):
            exact = sympy.Rational(value)
            value = int(exact) if exact.q == 1 else exact
        pairs.append((name.strip() if equals else "", value))
    return pairs
