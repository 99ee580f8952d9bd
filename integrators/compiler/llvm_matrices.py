"""Products and quotients of matrices as text of the language, where Python has numpy's."""

#: in front of a text that calls them; `out` is none of the other matrices; of a quotient
#: a⁻¹ b, a is N×N
MATRICES = """
@node
def matrix_product(out, a, b):
    size, i = columns(out), 0
    while i < size:
        j = 0
        while j < size:
            out[i, j] = 0.0
            j = j + 1
        k = 0
        while k < size:
            factor = a[i, k]
            if factor != 0:  # of matrices of blocks more than half are
                j = 0
                while j < size:
                    out[i, j] = out[i, j] + factor * b[k, j]
                    j = j + 1
            k = k + 1
        i = i + 1


@aside
def matrix_exchange(a, one, other):
    wide, j = columns(a), 0
    while j < wide:
        here, there = a[one, j], a[other, j]
        a[one, j] = there
        a[other, j] = here
        j = j + 1


@aside
def matrix_quotient(out, a, b):
    # a⁻¹ b by elimination with row exchanges; a and b are overwritten; not finite if a is singular
    size, wide, k = columns(a), columns(b), 0
    while k < size:
        pivot, row = k, k + 1
        while row < size:
            if abs(a[row, k]) > abs(a[pivot, k]):
                pivot = row
            row = row + 1
        matrix_exchange(a, k, pivot)
        matrix_exchange(b, k, pivot)
        row = k + 1
        while row < size:
            factor, j = a[row, k] / a[k, k], k
            while j < size:
                a[row, j] = a[row, j] - factor * a[k, j]
                j = j + 1
            j = 0
            while j < wide:
                b[row, j] = b[row, j] - factor * b[k, j]
                j = j + 1
            row = row + 1
        k = k + 1
    k = size - 1
    while k >= 0:
        j = 0
        while j < wide:
            total, row = b[k, j], k + 1
            while row < size:
                total = total - a[k, row] * out[row, j]
                row = row + 1
            out[k, j] = total / a[k, k]
            j = j + 1
        k = k - 1


"""
