"""A black box: an integrator that is a function of numbers, with its author's claims."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, TypeVar

from ...errors import BadInput, CannotMeasure, arguments_checked, check_name, shown
from ...groupoids import pair
from ...numbers import exact_rational
from ...numbers.types import Exact, Function, Given, Vector
from ...rules import Claims, Discretisation
from ...rules.discretisation import checked
from ...scene import Scene, reads
from .box_scheme import BoxScheme
from .signatures import METHODS, check_arguments, functions_of
from .states import STATES, State

_Given = TypeVar("_Given")

#: the numbers that a box computes with: they determine its unit of round-off and its digits
NUMBERS = ("double", "any", "float32")
OF_MAPS = ("symplecticity", "reversibility")  # the studies of a map without h


@dataclass(frozen=True)
class BlackBox(Discretisation):
    """An integrator that is a program: it can replace a rule anywhere, but its formulas are
    unknown.

    `formula` is the function (q, p, h, system) → (q, p), or a class with `start`, `step` and `read`
    for a method that remembers more than (q, p). See `black_box` for the fields.
    """

    claims: Claims | None = field(default_factory=Claims)
    state: str = "qp"
    runs: bool = False
    numbers: str = "double"
    jacobian: Function | None = None
    gradient: Function | None = None
    scalar: Function | None = None
    read: Callable[[Vector, Vector], tuple[Vector, Vector]] | None = None
    write: Callable[[Vector, Vector], tuple[Vector, Vector]] | None = None
    vectorised: bool = False
    step: Exact | None = None
    states: tuple[tuple[Exact, ...], ...] = ()
    kind: ClassVar[str] = "program"
    is_formula: ClassVar[bool] = False  # its steps are the output of a program
    asks_lagrangian: ClassVar[bool] = False
    composes: ClassVar[bool] = False

    @property
    def digest(self) -> str:
        """Its text, the objects that the text reads, and its claims.

        Raises `Opaque` if it may read something that is not in any Python object.
        """
        return f"{self.said} {reads(self.formula, *self.beside, pure=True)}"

    @property
    def beside(self) -> tuple[Callable[..., Any] | None, ...]:
        """The Python functions beside the formula that its states and claims come from."""
        return self.jacobian, self.gradient, self.scalar, self.read, self.write

    @property
    def said(self) -> str:
        """The claims and options of its author, as text."""
        return repr((self.claims, self.state, self.runs, self.numbers, self.vectorised, self.step,
                     self.states))  # fmt: skip

    @property
    def form(self) -> State:
        """The form of its states (`STATES`)."""
        return STATES[self.state]

    @property
    def own_coordinates(self) -> bool:
        """True if its numbers are other ones than x and μ, such as those of a quaternion."""
        return self.read is not None or self.form.has_attitude

    @property
    def follows_motion(self) -> bool:
        """False for a map without h."""
        return self.step is None

    def step_for(self, size: Exact) -> Exact:
        """Return the one step of a map without h, for any size."""
        return self.step or size

    @property
    def remembers(self) -> bool:
        """True if it is a class, whose state is more than (q, p)."""
        return inspect.isclass(self.formula)

    @property
    def repeats(self) -> bool:
        """True if a run is its step again and again: not of a class, nor of whole runs."""
        return not (self.remembers or self.runs)

    @cached_property
    def own_scene(self) -> Scene | None:
        """The scene of a map on a box of states: the space of states alone, with no motion of it.

        Its start is the middle of the box. None for a box without `states`.
        """
        if not self.states:
            return None
        middle = [(low + high) / 2 for low, high in zip(*self.states, strict=True)]
        n = len(middle) // 2
        return Scene(
            name=f"states-of-{self.name}", groupoid=pair(n), lagrangian=no_motion, x0=middle[:n],
            v0=middle[n:], duration=100 * (self.step or 1), step=self.step or 1,
        )  # fmt: skip

    @property
    def long_run(self) -> int:
        """The number of steps of a long run: fewer if each is a Python call."""
        return 10**6 if self.runs else 10**5

    def runs_at(self, digits: int) -> bool:
        """Return True if the box can compute with that many digits."""
        return digits == 16 or self.numbers == "any"

    def unit(self, digits: int) -> float:
        """Return the unit of round-off of its numbers; in single precision it is 2⁻²⁴."""
        return 2.0**-24 if self.numbers == "float32" else super().unit(digits)

    def unmeasured(self, study: str) -> str:
        """Return why a study cannot measure it: what asks for formulas, or, of a map of one step,
        whose motion is no scene's, what asks for a run.
        """
        if self.step is not None and study not in OF_MAPS:
            return (
                f"{self.name} is a map of one step: only its form, volume and way back are judged "
                "(discmech symplecticity, discmech reversibility)."
            )
        if study == "extremes":
            return (
                f"{self.name} is a program, and the study extremes runs formulas at the edge of a "
                "scene: the other studies judge it."
            )
        return ""

    def refusal(self, scene: Scene) -> str:
        """Return a sentence that says why the box cannot run on the scene, or ""."""
        if refusal := scene.refusal_of("a black box", rule=self.name):
            return refusal
        if scene.lagrangian is no_motion and (own := self.own_scene) and own.name != scene.name:
            return f"{scene.name} is no box of states of {self.name}, which has {own.name}."
        return super().refusal(scene) or self.form.refusal(scene)

    def discretise(self, scene: Scene) -> BoxScheme:
        """Return the box on a scene, the result of `Scheme(scene, box)`, with a map's own step, and
        with the attitude where it is a part of its state.
        """
        if refusal := self.refusal(scene):
            raise CannotMeasure(refusal)
        scene = self.form.scene(scene)
        return BoxScheme(scene if self.step is None else scene.with_values(step=self.step), self)

    def __call__(self, *arguments: Any) -> Any:
        """Call the function or the class itself."""
        return self.formula(*arguments)


@arguments_checked
def black_box(
    order: int | None = None,
    *,
    symplectic: bool | None = None,
    reversible: bool | None = None,
    keeps: str | Sequence[str] = (),
    state: str = "qp",
    runs: bool = False,
    numbers: str = "double",
    jacobian: Function | None = None,
    gradient: Function | None = None,
    scalar: Function | None = None,
    vectorised: bool = False,
    step: Given | None = None,
    states: Sequence[Sequence[Given]] | None = None,
    read: Callable[[Vector, Vector], tuple[Vector, Vector]] | None = None,
    write: Callable[[Vector, Vector], tuple[Vector, Vector]] | None = None,
    name: str | None = None,
    source: str = "",
    groupoids: str | Sequence[str] = (),
) -> Callable[[Function], BlackBox]:
    """Decorator: judge a function of numbers (q, p, h, system) → (q, p) like a rule.

    q (n,) and p (m,) are numpy arrays: the scene's x and μ, p in the natural basis (on a pair
    groupoid the momentum ∂L/∂v). `system` may be left out; it is the scene in numbers
    (`SceneInNumbers`): f, H, gradient, velocity, force, momentum, parameters, t. The arrays must
    not be changed in place.

    Claims are judged, everything else is only measured: order; symplectic (the Poisson bracket is
    preserved; on a pair groupoid the canonical form); reversible (a step of −h undoes a step of h);
    keeps: some of "energy" (by each step), "energy band", "volume" and names of the scene's own
    quantities.

    state="qv": the box takes and returns velocities in place of momenta; "Rp", "Rv", "quaternion p"
    and "quaternion v": on a scene of `lie_group(so(3))` it moves the body's attitude too, R (3, 3)
    from the body to space, or the unit quaternion (w, x, y, z), beside p or v in the body; then
    `system` takes R or the quaternion for q. runs=True: the function is (q, p, h, steps, every,
    system) → arrays (rows, n) and (rows, m); the first row is the start, then there is one row
    every `every` steps. numbers="any": the box also works on mpmath numbers in object arrays, and
    is judged at 50 digits as well; "float32": it computes in single precision. jacobian(q, p, h,
    system): the derivative of the step, (n+m, n+m), in place of differences, of a program on (q, p)
    alone, or of a map, whose h is its `step`. gradient(q, p, h, steps, system): the derivative of
    the end of a run, (n+m, n+m) by its start, or a dict of derivatives by "start" and by the names
    of parameters (n+m, …); with scalar(q, p), a number, that of this number of the end.
    vectorised=True: the box also takes arrays q (n, k) and p (m, k), k states at once as columns,
    as `system` does; this is used where many states are needed, for differences and closed curves.
    step=0.1: it is a map of one step alone, such as the turn of a ring or a learned map, and the
    function is (q, p, system); its form, its way back and its volume are judged, and not whether
    its motion is the scene's. states=(lowest, highest): two lists of (q, p), between which such a
    map without any scene is judged. write(x, mu) → (q, p) and read(q, p) → (x, mu) convert to and
    from the box's own coordinates.

    A class has start(q, p, h, system) → state, step(state, h, system) → state and read(state,
    system) → (q, p). Raises `BadInput` for claims and functions of another kind.
    """
    where = checked("black_box", "black box", order, 0, groupoids)
    _one_of("state", state, STATES)
    _one_of("numbers", numbers, NUMBERS)
    flags = {"runs": runs, "vectorised": vectorised}
    for word, flag in flags.items():
        if not isinstance(flag, bool):
            raise BadInput(f"black_box({word}=...): {word} is True or False, not {shown(flag)}.")
    functions = {"jacobian": jacobian, "gradient": gradient, "scalar": scalar, "read": read,
                 "write": write}  # fmt: skip
    for word, function in functions.items():
        if function is not None and not callable(function):
            raise BadInput(f"black_box({word}=...): {word} is a function, not {shown(function)}.")
    if (read is None) != (write is None):
        raise BadInput("black_box: give both read= and write=, the way back and the way there.")
    if scalar is not None and gradient is None:
        raise BadInput("black_box(scalar=...): it is what gradient= derives: give that too.")
    for word in ("jacobian", "gradient"):
        if functions[word] is not None and (state != "qp" or read is not None):
            raise BadInput(
                f"black_box({word}=...): it is a derivative by (q, p), and this program has a "
                "state or coordinates of its own: write the program on (q, p), or leave it out."
            )
    only = _only_step(step, order, runs)
    corners = _corners(states, only)
    claims = Claims.of("black_box", None, symplectic, reversible, keeps)
    if only is not None and (kept := sorted({*claims.keeps} - {"volume"})):
        raise BadInput(
            f"black_box(keeps={kept[0]!r}): of a map of one step the form, the way back and the "
            "volume are judged, and nothing else that it keeps: leave it out, or leave step out."
        )
    if not isinstance(source, str):
        raise BadInput(f"black_box(source=...): source is a text, not {shown(source)}.")

    def make(formula: Function) -> BlackBox:
        label = _checked(formula, name, runs, only is not None)
        about = source or (inspect.getdoc(formula) or "")
        return BlackBox(
            label, formula, order, about, groupoids=where, claims=claims, state=state, runs=runs,
            numbers=numbers, jacobian=jacobian, gradient=gradient, scalar=scalar, read=read,
            write=write, vectorised=vectorised, step=only, states=corners,
        )  # fmt: skip

    return make


def no_motion(x: Any, v: Any, p: Any) -> Any:
    """Return the Lagrangian of a space of a map's states, which stands for no motion."""
    return v.dot(v) / 2


def _only_step(step: Given | None, order: int | None, whole: bool) -> Exact | None:
    """Return the one step of a map as an exact number; raises `BadInput` for another kind of it."""
    if step is None:
        return None
    size = exact_rational(step, "step")
    if size <= 0:
        raise BadInput(f"black_box(step={shown(step)}): a map's step is a positive number.")
    if order is not None or whole:
        raise BadInput(
            "black_box(step=...): a map of one step is a function (q, p, system) without an order, "
            "a memory or runs of its own: leave these out, or leave step out."
        )
    return size


def _corners(states: Any, step: Exact | None) -> tuple[tuple[Exact, ...], ...]:
    """Return the lowest and the highest (q, p) of a box of states, exact; () without one."""
    if states is None:
        return ()
    wrong = "black_box(states=...): give the lowest and the highest (q, p), two lists of 2n numbers"
    if not isinstance(states, Sequence) or len(states) != 2 or step is None:
        raise BadInput(f"{wrong}, of a map with step=...")
    low, high = (tuple(exact_rational(e, "states") for e in end) for end in states)
    if len(low) != len(high) or not low or len(low) % 2:
        raise BadInput(f"{wrong}.")
    if any(a >= b for a, b in zip(low, high, strict=True)):
        raise BadInput(f"{wrong}, each number of the first below that of the second.")
    return low, high


def _one_of(word: str, value: object, known: Iterable[str]) -> None:
    if not isinstance(value, str) or value not in known:
        choices = " or ".join(map(repr, known))
        raise BadInput(f"black_box({word}={shown(value)}): {word} is {choices}.")


def given_name(name: object, otherwise: str) -> Any:
    """Return a name, or the other where none is given, or an empty one; `_checked` judges it."""
    return otherwise if name is None or (isinstance(name, str) and not name) else name


def _checked(formula: object, name: str | None, runs: bool, is_map: bool = False) -> str:
    """Return the name of a box; raises `BadInput` unless it is a fit function or class."""
    if not callable(formula):
        raise BadInput(
            f"a black box is a function (q, p, h, system) or a class with start, step and read, "
            f"not {shown(formula)}."
        )
    own = str(getattr(formula, "__name__", "black-box")).replace("_", "-").strip("<>")
    label = given_name(name, own)
    check_name("black box", label)
    if inspect.isclass(formula):
        if runs or is_map:
            word = "runs" if runs else "step"
            raise BadInput(
                f"black box {label}: a class has start, step and read: leave {word} out."
            )
        for method, wanted in METHODS.items():
            if not callable(getattr(formula, method, None)):
                raise BadInput(
                    f"black box {label}: the class has no {method}{wanted}; a method with memory "
                    "has start, step and read."
                )
    for part, (function, wanted, bound) in functions_of(formula, runs, is_map).items():
        check_arguments(f"black box {label}: {part}", function, wanted, bound)
    return label
