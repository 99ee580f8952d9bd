"""The functions that a Lagrangian may hold, by their names here and in generated text."""

#: sympy function → name in the generated text; each exists in math, numpy-like and gmpy2 worlds
FUNCTIONS = {
    "sin": "sin", "cos": "cos", "tan": "tan", "asin": "asin", "acos": "acos", "atan": "atan",
    "atan2": "atan2", "sinh": "sinh", "cosh": "cosh", "tanh": "tanh", "exp": "exp", "log": "log",
    "Abs": "abs",
}  # fmt: skip
