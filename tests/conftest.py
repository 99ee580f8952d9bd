"""How the tests run, whatever they test."""

import gc
from contextlib import ExitStack

import pytest

from discmech.studies.core.environment import collect_rarely, one_thread
from tests.objects.schedule import sample

collect_rarely()


def pytest_configure(config):
    """Tests run side by side, in processes of pytest that begin later."""
    settings = ExitStack()
    settings.enter_context(one_thread())
    config.add_cleanup(settings.close)


@pytest.hookimpl(wrapper=True)
def pytest_generate_tests(metafunc):
    """Slow are the cases that a law calls dear, and of one that is `sampled` all but a few.

    Those few hold every value of every argument. Where slow cases are left out, only one of a law
    becomes a test, for the count: to make and drop eight thousand took a third of the collection.
    """
    made = yield
    law, cases = metafunc.definition, metafunc._calls
    if not cases:
        return made
    for mark in law.iter_markers("dear"):
        for case in _dear(mark, law.name, cases):
            case.marks.append(pytest.mark.slow.mark)
    often = [] if law.get_closest_marker("slow") else [c for c in cases if not _is_slow(c)]
    if law.get_closest_marker("sampled"):
        taken = sample([case.params for case in often])
        for k in set(range(len(often))) - taken:
            often[k].marks.append(pytest.mark.slow.mark)
        often = [often[k] for k in sorted(taken)]
    if metafunc.config.option.markexpr == "not slow":
        cases[:] = often or cases[:1]
    return made


def _dear(mark, law, cases):
    """Return the cases that a mark names by parts of their ids, or all but those (`but`)."""
    but = mark.kwargs.get("but", ())
    for word in (*mark.args, *but):
        if not any(word in f"{law}[{case.id}]" for case in cases):
            raise pytest.UsageError(f"{law}: no case has {word!r} in its id; mend its mark `dear`.")
    named = [c for c in cases if any(word in f"{law}[{c.id}]" for word in but or mark.args)]
    return [c for c in cases if c not in named] if but else named


def _is_slow(case):
    return any(mark.name == "slow" for mark in case.marks)


def pytest_collection_finish():
    """What was imported and collected stays to the end as well."""
    gc.freeze()
