"""pytest plugin: fixtures that assert what a rule is worth, in any repository that has discmech.

    def test_my_rule(assert_order, assert_symplectic):
        assert_order("my_rule.py:two_thirds", "pendulum", 2)
        assert_symplectic("my_rule.py:two_thirds", "heavy-top")

A failure prints the verdict table and attaches the picture, which lies in the test's `tmp_path`. A
file's path is taken from the folder of the test file, then from where pytest was started.
Where the study says nothing of the scene, or the rule has no meaning there (stages under
constraints, say), the test is skipped with the sentence.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

Assertion = Callable[..., dict[str, Any]]


def _fixture(name: str, about: str) -> Any:
    """A fixture that hands out the assertion of that name; about: what `pytest --fixtures` says."""

    def fixture(tmp_path: Path, request: pytest.FixtureRequest) -> Assertion:
        from .user import assertions

        folder = request.path.parent
        asserted = partial(getattr(assertions, name), pictures=tmp_path, beside=folder)

        def assertion(*arguments: Any, **more: Any) -> dict[str, Any]:
            __tracebackhide__ = True
            try:
                answer: dict[str, Any] = asserted(*arguments, **more)
            except assertions.NotApplicable as refusal:
                pytest.skip(str(refusal))
            return answer

        return assertion

    fixture.__doc__ = about
    return pytest.fixture(name=name)(fixture)


order = _fixture("assert_order", "(rule, scene, order): the measured order is that one.")
converges = _fixture("assert_converges", "(rule, scene): errors sink with the step.")
symplectic = _fixture("assert_symplectic", "(rule, scene): Ω and the bracket are kept.")
momentum = _fixture("assert_momentum", "(rule, scene): what the scene says is kept, is.")
energy = _fixture("assert_energy", "(rule, scene): the energy stays in a band, without a slope.")
proven_order = _fixture(
    "assert_proven_order", "(rule, order): the order is proven for every Lagrangian of a class."
)
reversible = _fixture("assert_reversible", "(rule, scene): a step back undoes a step.")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Attach picture and verdict of a failed assertion, so that reports (JUnit, JSON) have them."""
    error = call.excinfo.value if call.excinfo else None
    picture = getattr(error, "picture", None)
    if picture is not None and type(error).__module__ == f"{__package__}.user.assertions":
        # the item's, for JUnit's file has what is known at the end of the test
        item.user_properties.append(("discmech picture", str(picture)))
    return (yield)
