"""`discmech modified SCENE RULE`: the modified Hamiltonian by powers of the step, checked."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from ..core import lookup
from ..core.options import digits_in, option_words, whole
from .explain import wrapped
from .options import add_rule, rule_asked, scene_asked
from .output import EXIT, progress_shown, write_json

if TYPE_CHECKING:
    from discmech.integrators import Discretisation, Scene, Scheme

    from ..modified.measuring import Kept

USUAL = 4  # power of the step, of rules of a lower order
TRIED = 7  # 1/7, 1/8, … are the open numbers of a rule in the runs that check its formulas
TAKEN = frozenset(("x", "t", "h", "f", "H", "mu", "μ"))  # letters of the formulas themselves
LONGEST = 4000  # letters of a formula that is printed


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "modified", help="the modified Hamiltonian of a method, by powers of the step, checked"
    )
    parser.add_argument("scene")
    add_rule(parser)
    parser.add_argument(
        "--order", metavar="K", help="the last power of h (default: 4, or the rule's order)"
    )
    parser.add_argument("--retraction", metavar="NAME")
    parser.add_argument("--digits", default="16", metavar="D")
    parser.add_argument("--latex", action="store_true", help="formulas as LaTeX")
    parser.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    parser.set_defaults(action=_modified)


def _modified(options: argparse.Namespace) -> int:
    from discmech.integrators import Scheme

    from ..core.case import Verdict
    from ..core.claims import not_claimed
    from ..modified.measuring import as_rows, below_order, judge, kept

    rule = rule_asked(options)
    asked = None if options.order is None else whole("--order", 12)(options.order)
    digits = digits_in(options.digits)
    with progress_shown("deriving") as show:
        show("deriving", 0.0)
        original = lookup.rule(rule)
        scene, method, letters = _in_letters(scene_asked(options), original)
        scheme = Scheme(scene, method)
        show("running", 0.3)
        order = max(USUAL, scheme.order or 0) if asked is None else asked
        record = kept(scheme, order, digits)
        show("writing formulas", 0.6)
        terms, missing = _formulas(scheme, record, original.left_open)
    verdict = judge(record)
    excused = verdict.verdict == "fail" and not below_order(record)
    if excused and (reason := not_claimed(scheme.rule, "symplectic")):
        verdict = Verdict("pass", f"{reason}. {verdict.reason}", {"not_demanded": reason})
    slopes = {f"through h^{j}": _last(record, j) for j in range(order + 1)}
    if options.json:
        words = option_words({"--order": order, "--retraction": options.retraction})
        words = ["discmech", "modified", scheme.scene.name, rule, *words]
        case = {
            "scene": scheme.scene.name, "rule": scheme.rule.name,
            "retraction": scheme.scene.groupoid.retraction, "digits": digits,
            "verdict": verdict.verdict, "reason": verdict.reason, "expected": verdict.expected,
            "measured": slopes, "rows": as_rows(record),
            "formulas": {name: str(e) for name, e in terms.items()},
            "command": shlex.join(words),
        }  # fmt: skip
        write_json(options.json, {"study": "modified", "verdict": verdict.verdict, "cases": [case]})
    if options.json != "-":
        lines = [*_page(scheme, record, terms, missing, options.latex), *letters]
        lines += ["", verdict.verdict + (f": {verdict.reason}" if verdict.reason else "")]
        sys.stdout.write("".join(f"{line.rstrip()}\n" for line in lines))
    return EXIT[verdict.verdict]


def _in_letters(scene: Scene, rule: Discretisation) -> tuple[Scene, Discretisation, list[str]]:
    """Return the scene with the rule's open numbers as parameters, the rule, and what is said."""
    from discmech.integrators.rules import of_scene

    values = {name: Fraction(1, TRIED + k) for k, name in enumerate(rule.left_open)}
    if not values:
        return scene, rule, []
    tried = ", ".join(f"{name} = {value}" for name, value in values.items())
    told = f"The formulas hold for every value; the runs that check them have {tried}."
    scene = replace(scene, parameters={**scene.parameters, **values})
    return scene, of_scene(rule), ["", told]


def _formulas(scheme: Scheme, record: Kept, left_open: Sequence[str]) -> tuple[dict[str, Any], str]:
    """Return ({name of a term: expression}, why there are no others).

    left_open: the open numbers of the rule, of which each coefficient becomes one fraction.
    """
    import sympy

    from discmech.integrators.errors import CannotMeasure
    from discmech.integrators.extensions.expansions.laurent import MOST_SECONDS, TooLong

    terms, missing = dict[str, Any](), ""
    letters = [getattr(scheme.s.parameters, name) for name in left_open]

    def collected(e: Any) -> Any:
        shares = dict[Any, Any]()
        for term in sympy.Add.make_args(sympy.expand(e)) if letters else ():
            rest, share = term.as_independent(*letters, as_Add=False)
            number, rest = rest.as_coeff_Mul()
            shares[rest] = shares.get(rest, 0) + number * share
        whole = sympy.Add(*(sympy.factor(c) * rest for rest, c in shares.items()))
        return sympy.factor_terms(whole if letters else e)

    for order in dict.fromkeys((record.first, record.order)):
        try:
            equation = scheme.modified_equation(order).formulas
        except TooLong:
            after = f" after h^{record.first}" if terms else ""
            missing = f"The terms{after} take longer than {MOST_SECONDS:g} s to write; a scene of "
            missing += "fewer degrees of freedom may have them. Numbers of all of them, in Python: "
            missing += f"scheme.modified_equation({order}).hamiltonian(z) at states z = (x, μ)."
            break
        except CannotMeasure as error:
            missing = f"Formulas are not written: {error} Numbers of all terms: "
            return {}, f"{missing}scheme.modified_equation(order).hamiltonian(z)."
        names = scheme.equations.s.mu
        if equation.hamiltonian is None:
            states = [*scheme.equations.s.x, *names]
            terms |= {
                f"f_{j}[{state}]": collected(e)
                for j, field in enumerate(equation.field, 1)
                for state, e in zip(states, field, strict=True)
            }
            missing = "A one-step map has no discrete Lagrangian: these are its modified fields."
            continue
        terms |= {f"H_{j}": collected(e) for j, e in enumerate(equation.hamiltonian, 1)}
    return {name: e for name, e in terms.items() if e != 0}, missing


def _page(
    scheme: Scheme, record: Kept, terms: dict[str, Any], missing: str, latex: bool
) -> list[str]:
    import sympy

    from discmech.integrators.flows.latex import letter, parameter_names

    from .equations import letters_of, plain_text, subscript

    title = (
        f"{scheme.scene.name} by {scheme.rule.name}: the modified equation up to h^{record.order}"
    )
    lines = [title, "=" * len(title), ""]
    whole = "f̃ = f₁ + h f₂ + h² f₃ + …" if "f_1" in " ".join(terms) else "H̃ = H₁ + h H₂ + h² H₃ + …"
    lines += [f"{whole}; terms that are not listed are 0:"] if terms else []
    letters = letters_of(scheme) | parameter_names(scheme, TAKEN)
    named = {symbol: sympy.Symbol(name) for symbol, name in letters.items()}
    latex_names = {symbol: letter(str(symbol)) for symbol in named.values()}
    for label, e in terms.items():
        name, value = _in(letters, label), sympy.sympify(e)
        if latex:
            value = value.xreplace(named)
            shown = sympy.latex(value, symbol_names=latex_names, mul_symbol=r"\,")
            lines.append(f"{letter(name)} = {shown}")
            continue
        shown = plain_text([value], letters)
        if len(shown) > LONGEST:
            shown = f"({len(shown)} letters; --json FILE has them)"
        lines += wrapped(f"{subscript(name)} = {shown}")
    lines += [missing] if missing else []
    lines += ["", "Change of the sum along runs to one time, by step"]
    heads = [f"{h:.4g}" for h in record.steps]
    lines.append("  up to  " + "".join(f"{head:>11}" for head in heads) + "      slope  wanted")
    for j in range(record.order + 1):
        slope = _last(record, j)
        text = "round-off" if slope is None else f"{slope:.2f}"
        wanted = f"≥ {record.wanted[j]}" if j >= record.first else f"{record.first}"
        errors = "".join(f"{error:>11.2e}" for error in record.errors[j])
        lines.append(f"  h^{j:<5}{errors} {text:>10}  {wanted}")
    return lines


def _in(letters: Mapping[Any, str], label: str) -> str:
    """Return a label such as f_3[x_0] with the letter that formulas have, which count from 1."""
    known = {str(each): name for each, name in letters.items()}
    letter, bracket, state = label.rstrip("]").partition("[")
    return f"{letter}[{known.get(state, state)}]" if bracket else label


def _last(record: Kept, j: int) -> float | None:
    return slopes[-1] if (slopes := record.slopes(j)) else None
