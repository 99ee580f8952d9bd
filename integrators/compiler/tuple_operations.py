"""Text of the driver's vector operations, unrolled for the lengths of one scheme."""

from __future__ import annotations


def _each(length: int, term: str) -> str:
    """A tuple of the term for each index #."""
    return "(" + "".join(term.replace("#", str(i)) + ", " for i in range(length)) + ")"


def _load(name: str, length: int, start: int = 0) -> str:
    """A tuple of entries of an array, name[start] or name[j, start] on."""
    row = name if name.endswith(", ") else f"{name}["
    return "(" + "".join(f"{row}{start + i}], " for i in range(length)) + ")"


def vector_text(n: int, m: int, solved: int, kept: int, coefficients: int, affine: bool) -> str:
    """Operations on tuples: n = dim x, m = dim u, `kept` carried functions, c[i] coefficients.

    `solved` is what a step solves for: m, and m more for each internal stage.

    The state's layout is x, μ, their compensations, k, then (Newton only) five past solutions and
    the four numbers of the solver's memory.
    """

    lines = ["OK, NOT_CONVERGED, SINGULAR = 0, 1, 2", ""]
    lines += [f"def load_c(a):\n    return {_load('a', coefficients)}\n"]
    for letter, length in (("x", n), ("u", m)):
        body = "".join(f"    a[row, {i}] = v[{i}]\n" for i in range(length)) or "    pass\n"
        lines.append(f"def save_{letter}(a, row, v):\n{body}")
        lines.append(f"def accumulate_{letter}(a, d):")
        for i in range(length):
            lines.append(f"    s{i} = a[{i}] + d[{i}]")
        new, lost = _each(length, "s#"), _each(length, "(s# - a[#]) - d[#]")
        lines.append(f"    return {new}, {lost}\n")
    layout, at = [], 0
    for name, length in (("x", n), ("mu", m), ("ex", n), ("emu", m), ("k", kept)):
        layout.append((name, at, length))
        at += length
    memory = [(f"u{i}", at + i * solved, solved) for i in range(0 if affine else 5)]
    tail = at + 5 * solved
    loads = [_load("a", length, start) for name, start, length in layout]
    vectors = [_load("a", length, start) for _, start, length in memory]
    memo = _memo(vectors, [f"a[{tail + i}]" for i in range(4)]) if memory else "()"
    lines.append(f"def load_state(a):\n    return {', '.join(loads)}, {memo}\n")
    lines.append("def save_state(a, x, mu, ex, emu, k, memo):")
    for name, start, length in layout:
        lines += [f"    a[{start + i}] = {name}[{i}]" for i in range(length)]
    for number, (_, start, length) in enumerate(memory):
        lines += [f"    a[{start + i}] = memo[{number}][{i}]" for i in range(length)]
    if not affine:
        lines += [f"    a[{tail + i}] = memo[{5 + i}]" for i in range(4)]
    lines.append("")
    lines.append(f"def plus(a, b):\n    return {_each(solved, 'a[#] + b[#]')}\n")
    total = " + ".join(f"abs(a[{i}])" for i in range(solved))
    lines.append(f"def norm(a):\n    return {total}\n")
    total = " + ".join(f"abs(a[{i}] - b[{i}])" for i in range(solved))
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
        lines.append(f"    if order == {order}:\n        return {_each(solved, term)}")
    lines.append(f"    return {_each(solved, terms[-1])}\n")
    return _decorated(lines)


def _decorated(lines: list[str]) -> str:
    """The text of functions, those without a branch to be written as they stand."""
    texts = "\n".join(lines).split("def ")
    bodies = [f"@{'helper' if ' if ' in t else 'exact'}\ndef {t}" for t in texts[1:]]
    return "".join([texts[0], *bodies])


def _memo(vectors: list[str], numbers: list[str]) -> str:
    """The solver's memory: five past solutions, order and age (whole), kappa and scale."""
    order, age, kappa, scale = numbers
    return f"({', '.join(vectors)}, int({order}), int({age}), {kappa}, {scale})"


def memory_text(solved: int, coefficients: int, affine: bool) -> str:
    """For compositions: the coefficients and the solver's memory in row j of an array."""
    count = 0 if affine else 5
    vectors = [_load("a[j, ", solved, i * solved) for i in range(count)]
    tail = count * solved
    memo = "()" if affine else _memo(vectors, [f"a[j, {tail + i}]" for i in range(4)])
    lines = [f"def load_row_c(a, j):\n    return {_load('a[j, ', coefficients)}\n"]
    lines.append(f"def load_memo(a, j):\n    return {memo}\n")
    lines.append("def save_memo(a, j, memo):")
    for number in range(count):
        lines += [f"    a[j, {number * solved + i}] = memo[{number}][{i}]" for i in range(solved)]
    lines += [f"    a[j, {tail + i}] = memo[{5 + i}]" for i in range(4 if count else 0)]
    return _decorated([*lines, *([] if count else ["    pass"]), ""])


def whole_state_text(n: int, m: int, kept: int, kept_by_adjoint: int) -> str:
    """For compositions: x, μ, their compensations and the carried functions of both kinds."""
    names = ("x", "mu", "ex", "emu", "k", "k_of_adjoint")
    lengths = (n, m, n, m, kept, kept_by_adjoint)
    starts = [sum(lengths[:i]) for i in range(len(lengths))]
    loads = [_load("a", length, start) for length, start in zip(lengths, starts, strict=True)]
    lines = [f"def load_whole(a):\n    return {', '.join(loads)}\n"]
    lines.append(f"def save_whole(a, {', '.join(names)}):")
    for name, length, start in zip(names, lengths, starts, strict=True):
        lines += [f"    a[{start + i}] = {name}[{i}]" for i in range(length)]
    return _decorated([*lines, ""])


def state_length(n: int, m: int, solved: int, kept: int, affine: bool) -> int:
    """Entries of the state whose layout `vector_text` gives."""
    return 2 * (n + m) + kept + (0 if affine else 5 * solved + 4)
