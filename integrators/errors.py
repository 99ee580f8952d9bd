"""Exceptions of this project, each one sentence with cause and fix, and their finders."""

from __future__ import annotations

import ast
import inspect
import linecache
import re
import sys
import traceback
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from difflib import get_close_matches
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import Any, ParamSpec, SupportsFloat, TypeVar, cast

_Class = TypeVar("_Class")
_P = ParamSpec("_P")
_R = TypeVar("_R")
_OURS = Path(__file__).resolve().parent
#: from Python 3.14 on a signature evaluates annotations, which may name what nobody has imported
_ANNOTATIONS: dict[str, Any] = {}
if sys.version_info >= (3, 14):
    _ANNOTATIONS["annotation_format"] = import_module("annotationlib").Format.STRING


#: exceptions of a user's function that are reported in our words; an interrupt is not one of them
RAISED = (Exception, SystemExit, GeneratorExit)


class DiscmechError(Exception):
    """Base of every exception that this project raises on purpose."""


class BadInput(DiscmechError, ValueError):
    """The input cannot be used as it is: the message names it and says how to fix it."""


class CouldNotRun(DiscmechError, RuntimeError):
    """The machine does not allow it: disk, memory, rights. The message says what to do."""


def line_of(function: object, error: BaseException | None = None) -> str:
    """Return the place of a user's function, or of an error in its file, as "my_rule.py, line 7".

    It is empty for functions of this package.
    """
    made: Any = function  # such as a rule with letters for its numbers
    code = getattr(inspect.unwrap(made) if callable(made) else made, "__code__", None)
    if code is None or Path(code.co_filename).is_relative_to(_OURS):
        return ""
    line = code.co_firstlineno
    for frame, number in traceback.walk_tb(error.__traceback__ if error else None):
        line = number if frame.f_code.co_filename == code.co_filename else line
    return f"{Path(code.co_filename).name}, line {line}"


def at_line(function: object, error: BaseException | None = None) -> str:
    """Return the beginning of a message about a user's function, its place and a colon, or ""."""
    place = line_of(function, error)
    return f"{place}: " if place else ""


def nearest(name: object, known: Iterable[str]) -> str:
    """Return the known name most like the given one, in any capitals; empty without one."""
    small = {word.lower(): word for word in known}
    return "".join(small[near] for near in get_close_matches(_word(name).lower(), small, 1))


def _word(name: object) -> str:
    """Return a given name as it is written without quotation marks."""
    if not isinstance(name, str):
        return shown(name)
    return name if len(name) <= LISTED else f"{shown(name)[1 : LISTED // 2]}…"


def misplaced(name: str, kind: str, wanted: str, word: str = "") -> BadInput:
    """Return the error for a scene in a rule's place, or a rule in a scene's place.

    word: the word of a command that names it.
    """
    such = {"rule": "midpoint", "scene": "pendulum"}[wanted]
    command = f"; a study is asked by `discmech order {such} --rule {word}`"
    return BadInput(
        f"{name} is a {kind}, where a {wanted} is asked for: swap the two, or name a {wanted} "
        f"such as {such}{command if word and wanted == 'scene' else ''}."
    )


LISTED = 240  # letters of three lines of a terminal: a longer list does not fit into a sentence


#: studies that test the bench itself: they are among the tests, which are not installed
OF_THE_BENCH = ("charts", "power", "references", "savings")


#: names in the field, and the name here of the rule that makes those steps
CALLED_HERE = {
    "symplectic-euler": "rectangle", "semi-implicit-euler": "rectangle",
    "leapfrog": "trapezoidal", "verlet": "trapezoidal", "velocity-verlet": "trapezoidal",
    "strang": "trapezoidal", "euler": "explicit-euler", "forward-euler": "explicit-euler",
    "rk2": "heun", "rk4": "runge-kutta-4", "gauss-legendre": "gauss-2", "gl4": "gauss-2",
    "gl6": "gauss-3", "avf": "average-vector-field",
    "yoshida": "triple-jump:trapezoidal", "yoshida-4": "triple-jump:trapezoidal",
    "forest-ruth": "triple-jump:trapezoidal",
}  # fmt: skip
#: methods of the field that are no rule here
NOT_HERE = {
    "implicit-euler": "Z - z - h*s.f(Z)", "backward-euler": "Z - z - h*s.f(Z)",
    "crank-nicolson": "Z - z - h*(s.f(z) + s.f(Z))/2",
}  # fmt: skip


def unknown(kind: str, name: object, known: Iterable[str]) -> BadInput:
    """Return the error for an unknown name: with what it means here, the nearest, or all if few."""
    names = list(known)
    listed = ", ".join(names)
    usual = re.sub(r"[\s_–-]+", "-", _word(name).lower())
    if kind == "rule" and usual in CALLED_HERE:
        hint = f"it is called {CALLED_HERE[usual]} here."
    elif kind == "rule" and usual in NOT_HERE:
        hint = f"in a file it returns {NOT_HERE[usual]} under @one_step(implicit=True)."
    elif kind in ("study", "command") and _word(name) in OF_THE_BENCH:
        hint = f"it tests the bench itself: say discmech {name} in a checkout of the repository."
    elif near := nearest(name, names):
        hint = f"did you mean {near}?"
    elif len(listed) <= LISTED:
        hint = f"there are {listed}."
    else:
        hint = f"there are {', '.join(names[:3])} and {len(names) - 3} more: say discmech list."
    return BadInput(f'there is no {kind} "{_word(name)}": {hint}')


#: messages of Python, numpy or sympy about a function that was called with symbols, and the fix
_REMEDIES = (
    (r"Can't calculate derivative wrt (.*)\.",
     "differentiate by letters of your own and replace them by the point afterwards, or take "
     "L.gradient(y) for the slope of the potential"),
    (r"has no callable (\w+) method", r"write it with sympy functions: sympy.\1, not numpy's"),
    (r"Cannot convert expression to float|must be real number",
     "write it with sympy functions, such as sympy.cos in place of math.cos"),
    ("truth value", "symbols answer no if, sign or maximum: write one smooth formula"),
    (r"operand type\(s\) for \^", "a power is ** in Python, as in v[0]**2"),
    ("SimpleNamespace.* not subscriptable", "the parameters are p, and one of them is p.name"),
    ("SimpleNamespace",
     "the third argument is p, the parameters, one of them p.name; the time is a fourth, t"),
    ("NDimArray", "x and u are sympy's columns: write x + h*u/2 as it is, without numpy"),
    ("[Ii]ndex.* out of range", "fix it: of n entries the last is number n - 1"),
    ("No module named", "import it at the top of its file: only while that runs its folder counts"),
    ("positional argument", "give every function its arguments, no more and no fewer"),
    ("and 'list'", "s is a list of columns, s[0] the first"),
    (r"Matrix size mismatch: \(\d+, 1\) \+ ",
     "where x and u are not of one size (x ends with the time), a point is no sum of them: write "
     'G.target(x, u, h/2); groupoids="pair" leaves out scenes that are on no pairs'),
    (r"'MutableDenseMatrix'|NonSquareMatrix|mismatch: \(\d+, 1\) \* ",
     "points and velocities are columns: take an entry, as in sympy.cos(x[0]), or v.dot(v)"),
)  # fmt: skip


def remedy(error: BaseException) -> str:
    """Return the fix for an error that a user's function raised when called with symbols."""
    for pattern, words in _REMEDIES:
        if match := re.search(pattern, f"{type(error).__name__}: {error}"):
            return match.expand(words)
    return "write it with sympy functions" if isinstance(error, TypeError) else "fix it"


def check_function(function: object, what: str, *wanted: str) -> None:
    """Raise `BadInput` unless it can be called with the arguments of one of the `wanted`.

    Also if an argument has the name of another one: a constraint (x, v, p) would get the parameters
    as its v and the time as its p.
    """
    words = " or ".join(wanted)
    if not callable(function):
        raise BadInput(f"{what} is {shown(function)}; give a function of {words}.")
    signature = signature_of(function)
    if signature is None:
        return
    stray = ""
    for arguments in wanted:
        with suppress(TypeError):
            names = signature.bind(*arguments.strip("()").split(", ")).arguments
            wrong = [(own, word) for own, word in names.items() if _is_stray(own, word, names)]
            if not wrong:
                return
            stray = stray or ", whose {} would be {}".format(*wrong[0])
    raise BadInput(
        f"{at_line(function)}{what} is a function of {signature}{stray}; write it with {words}."
    )


def _is_stray(own: str, word: object, names: Container[str]) -> bool:
    """Return True if a function calls p, t or v what is handed in as something else.

    Of a Hamiltonian the momentum may be called p, v may be the second of two points u and v, and
    the number of steps that are done may have any name. So may a tuple of all that is handed in.
    """
    if not isinstance(word, str) or word in (own, "mu", "done"):
        return False
    return own in ("p", "t") or (own == "v" and "x" in names)


def shown(value: object) -> str:
    """Return a value for a message: as Python writes it, cut if it is long.

    Python writes no whole number of more than 4300 digits.
    """
    try:
        text = repr(value)
    except Exception:  # for a number of many digits, or an error in a user's class
        return f"of type {type(value).__name__} and too long to be written"
    return text if len(text) <= LISTED else f"{text[:LISTED]}…"


def check_parameters(parameters: object, name: str) -> None:
    """Raise `BadInput` unless they are a dictionary by names that can be written as p.name."""
    if not isinstance(parameters, Mapping):
        raise BadInput(f"{name}: parameters is {shown(parameters)}; give a dictionary.")
    for key in parameters:
        if not str(key).isidentifier():
            raise BadInput(f"{name}: parameter {shown(key)} is no name; use letters and _.")
        if str(key).startswith("__"):  # such as __class__, which every object of Python has
            raise BadInput(f"{name}: parameter {shown(key)} begins with __, as names of Python do; "
                           "choose another name.")  # fmt: skip


def check_name(thing: str, name: object, signs: str = r"[\w.-]{1,80}") -> None:
    """Raise `BadInput` unless the name of a thing has letters, digits, dots and dashes alone."""
    if not isinstance(name, str) or not re.fullmatch(signs, name):
        raise BadInput(
            f"a {thing}'s name is {shown(name)}: use letters, digits, dots and dashes in "
            'name="...".'
        )


def check_progress(progress: object) -> None:
    """Raise `BadInput` unless it can be called with the steps done so far, or is None."""
    if progress is not None:
        check_function(progress, "progress=", "(done)")


def brief_name(thing: object) -> str:
    """Return a thing's name for a message, or the thing as it is written, as a lambda in a file."""
    name = getattr(thing, "__name__", None) or getattr(thing, "name", None) or shown(thing)
    return name if name != "<lambda>" else _text_of_lambda(thing) or "of a lambda"


def _text_of_lambda(function: Any) -> str:
    """Return the text of a lambda in quotation marks, in one line; "" if no file has it."""
    code = function.__code__
    with suppress(SyntaxError, AttributeError):
        for node in ast.walk(ast.parse("".join(linecache.getlines(code.co_filename)))):
            if isinstance(node, ast.Lambda) and node.lineno == code.co_firstlineno:
                one = node.body
                place = one.lineno, one.end_lineno, one.col_offset, one.end_col_offset
                if place in code.co_positions():
                    text = ast.unparse(node)
                    return f'"{text}"' if len(text) <= LISTED else f'"{text[:LISTED]}…"'
    return ""


_STEPS = "steps=, how many: the time over the flow's step"
OF_FILE = r"[A-Za-z0-9][\w.-]*"  # the signs of a name that is a file's, too
#: other programs' names for a field of a scene or an argument, and the name or hint here
_ALSO_CALLED = {
    "constraint": ("holonomic= for φ(x) = 0, nonholonomic= for A(x) ξ = 0, contact= for φ(x) ≥ 0",),
    "potential": ("lagrangian=, kinetic minus potential energy",),
    "hamiltonian": ("lagrangian=; a method for H is a one-step map, @one_step",),
    **dict.fromkeys(("damping", "dissipation", "drag"), ("force=lambda x, v, p: [...]",)),
    "t": ("lagrangian=lambda x, v, p, t: ...", _STEPS),
    "q0": ("x0=",),
    "p0": ("v0=, from which the momentum follows", "mu0="),
    "T": ("duration=", _STEPS),
    "t_end": ("duration=", _STEPS),
    "duration": (_STEPS,),
    "n": ("steps=",),
    "N": ("steps=",),
    "h": ("step=",),
    "dt": ("step=",),
    "tol": ("tolerance=",),
    "rtol": ("tolerance=, relative to the motion's size",),
    "precision": ("digits=",),
    "v0": ("mu0=, the momentum; of another velocity scheme.at(v0=...).flow(...)",),
    "conserved": ("symmetries=",),
    "retraction": ("scene=SCENE.with_retraction(...)",),
}


def names_checked(cls: type[_Class]) -> type[_Class]:
    """Decorator of a dataclass: a field given by a name that it does not have is `BadInput`."""
    names = [f.name for f in fields(cast(Any, cls)) if f.init]
    made: Any = cls.__init__

    @wraps(made)
    def checked(self: object, *arguments: Any, **named: Any) -> None:
        check_names(cls.__name__, named, names)
        made(self, *arguments, **named)

    cls.__init__ = checked  # type: ignore[method-assign]
    return cls


def signature_of(function: Callable[..., Any]) -> inspect.Signature | None:
    """Return the signature of a callable with its annotations as texts; None if it has none."""
    try:
        return inspect.signature(function, **_ANNOTATIONS)
    except Exception:  # compiled ones have none, and an object may raise anything
        return None


def arguments_checked(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Decorator: an argument by a name that the function does not have is `BadInput`.

    Names are checked only if the call fails, so that it costs nothing elsewhere.
    """
    names = [name for name in inspect.signature(function).parameters if name != "self"]

    @wraps(function)
    def checked(*arguments: _P.args, **named: _P.kwargs) -> _R:
        try:
            return function(*arguments, **named)
        except TypeError:
            check_names(function.__name__, named, names)
            raise

    return checked


def check_names(what: str, named: Iterable[str], names: Sequence[str]) -> None:
    """Raise `BadInput` for a name that is not among the arguments' names."""
    if word := min(set(named) - set(names), default=""):
        known = [f"{near}=" for near in get_close_matches(word, names, 1, 0.75)]
        for said in _ALSO_CALLED.get(word, ()):
            if said.partition("=")[0] in names:
                known = [said]
        say = f"say {known[0]}" if known else f"it has {', '.join(names)}"
        raise BadInput(f"{what}({word}=...): there is no {word}=; {say}.")


class CannotMeasure(BadInput):
    """The quantity does not exist for this scene (an energy without a Legendre inverse, say)."""


class NoElements(CannotMeasure):
    """A rule asks for group elements on a groupoid whose arrows are no matrices."""


class NotDecided(CannotMeasure):
    """Neither an answer nor a proof that there is none: the message says what was tried."""


SMALLER = "take a smaller step"


class StepFailure(DiscmechError, RuntimeError):
    """A trajectory stopped before its last step.

    Attributes: scene, rule (names), step_index (int), time (float), state (dict with x, mu and, for
    an implicit scheme, the u from which Newton started), cause (str), trajectory (`Trajectory` up
    to the failure, or None), fix (str).

    look: finds cause and fix when they are first read; most runs that fail inside a study are only
    counted, and finding the direction of a singular matrix costs more than the run.
    """

    def __init__(
        self,
        scene: str,
        rule: str,
        step_index: int,
        time: float,
        state: dict[str, Any],
        cause: str,
        trajectory: Any = None,
        fix: str = SMALLER,
        *,
        look: Callable[[], tuple[str, str]] | None = None,
    ) -> None:
        super().__init__()
        self.scene, self.rule, self.step_index, self.time = scene, rule, step_index, time
        self.state, self.trajectory, self._told, self._look = state, trajectory, (cause, fix), look

    @property
    def cause(self) -> str:
        """The reason why no step could be made, in words."""
        return self._seen()[0]

    @property
    def fix(self) -> str:
        """The advice on what to try."""
        return self._seen()[1]

    def _seen(self) -> tuple[str, str]:
        if self._look is not None:
            self._told, self._look = self._look(), None
        return self._told

    @property
    def sentence(self) -> str:
        """What happened, for those who have no exception at hand, as on a command line."""
        shown = ", ".join(f"{name} = {_brief(value)}" for name, value in self.state.items())
        return (
            f"{self.scene} with {self.rule}: {self.cause} at step {self.step_index}, "
            f"t = {self.time:.6g} ({shown}); {self.fix}."
        )

    def __str__(self) -> str:
        return f"{self.sentence[:-1]}, or look at the trajectory kept on this exception."

    @property
    def mend(self) -> str:
        """The earlier name of `fix`."""
        return self.fix

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the parts to pickle it between processes."""
        at = (self.scene, self.rule, self.step_index, self.time, self.state)
        return type(self), (*at, self.cause, self.trajectory, self.fix)


class Displaced(StepFailure):
    """The answer to a run begins elsewhere than at the start that was asked: it is of other steps.

    It is a fault of the method wherever it is seen.
    """


def _brief(values: Iterable[SupportsFloat]) -> str:
    return "[" + ", ".join(f"{float(value):.6g}" for value in values) + "]"
