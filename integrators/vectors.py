"""Text of the driver's vector operations, unrolled for the lengths of one scheme."""

from __future__ import annotations


def vector_text(n: int, m: int, kept: int, coefficients: int, affine: bool) -> str:
    """Operations on tuples: n = dim x, m = dim u, `kept` carried functions, c[i] coefficients.

    The state's layout is x, μ, their compensations, k, then (Newton only) five past solutions and
    the four numbers of the solver's memory.
    """

    def each(length: int, term: str) -> str:
        return "(" + "".join(term.replace("#", str(i)) + ", " for i in range(length)) + ")"

    def load(name: str, length: int, start: int = 0) -> str:
        terms = "".join(f"a[{start + i}], " for i in range(length))
        return f"({terms})"

    lines = ["OK, NOT_CONVERGED, SINGULAR = 0, 1, 2", ""]
    lines += [f"def load_c(a):\n    return {load('c', coefficients)}\n"]
    for letter, length in (("x", n), ("u", m)):
        body = "".join(f"    a[row, {i}] = v[{i}]\n" for i in range(length)) or "    pass\n"
        lines.append(f"def save_{letter}(a, row, v):\n{body}")
        lines.append(f"def accumulate_{letter}(a, d):")
        for i in range(length):
            lines.append(f"    s{i} = a[{i}] + d[{i}]")
        new, lost = each(length, "s#"), each(length, "(s# - a[#]) - d[#]")
        lines.append(f"    return {new}, {lost}\n")
    layout, at = [], 0
    for name, length in (("x", n), ("mu", m), ("ex", n), ("emu", m), ("k", kept)):
        layout.append((name, at, length))
        at += length
    memory = [(f"u{i}", at + i * m, m) for i in range(0 if affine else 5)]
    tail = at + 5 * m
    loads = [load(name, length, start) for name, start, length in layout]
    memo = "()"
    if not affine:
        vectors = [load(name, length, start) for name, start, length in memory]
        memo = (
            f"({', '.join(vectors)}, int(a[{tail}]), int(a[{tail + 1}]), "
            f"a[{tail + 2}], a[{tail + 3}])"
        )
    lines.append(f"def load_state(a):\n    return {', '.join(loads)}, {memo}\n")
    lines.append("def save_state(a, x, mu, ex, emu, k, memo):")
    for name, start, length in layout:
        lines += [f"    a[{start + i}] = {name}[{i}]" for i in range(length)]
    for number, (_, start, length) in enumerate(memory):
        lines += [f"    a[{start + i}] = memo[{number}][{i}]" for i in range(length)]
    if not affine:
        lines += [f"    a[{tail + i}] = memo[{5 + i}]" for i in range(4)]
    lines.append("")
    lines.append(f"def plus(a, b):\n    return {each(m, 'a[#] + b[#]')}\n")
    total = " + ".join(f"abs(a[{i}])" for i in range(m))
    lines.append(f"def norm(a):\n    return {total}\n")
    total = " + ".join(f"abs(a[{i}] - b[{i}])" for i in range(m))
    lines.append(f"def distance(a, b):\n    return {total}\n")
    lines.append("def predict(order, u1, u2, u3, u4, u5):")
    terms = [
        "u1[#]",
        "2*u1[#] - u2[#]",
        "3*(u1[#] - u2[#]) + u3[#]",
        "4*(u1[#] + u3[#]) - 6*u2[#] - u4[#]",
        "5*(u1[#] - u4[#]) + 10*(u3[#] - u2[#]) + u5[#]",
    ]
    for order, term in enumerate(terms[:-1]):
        lines.append(f"    if order == {order}:\n        return {each(m, term)}")
    lines.append(f"    return {each(m, terms[-1])}\n")
    return "\n".join(lines).replace("def ", "@helper\ndef ")


def state_length(n: int, m: int, kept: int, affine: bool) -> int:
    """Entries of the state whose layout `vector_text` gives."""
    return 2 * (n + m) + kept + (0 if affine else 5 * m + 4)
