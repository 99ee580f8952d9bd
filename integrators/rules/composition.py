"""Compositions: rules of higher order from a rule and its adjoint, by substeps.

With Φ of order 1 or 2 and its adjoint Φ* (Hairer, Lubich, Wanner, II.4, V.3),

    Ψ_h = S_{γ_s h} ∘ … ∘ S_{γ_1 h},     S = Φ if it is self-adjoint, else Φ_{h/2} ∘ Φ*_{h/2},
    Ψ_h = Φ_{α_s h} ∘ Φ*_{β_s h} ∘ … ∘ Φ_{α_1 h} ∘ Φ*_{β_1 h}        (Blanes, Moan).

Coefficients are exact, or decimals to 64 digits. The free ones of a table are the published
decimals; the others were solved anew from the order conditions (tests evaluate them), and agree
with the published digits to the last one or two. One's own are a `Method` too, whose order is found
from its conditions (`order_conditions`).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial, wraps
from typing import Any, ClassVar, TypeAlias

from ..errors import BadInput, arguments_checked, check_name, shown, unknown
from ..numbers import LazyModule, sympy, working_digits
from ..numbers.types import Column, Expression, GivenVector, Letter, Mpf
from ..scene import Again, Scene
from .discretisation import Discretisation, GroupoidForRule, LagrangianForRule
from .order_conditions import MOST_ORDER, OwnNumbers, check_sum, read, said

mpmath = LazyModule("mpmath")

#: the name of a published method, or one's own coefficients
Coefficients: TypeAlias = Any


@dataclass(frozen=True)
class Substep:
    """A step of size coefficient(digits)·h by the rule, or by its adjoint."""

    coefficient: Callable[[int], Mpf]
    adjoint: bool = False


@dataclass(frozen=True)
class Method:
    """A composition's coefficients: γ for self-adjoint steps, or α, β for a rule and its adjoint.

    `halves(digits)`: the first half of the palindrome and its middle, as mpf; for `in_turn` they
    are β_1, α_1, β_2, …, and the palindrome has an even number of them. `OwnNumbers` are the
    complete list.
    """

    name: str
    order: int
    halves: Callable[[int], list[Mpf]]
    source: str
    in_turn: bool = False
    #: c of γ = 1/(c − c^{1/3}), c times, with 1 − cγ in the middle, which is exact; 0 for decimals
    jump: int = 0

    def coefficients(self, digits: int) -> list[Mpf]:
        """All coefficients in the order in which they are applied, as mpf."""
        half = self.halves(digits)
        if self.own is not None:
            return half
        return [*half, *reversed(half if self.in_turn else half[:-1])]

    @property
    def own(self) -> OwnNumbers | None:
        """The coefficients that a user gave; None for a published method."""
        return self.halves if isinstance(self.halves, OwnNumbers) else None

    @property
    def symmetric(self) -> bool:
        """True if the coefficients are a palindrome: then the method is self-adjoint."""
        return self.own is None or self.own.palindrome

    def order_over(self, of_base: int, self_adjoint: bool) -> int:
        """Return the order of the composition of a base of that order, self-adjoint or not."""
        if self.own is None:
            return max(of_base, self.order)
        if self.in_turn and not self_adjoint:
            return max(of_base, self.own.order_over(of_base))
        # both halves of a step are symmetric, even if the base is not
        symmetric = of_base + of_base % 2
        return max(of_base, replace(self.own, in_turn=False).order_over(symmetric))

    def defect(self, digits: int) -> Mpf:
        """Return the largest violation of Σ (α^i + (−1)^{i+1} β^i) = δ_{i1}, i ≤ order, as mpf.

        It is 0 for a user's own numbers, whose `order` comes from the conditions. It is necessary
        for Φ_{α_s h} ∘ Φ*_{β_s h} ∘ … to have that order for any Φ of order 1 (Hairer, Lubich,
        Wanner, III.3.4); a self-adjoint step has α = β = γ/2.
        """
        if self.own is not None:
            return mpmath.mpf(0)
        with working_digits(digits + 10):
            sizes = self.coefficients(digits)
            betas, alphas = sizes[0::2], sizes[1::2]
            if not self.in_turn:
                betas = alphas = [c / 2 for c in sizes]
            sums = [
                sum(a**i - (-b) ** i for a, b in zip(alphas, betas, strict=True))
                for i in range(1, self.order + 1)
            ]
            return max(abs(sums[0] - 1), *map(abs, sums[1:]))

    def substeps(self, self_adjoint: bool) -> tuple[Substep, ...]:
        """Return the substeps for a rule that is self-adjoint on its scene, or is not."""
        indices: Sequence[int] = range(len(self.coefficients(16)))
        if self.own is not None:  # a splitting may begin or end with a step of 0
            indices = [i for i in indices if self.own.numbers[i]]
        if self.in_turn:
            return tuple(
                Substep(partial(self._size, i, 1), i % 2 == 0 and not self_adjoint) for i in indices
            )
        both = (False,) if self_adjoint else (True, False)
        sizes = (partial(self._size, i, len(both)) for i in indices)
        return tuple(Substep(size, adjoint) for size in sizes for adjoint in both)

    def _size(self, index: int, divisor: int, digits: int) -> Mpf:
        with working_digits(digits + 10):
            return self.coefficients(digits)[index] / divisor


@dataclass(frozen=True)
class Composition(Discretisation):
    """A rule composed of steps of `base`; usable wherever a rule is.

    A scheme of it derives the base rule; its flow steps on (x, μ) and takes the substeps.
    """

    base: Discretisation = field(kw_only=True)
    method: Method = field(kw_only=True)  # type: ignore[misc]
    kind: ClassVar[str] = "composition"

    @property
    def of_step(self) -> Discretisation:
        """The base."""
        return self.base

    @property
    def asks_lagrangian(self) -> bool:  # type: ignore[override]
        """True if the base is in values of a Lagrangian."""
        return self.base.asks_lagrangian

    def applies(self, scene: Scene) -> bool:
        """Return True if the base can be used."""
        return self.base.applies(scene)

    def refusal(self, scene: Scene) -> str:
        """Return why the base does not exist on the scene."""
        return self.base.refusal(scene)

    def __reduce__(self) -> Again:
        """Return the pickled form: a user's own numbers, or the name."""
        if self.method.own is None:
            return super().__reduce__()
        return _made, (self.base, self.method, self.name)


def _halves(formula: Callable[..., list[Mpf]]) -> Callable[..., Callable[[int], list[Mpf]]]:
    """Decorator: `Method.halves` from a formula, which is evaluated with ten guard digits."""

    def with_arguments(*arguments: int) -> Callable[[int], list[Mpf]]:
        def halves(digits: int) -> list[Mpf]:
            with working_digits(max(digits, 64) + 10):
                return formula(*arguments)

        return halves

    return with_arguments


@_halves
def _jump(count: int) -> list[Mpf]:
    """Return γ₁ = 1/(c − c^{1/3}), c times, with 1 − cγ₁ in the middle: order 4 from order 2."""
    first = 1 / (count - mpmath.root(count, 3))
    return [*[first] * (count // 2), 1 - count * first]


@_halves
def _table(numbers: str) -> list[Mpf]:
    """Return the numbers, with the remainder to 1 in the middle of the palindrome."""
    first = [mpmath.mpf(n) for n in numbers.split()]
    return [*first, 1 - 2 * sum(first)]


@_halves
def _splitting(a: str, b: str) -> list[Mpf]:
    """Return β₁ = a₁, α₁ = b₁ − a₁, β₂ = a₂ − α₁, …: half of a palindromic splitting ABA."""
    flow_a, flow_b = ([mpmath.mpf(n) for n in part.split()] for part in (a, b))
    flow_b.append(mpmath.mpf(1) / 2 - sum(flow_b))
    sizes = [mpmath.mpf(0)]
    for pair in zip(flow_a, flow_b, strict=True):
        for total in pair:
            sizes.append(total - sizes[-1])
    return sizes[1:]


_HLW = "Hairer, Lubich, Wanner, Geometric Numerical Integration"
_BLANES_MOAN = "Blanes, Moan, J. Comput. Appl. Math. 142 (2002) 313-330, table 2"
_KAHAN_LI = "Kahan, Li, Math. Comp. 66 (1997) 1089-1099; " + _HLW
_SOFRONIOU = f"Sofroniou, Spaletta, Optim. Methods Softw. 20 (2005) 597-613; {_HLW}, V.3.2"

METHODS = {method.name: method for method in (
    Method("triple-jump", 4, _jump(2), f"{_HLW}, II.4.4; Creutz, Gocksch; Forest; Yoshida",
           jump=2),
    Method("suzuki", 4, _jump(4), f"{_HLW}, II.4.5; Suzuki (1990)", jump=4),
    Method("blanes-moan-4", 4, _splitting("""
        0.0792036964311957
        0.353172906049774
        -0.0420650803577197044759166922696745685688995160526154967467411906254""", """
        0.209515106613362
        -0.143851773179817469134513970208481911492218292343651085879701170101"""),
        _BLANES_MOAN, in_turn=True),
    Method("blanes-moan-6", 6, _splitting("""
        0.0502627644003922
        0.41351430042834828076420925325513811414968646452555280762447550992
        0.0450798897943974211608542852757026623955981398108019838182022248034
        -0.188054853819572834204124900735074375035274205588129870472198432869
        0.541960678450781754723292263234705650176816914276740213892356052082""", """
        0.148816447901042589908187280537323712859617258593004618985809501312
        -0.132385865767782209619702251588944972760032019791736300649795544695
        0.0673076046921852373718361905790506189051134050121833401599636071221
        0.432666402578172088198748915901779274874621282362445469752140618429"""),
        _BLANES_MOAN, in_turn=True),
    Method("kahan-li-6", 6, _table("""
        0.39216144400731413927925056
        0.332599136789359438599748634257274355737334098773451284105993895123
        -0.706246172557639359809964819634910351039340310785096975025591881622
        0.0822135962935508002314904488531569176963106415374638473939469154265"""),
        f"{_KAHAN_LI}, V.3.2 (order 6, 9 steps)"),
    Method("kahan-li-8", 8, _table("""
        0.13020248308889008087881763
        0.561162981775108384561964407682000102649863449709010242665473575232
        -0.389474962644847286408078593043166997128494533168809453036226203346
        0.158841906555155600896210746677682393213504632244490133487639718216
        -0.395903894133237577336231543466131671452409608454079979626428334096
        0.18453964097831570709183254336408651617500238840369353750011492037
        0.258374387686322047293979111695425973702570489166964789903620302064
        0.2950117236093102988709662367574629766212848310145695420771022881"""),
        f"{_KAHAN_LI}, V.3.2 (order 8, 17 steps)"),
    Method("sofroniou-spaletta-10", 10, _table("""
        0.0787957225216864192639076793376842482198638727665553966819252229421
        0.313096103415108527764812471926472696881054021870452330804409740805
        0.0279183832350780661095202732752988231186749257079171423012837497545
        -0.229592841593907094151213396796549875909924547236525029511804244475
        0.130962061077164863174656859279605412674738501568123390304678272802
        -0.269733405654510714344609732224111497115542051696265628481730811743
        0.0749733431558914356661371056414104123434139256711950939044778436576
        0.111993423999810204889575080736402058720887098426873161668508212058
        0.366133449546226751193148123531499082375253645625177256602217578765
        -0.399105630136035897878629810583404730395862387729557189506373725662
        0.103087398527471077315802770013724479179869985578339394166504744423
        0.411430873955890237820704118976078350507172767778858302085790326037
        -0.00486636058313526176219565930997706302040769200443878827478270902389
        -0.392033353708639906448081936426104269693819342339218306835781719356
        0.0519425029624496470371829040159757277497133836515403032516725359029
        0.0506650907599244963358743441568658941954362273771692348860450600788
        0.0496743706397298790545688002794611763445541575904432493242354085789"""),
        f"{_SOFRONIOU} (order 10, 35 steps)"),
)}  # fmt: skip


@arguments_checked
def compose(
    rule: Any,
    method: Coefficients,
    *,
    adjoint: GivenVector | None = None,
    order: int | None = None,
    name: str | None = None,
    source: str = "",
) -> Any:
    """Compose a rule of steps of a rule; given a scheme, return a scheme.

    method: a name of `METHODS`, and the rule is called name:rule, like kahan-li-8:midpoint; or your
    own coefficients γ₁, γ₂, …, Ψ_h = S_{γ_s h} ∘ … ∘ S_{γ_1 h}; or, with adjoint=[β₁, …], the α₁, …
    of Ψ_h = Φ_{α_s h} ∘ Φ*_{β_s h} ∘ … ∘ Φ_{α_1 h} ∘ Φ*_{β_1 h}. They are exact (whole numbers,
    fractions, sympy numbers, decimals of up to 14 places), or floats and longer decimals: if these
    satisfy order conditions as well as rounded numbers can, the nearby numbers that satisfy them to
    all digits are taken (`OwnNumbers`). The order follows from the conditions; a given order is
    checked against them. name, source: of the rule with your own coefficients.

    Raises `BadInput` for unknown names, for compositions of compositions, for coefficients that are
    complex, 0 or do not add up to 1, and for a wrong order, with the first violated condition.
    """
    if isinstance(getattr(rule, "rule", None), Discretisation):  # a scheme
        words: dict[str, Any] = {"adjoint": adjoint, "order": order, "name": name, "source": source}
        return type(rule)(rule.scene, compose(rule.rule, method, **words))
    named = isinstance(method, str)
    if named and method not in METHODS:
        raise unknown("composition", method, METHODS)
    _check_base(rule)
    if named:
        if source or any(e is not None for e in (adjoint, order, name)):
            raise BadInput(
                f"compose(…, {shown(method)}) is a published method: leave adjoint=, order=, "
                "name= and source= out."
            )
        entry = METHODS[method]
        return Composition(
            f"{method}:{rule.name}", rule.formula, entry.order, entry.source, rule.stages,
            rule.splits, base=rule, method=entry,
        )  # fmt: skip
    what = f"compose({rule.name}, …)"
    numbers, rounded = read(method, what)
    if adjoint is not None:
        more, beside = read(adjoint, f"{what}, adjoint=")
        if len(more) != len(numbers):
            raise BadInput(
                f"{what} has {len(numbers)} coefficients and {len(more)} of the adjoint: give as "
                "many, Φ and its adjoint in turn."
            )
        numbers = [e for pair in zip(more, numbers, strict=True) for e in pair]
        rounded = [e for pair in zip(beside, rounded, strict=True) for e in pair]
    if adjoint is None and 0 in numbers:
        raise BadInput(f"{what}: coefficient {numbers.index(0) + 1} is 0; leave it out.")
    over = rule.order or 1
    own = OwnNumbers(tuple(numbers), tuple(rounded), adjoint is not None,
                     over if adjoint is not None else over + over % 2)  # fmt: skip
    check_sum(f"{what}:", numbers, rounded)
    return with_own(what, rule, own, order, name, source)


def _check_base(rule: object) -> None:
    """Raise `BadInput` for a rule that cannot be composed."""
    if not isinstance(rule, Discretisation) or isinstance(rule, Composition):
        what = "a composition already" if isinstance(rule, Composition) else "no rule"
        raise BadInput(
            f"{shown(getattr(rule, 'name', rule))} is {what}: compose a rule of one step."
        )
    if not rule.is_formula:
        raise BadInput(
            f"{rule.name} is a program, whose adjoint nothing derives: compose its steps in it."
        )
    if not rule.composes:
        raise BadInput(f"{rule.name} has steps that vary: compose its rule, and vary that.")


def with_own(
    what: str, rule: Discretisation, own: OwnNumbers, order: int | None, name: str | None,
    source: str,
) -> Composition:  # fmt: skip
    """Return the composition with a user's own numbers; a given order is checked against them."""
    own_method = Method("own", own.order_over(own.over), own, source, own.in_turn)
    reached = own_method.order_over(rule.order or 1, not own.in_turn)
    label, why = described_own(what, own, reached, order, name)
    about = source or f"coefficients of one's own, order {reached}" + (f": {why}" if why else "")
    return _made(rule, replace(own_method, source=about), label if name else f"{label}:{rule.name}")


def described_own(
    what: str, own: OwnNumbers, reached: int, order: int | None, name: str | None
) -> tuple[str, str]:
    """Return (name, the first violated condition) of a user's own method with the order `reached`.

    Raises `BadInput` for a wrong name, and if a higher order was given.
    """
    if name is not None and name != "":
        check_name("rule", name, r"[\w.:-]{1,80}")
    if order is not None and (type(order) is not int or not 1 <= order <= MOST_ORDER):
        raise BadInput(
            f"{what}: order={shown(order)}; give a whole number from 1 to {MOST_ORDER}, the "
            "highest order whose conditions are asked."
        )
    missed = own.first_missed(MOST_ORDER)
    why = "" if missed is None else (
        f"the condition of order {sum(missed[0])}, {said(missed[0], own.in_turn)}, is missed by "
        f"{float(missed[1]):.3g}"
    )  # fmt: skip
    if order is not None and reached < order:
        raise BadInput(
            f"{what} of order {order}: {why}, so the order is {reached}; mend the coefficients, or "
            "leave order= out."
        )
    digest = hashlib.sha256(repr((own.numbers, own.in_turn)).encode()).hexdigest()[:4]
    return name or f"own-{len(own.numbers)}-{digest}", why


def _made(rule: Discretisation, method: Method, label: str) -> Composition:
    """Return the composition by a method with a user's own numbers."""
    order = method.order_over(rule.order or 1, not method.in_turn)
    return Composition(
        label, rule.formula, order, method.source, rule.stages, rule.splits, base=rule,
        method=method,
    )  # fmt: skip


def adjoint(rule: Discretisation) -> Discretisation:
    """Return the adjoint rule, L_d*(x, u; h) = −L_d(b(x, u), −ι(x, u); −h): Φ* = (Φ₋ₕ)⁻¹."""

    @wraps(rule.formula)
    def formula(
        L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter,
        *s: list[Column],
    ) -> Expression:  # fmt: skip
        # substitute after the rule has used letters: with expressions it might read other
        # coefficients
        value = sympy.sympify(rule.formula(L, G, x, u, h, *s)).doit()
        end, back = G.target(x, u, h), -G.inversion(x, u, h)
        swap = [*zip(x, end, strict=True), *zip(u, back, strict=True), (h, -h)]
        return -value.subs(swap, simultaneous=True)

    source = f"adjoint of {rule.name}: Marsden, West, Acta Numerica 2001, 2.4"
    # on a group it is no collocation: its polynomials are in the chart at the end of the step
    name = f"{rule.name}-adjoint"
    return replace(rule, name=name, formula=formula, source=source, nodes=None)
