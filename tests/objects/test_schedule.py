"""What the fast suite leaves out, it meets elsewhere."""

from itertools import product

from tests.objects.schedule import sample


def test_a_sample_meets_every_value_and_mixes_them():
    cases = [dict(zip("gsh", case, strict=True)) for case in product(range(9), "nfe", (1, 2, 3))]
    taken = [cases[k] for k in sample(cases)]
    assert len(taken) == 9
    assert {case["g"] for case in taken} == set(range(9))
    assert {(case["s"], case["h"]) for case in taken} == set(product("nfe", (1, 2, 3)))


def test_a_value_that_one_case_has_is_not_lost():
    cases = [{"given": [k], "limit": 0} for k in range(4)]
    assert sample(cases) == {0, 1, 2, 3}
