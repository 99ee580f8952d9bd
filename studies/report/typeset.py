"""Words and numbers for LaTeX and for the mathematics of a figure."""

from __future__ import annotations

import re

_TEX = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_TEX |= {character: "\\" + character for character in "&%$#_{}"}
_TEX |= {"±": r"$\pm$", "≤": r"$\le$", "≥": r"$\ge$", "—": "---", "·": r"$\cdot$", "√": r"$\surd$"}
_TEX |= {"|": r"$|$", "‖": r"$\|$", "<": "$<$", ">": "$>$", "–": "--"}
_TEX |= {"μ": r"$\mu$", "Γ": r"$\Gamma$", "π": r"$\pi$", "ω": r"$\omega$", "ε": r"$\varepsilon$"}
_TEX |= {"ξ": r"$\xi$", "α": r"$\alpha$", "β": r"$\beta$", "γ": r"$\gamma$", "θ": r"$\theta$"}
_TENS = re.compile(r"(?:(-?[\d.]+)×)?10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
_SEAM = re.compile(r"(?<!\\)\$\$")  # one formula ends where the next begins
_SUBSCRIPT = re.compile("[₀₁₂₃₄₅₆₇₈₉]+")
_SUPERSCRIPT = re.compile("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")
_FROM_SUPER = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_FROM_SUB = str.maketrans("₀₁₂₃₄₅₆₇₈₉", "0123456789")
_TO_SUPER = {new: old for old, new in _FROM_SUPER.items()}
_TO_SUB = {new: old for old, new in _FROM_SUB.items()}


def _indices(text: str) -> str:
    """Unicode powers of ten, subscripts and superscripts as dollar-mathematics."""

    def tens(match: re.Match[str]) -> str:
        mantissa = f"{match[1]}\\times " if match[1] else ""
        return f"${mantissa}10^{{{match[2].translate(_FROM_SUPER)}}}$"

    text = _TENS.sub(tens, text)
    text = _SUBSCRIPT.sub(lambda m: f"$_{{{m[0].translate(_FROM_SUB)}}}$", text)
    return _SUPERSCRIPT.sub(lambda m: f"$^{{{m[0].translate(_FROM_SUPER)}}}$", text)


def tex(text: str) -> str:
    """The same words for LaTeX: special characters escaped, powers of ten as mathematics."""
    text = _indices("".join(_TEX.get(character, character) for character in text))
    return _SEAM.sub("", text.replace("×", r"$\times$"))


def figure_text(text: str) -> str:
    """The same words for a figure; a dollar sign stays one, a bar does not touch its letter."""
    words = _indices(text.replace("\\", "\\\\").replace("$", r"\$"))
    return _SEAM.sub("", words.replace("|", r"$\,|\,$"))


def page_text(text: str) -> str:
    """The words of a figure again from their mathematics; what is not from here stays as it is."""
    found = text.replace(r"\,|\,", "\u2009|\u2009").replace(r"\times ", "×").replace(r"\times", "×")
    found = re.sub(r"\^\{([-\d]+)\}", lambda m: m[1].translate(_TO_SUPER), found)
    found = re.sub(r"_\{(\d+)\}", lambda m: m[1].translate(_TO_SUB), found)
    if re.search(r"\$[^$]*[\\^_][^$]*\$", found.replace(r"\$", "")):
        return text
    return re.sub(r"\\([\\$])", r"\1", re.sub(r"(?<!\\)\$", "", found))
