"""C by the standard of 1999: a file that is compiled, or included, beside a program."""

from __future__ import annotations

import re
from collections.abc import Sequence
from textwrap import fill

from .exported import STATUSES, Exported, constants, head, used_fields
from .printer import Printer

FILE = """/*
{head}
*/

#include <math.h>

/* What step() returns, lengths of the fields of a state, numbers of the rule and of its solver. */
enum {{ {integers} }};
{numbers}
{arrays}

/* Where each parameter stands in the state's q; a list has its entries one after another. */
enum {{ {places} }};

/* The state. What a program reads and writes: x, mu, and the parameters in q, before start(). */
typedef struct {{
{fields}
}} state;

{functions}

/* The scene's own parameters and start. */
void begin(state *s)
{{
    static const double x[{n}] = {x}, mu[{m}] = {mu};
    static const double parameters[{p}] = {parameters};
    for (int i = 0; i < {count}; i++)
        s->q[1 + i] = parameters[i];
    for (int i = 0; i < N; i++)
        s->x[i] = x[i];
    for (int i = 0; i < M; i++)
        s->mu[i] = mu[i];
    start(s);
}}

/* What a status says. */
const char *told(int status)
{{
    static const char *words[] = {{
        {words}
    }};
    return words[status];
}}
"""

HARNESS = r"""
/* One JSON line in and one out for each run: {"x": [...], "mu": [...], "h": ..., "steps": ...,
   "every": ..., "parameters": {...}}, and "t" where the time is explicit. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *wrong; /* the key that has not as many numbers as it has to */

/* Read the numbers of a key, if it is there: return 1, or 0 if it is not. */
static int numbers(const char *line, const char *key, double *out, int count)
{
    const char *at = line ? strstr(line, key) : NULL;
    if (!at)
        return 0;
    at += strlen(key);
    for (int i = 0; i < count; i++) {
        char *end;
        at += strspn(at, " [],:");
        out[i] = strtod(at, &end);
        if (end == at)
            wrong = key;
        at = end;
    }
    at += strspn(at, " ],[");
    if (*at && strchr("+-.0123456789", *at))
        wrong = key;
    return 1;
}

static void print_rows(const char *key, const double *rows, long count, int stride, int width)
{
    printf("\"%s\": [", key);
    for (long k = 0; k < count; k++) {
        printf(k ? ", [" : "[");
        for (int i = 0; i < width; i++)
            printf(i ? ", %.17g" : "%.17g", rows[k * stride + i]);
        printf("]");
    }
    printf("]");
}

int main(void)
{
    static state s;
    char *line = NULL;
    size_t length = 0, room = 0;
    int c;
    while ((c = getchar()) != EOF) {
        if (length + 1 >= room)
            line = realloc(line, room = 2 * room + 4096);
        if (c != '\n') {
            line[length++] = (char)c;
            continue;
        }
        line[length] = 0;
        length = 0;
        double h = 0, steps = -1, every = 1;
        wrong = NULL;
        begin(&s);
        const char *given = strstr(line, "\"parameters\":");
        numbers(line, "\"x\":", s.x, POSITIONS);
        numbers(line, "\"mu\":", s.mu, M);
        if (!numbers(line, "\"h\":", &h, 1))
            wrong = "\"h\":";
        numbers(line, "\"steps\":", &steps, 1);
        numbers(line, "\"every\":", &every, 1);
READ
        if (!wrong && !(steps >= 0 && every >= 1))
            wrong = steps >= 0 ? "\"every\":" : "\"steps\":";
        if (wrong) {
            printf("{\"error\": \"%.*s is missing, or has other numbers than it has to\"}\n",
                   (int)strlen(wrong) - 3, wrong + 1);
            fflush(stdout);
            continue;
        }
        start(&s);
        long count = (long)steps / (long)every + 1;
        double *xs = malloc(sizeof(double) * (N + M) * (size_t)count);
        double *mus = malloc(sizeof(double) * (N + M) * (size_t)count);
        long done = run(&s, h, (int)steps, (int)every, xs, mus);
        if (done < (long)steps) {
            printf("{\"error\": \"step %ld: %s\"}\n", done, told(step(&s, h)));
        } else {
            printf("{");
            print_rows("x", xs, count, N, POSITIONS);
            printf(", ");
            print_rows("mu", mus, count, M, M);
            printf("}\n");
        }
        fflush(stdout);
        free(xs);
        free(mus);
    }
    free(line);
    return 0;
}
"""


def identifier(name: str, i: int) -> str:
    """Return a parameter's name as one that C has."""
    return f"P_{name}" if re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII) else f"P_{i}"


def hexadecimal(value: float) -> str:
    """Return a small power of two by its exponent, other numbers in decimals."""
    return value.hex().replace("0x1.0000000000000p", "0x1p") if 0 < value < 1e-7 else repr(value)


def listed(values: Sequence[float | int]) -> str:
    """Return an array's values; C has none without entries."""
    return f"{{ {', '.join(map(repr, values)) or '0'} }}"


def c_file(model: Exported, said: Sequence[str], harness: bool) -> str:
    """Return the C file of a scheme."""
    used = dict(constants(model))
    integers = [f"{k} = {v}" for k, v in used.items() if isinstance(v, int)]
    numbers = [f"#define {k} {hexadecimal(v)}" for k, v in used.items() if isinstance(v, float)]
    arrays = [
        f"static const {'int' if v and isinstance(v[0], int) else 'double'} {k}[] = {listed(v)};"
        for k, v in used.items() if isinstance(v, list)
    ]  # fmt: skip
    places, at = [], 1
    for i, parameter in enumerate(model.parameters):
        places.append(f"{identifier(parameter.name, i)} = {at}")
        at += len(parameter.values)
    fields = []
    for name, (kind, length) in used_fields(model).items():
        size = "" if length is None else f"[{max(1, length)}]"
        fields.append(f"    {'double' if kind == 'float' else 'int'} {name}{size};")
    x, mu = model.start
    values = [e for parameter in model.parameters for e in parameter.values]
    text = FILE.format(
        head="\n".join(f" * {line}".rstrip() for line in head(model, "C", said)),
        integers=fill(", ".join(integers), 92, subsequent_indent="       "),
        numbers="\n".join(numbers), arrays="\n".join(arrays),
        places=", ".join(places) or "P_NONE = 0", fields="\n".join(fields),
        functions="\n\n".join(Printer().function(f) for f in model.functions),
        n=max(1, len(x)), m=max(1, len(mu)), p=max(1, len(values)), count=len(values),
        x=listed(x), mu=listed(mu), parameters=listed(values),
        words=",\n        ".join(f'"{e}"' for e in STATUSES.values()),
    )  # fmt: skip
    return text + (_harness(model) if harness else "")


def _harness(model: Exported) -> str:
    read, at = [], 1
    for parameter in model.parameters:
        key, count = f'"\\"{parameter.name}\\":"', len(parameter.values)
        read.append(f"        numbers(given, {key}, s.q + {at}, {count});")
        at += len(parameter.values)
    n = model.constants["N"]
    if model.timed:
        read.append(f'        numbers(line, "\\"t\\":", s.x + {n - 1}, 1);')
    if not model.parameters:
        read.append("        (void)given;")
    return HARNESS.replace("READ", "\n".join(read)).replace("POSITIONS", str(n - model.timed))
