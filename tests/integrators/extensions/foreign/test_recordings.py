"""Recorded runs: what files may look like, and a sentence for those that are no runs."""

import re
from fractions import Fraction

import numpy as np
import pytest

from discmech.integrators import BadInput
from discmech.integrators.extensions.foreign import tables
from discmech.integrators.extensions.foreign.recordings import recordings

ROWS = 12


def motion(rows=ROWS, interval=0.1, size=1):
    """(t, q, p) of some run, its times a product each."""
    t = interval * np.arange(rows)
    phase = t[:, None] + np.arange(size)
    return t, np.sin(phase), np.cos(phase)


def csv(path, names, columns, form="{!r}", mark=","):
    lines = [mark.join(form.format(float(v)) for v in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([mark.join(names), *lines]) + "\n", encoding="utf-8")


@pytest.mark.parametrize("names", [
    "t,q1,q2,p1,p2", "t,x1,x2,mu1,mu2", "p2,q2,t,p1,q1", "t,q_0,q_1,p_0,p_1", "t,q[0],q[1],p1,p2",
    "t,q1,q2,energy,p1,p2,p", "t,x1,x2,μ1,μ2",
])  # fmt: skip
@pytest.mark.parametrize("mark", [",", ";", "\t", " "])
def test_columns_come_by_their_names(tmp_path, names, mark):
    names = names.split(",")
    if names[-1] == "p":
        names[-1] = "pressure"
    t, q, p = motion(size=2)
    digit = {"1": 0, "2": 1} if "q_0" not in names and "q[0]" not in names else {"0": 0, "1": 1}
    held = {}
    for name in names:
        kind = {"q": q, "x": q, "p": p, "m": p, "μ": p}.get(name[0])
        at = re.search(r"\d", name)
        one = digit if name[0] != "p" or "q[0]" not in names else {"1": 0, "2": 1}
        held[name] = t if name == "t" or not at else kind[:, one[at[0]]]
    csv(tmp_path / "run.csv", names, held.values(), mark=mark)
    (run,) = recordings("*.csv", tmp_path)
    assert np.array_equal(run.x, q) and np.array_equal(run.mu, p) and np.array_equal(run.t, t)
    assert run.step == Fraction(1, 10) and run.steps == ROWS - 1
    assert not run.late and not run.roundings.any()


def test_one_coordinate_needs_no_number_and_a_group_no_q(tmp_path):
    t, q, p = motion()
    csv(tmp_path / "a.csv", ["t", "q", "p"], [t, q[:, 0], p[:, 0]])
    csv(tmp_path / "b.csv", ["t", "mu1"], [t, p[:, 0]])
    assert recordings("a.csv", tmp_path)[0].x.shape == (ROWS, 1)
    assert recordings("b.csv", tmp_path)[0].x.shape == (ROWS, 0)


def test_what_numpy_saves_is_read(tmp_path):
    t, q, p = motion(size=2)
    np.savez(tmp_path / "a.npz", t=t, q=q, p=p, energy=np.ones(3), note="words")
    np.savez(tmp_path / "b.npz", t=t, x1=q[:, 0], x2=q[:, 1], mu1=p[:, 0], mu2=p[:, 1])
    np.savez(tmp_path / "c.npz", t=t[::2], q=q[::2], p=p[::2], h=np.full(len(t[::2]), 0.05))
    np.savetxt(tmp_path / "d.csv", np.column_stack([t, q, p]), header="t q1 q2 p1 p2")
    for name in ("a.npz", "b.npz", "d.csv"):
        (run,) = recordings(name, tmp_path)
        assert np.array_equal(run.x, q) and np.array_equal(run.mu, p), name
        assert run.step == Fraction(1, 10) and not run.roundings.any()
    (run,) = recordings("c.npz", tmp_path)
    assert run.step == Fraction(1, 20) and run.every == 4 and run.steps == 20


def test_parquet_is_read_where_pyarrow_is(tmp_path):
    t, q, p = motion()
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        tmp_path.joinpath("run.parquet").write_bytes(b"PAR1")
        with pytest.raises(BadInput, match=r"pip install pyarrow, or save the run as CSV"):
            recordings("run.parquet", tmp_path)
        return
    table = pyarrow.table({"t": t, "q1": q[:, 0], "p1": p[:, 0]})
    parquet.write_table(table, tmp_path / "run.parquet")
    (run,) = recordings("run.parquet", tmp_path)
    assert np.array_equal(run.x, q) and run.step == Fraction(1, 10)


def test_velocities_are_read_when_they_are_asked_for(tmp_path):
    t, q, p = motion()
    csv(tmp_path / "run.csv", ["t", "q1", "v1"], [t, q[:, 0], p[:, 0]])
    assert np.array_equal(recordings("run.csv", tmp_path, "qv")[0].mu, p)
    with pytest.raises(BadInput, match=r'Velocities are meant\? Say recorded\(..., state="qv"\)'):
        recordings("run.csv", tmp_path)


def test_several_files_come_by_their_steps(tmp_path):
    for k, interval in enumerate((0.025, 0.1, 0.05)):
        t, q, p = motion(interval=interval)
        np.savez(tmp_path / f"{k}.npz", t=t, q=q, p=p)
    found = recordings(["*.npz", "1.npz"], tmp_path)
    assert [float(run.step) for run in found] == [0.1, 0.05, 0.025]
    assert recordings(str(tmp_path / "*.npz"), tmp_path.parent)[0].step == Fraction(1, 10)


@pytest.mark.parametrize(("interval", "form", "step", "late"), [
    (0.1, "{:.3f}", Fraction(1, 10), 0), (1 / 3, "{:.5f}", Fraction(1, 3), 0),
    (1 / 3, "{!r}", Fraction(1, 3), 0), (2**-9, "{!r}", Fraction(1, 512), 0),
    (0.01234961, "{:.6f}", None, 1e-6), (np.pi / 100, "{!r}", None, 1e-12),
])  # fmt: skip
def test_times_may_be_rounded(tmp_path, interval, form, step, late):
    t, q, p = motion(200, interval)
    rows = zip(t, q[:, 0], p[:, 0], strict=True)
    lines = [f"{form.format(float(a))},{b!r},{c!r}" for a, b, c in rows]
    lines = [line.replace("np.float64(", "").replace(")", "") for line in lines]
    tmp_path.joinpath("run.csv").write_text("\n".join(["t,q1,p1", *lines]))
    (run,) = recordings("run.csv", tmp_path)
    assert run.step == step if step else abs(run.step - Fraction(interval)) < 2 * late / 199
    assert run.late <= 1.01 * late and bool(run.late) == bool(late)


def test_times_may_be_added_up(tmp_path):
    t, q, p = motion(20_001)
    np.savez(tmp_path / "run.npz", t=np.cumsum(np.full(len(t), 0.1)) - 0.1, q=q, p=p)
    assert recordings("run.npz", tmp_path)[0].step == Fraction(1, 10)


@pytest.mark.parametrize(("form", "rounding"), [("{:.6f}", 0.5e-6), ("{:.8e}", 0.5e-8)])
def test_fewer_digits_are_noticed(tmp_path, form, rounding):
    t, q, p = motion(60, 0.125)
    csv(tmp_path / "run.csv", ["t", "q1", "p1"], [t, q[:, 0], p[:, 0]], form)
    (run,) = recordings("run.csv", tmp_path)
    assert run.roundings.max() == pytest.approx(rounding) and run.step == Fraction(1, 8)
    assert np.abs(run.x - q).max() <= run.roundings.max() * (1 + 1e-9)


T = "\n".join(f"{k / 8},{k % 3},1" for k in range(6))


@pytest.mark.parametrize(("text", "words"), [
    (f"time,x,v\n{T}", "has no column t: there are time, x, v; a run has columns t, q1"),
    (f"t,a,b\n{T}", "has no column p1: there are t, a, b;"),
    (f"t,q1,v1\n{T}", "no column p1: .* state"),
    (f"t,q1,q3\n{T}".replace("q3", "p3"), "has the columns p3: number them p1, p2"),
    (f"t,q1,x1\n{T}", "q1 and x1, two names of one thing"),
    (f"t,q1,q1\n{T}", "two columns q1"),
    ("t,q1,p1\n0,1,2\n0.1,1", "line 3 has 2 fields under 3 names"),
    ("t,q1,p1\n0,1,2\n0.1,oh,1", "line 3, column q1: 'oh' is no number"),
    ("t,q1,p1\n0,1,2\n0.1,,1", "line 3, column q1: '' is no number"),
    ("t,q1,p1\n0,1,2\n0.1,nan,1", "q1 is nan in row 1; a run that broke down"),
    ("t,q1,p1\n0,1,2\n0.1,1,inf", "p1 is inf in row 1"),
    ("t,q1,p1\n0,1,2", "has 1 row: a run has its start and at least one more"),
    ("t,q1,p1", "has 0 row"), ("", "is empty"), ("0,1,2\n0.1,1,2", "no names above its numbers"),
    ("t,q1,p1\n0,1,2\n0.1,1,2\n0.1,1,2", "t stands still in row 2"),
    ("t,q1,p1\n0,1,2\n0.1,1,2\n0.05,1,2", "t goes back in row 2"),
    ("t,q1,p1\n0,1,2\n0.1,1,2\n0.2,1,2\n0.25,1,2\n0.35,1,2",
     "t is uneven, 0.05 from row 2 to row 3 and 0.1 elsewhere"),
    ("t,q1,p1,h\n0,1,2,0.1\n0.1,1,2,0.05", "the column h is the step, one positive"),
    ("t,q1,p1,h\n0,1,2,0.03\n0.1,1,2,0.03", "no whole number of steps of 0.03"),
    ("t,q1,p1,h\n0,1,2,1e-99\n0.1,1,2,1e-99", "no whole number of steps of 1e-99"),
    ("t,q1,p1\n0,1,2\n1e-999999999,1,2", "t stands still in row 1|choose units"),
    ("t,q1,p1\n1e-999999999,1,2\n1,1,2", "line 2: t is 1e-999999999: choose units"),
    ("t,q1,p1,h\n0,1,2,1e-999999999\n1,1,2,1e-999999999", "the step, one positive number"),
    (f"t,q1,p1\n0,1,2\n1,1,\"{'2' * 200_000}", "cannot be read as CSV"),
    (f"t,p{'1' * 5000}\n0,1\n1,1", "no column p1"),
])  # fmt: skip
def test_what_is_no_run_is_a_sentence(tmp_path, text, words):
    tmp_path.joinpath("run.csv").write_text(text)
    with pytest.raises(BadInput, match=words) as caught:
        recordings("run.csv", tmp_path)
    assert "\n" not in str(caught.value)


def test_uneven_times_are_found_however_small_the_unevenness(tmp_path):
    generator = np.random.default_rng()
    for size in (1e-3, 1e-6, 1e-9):
        t, q, p = motion(100)
        t[generator.integers(1, 99)] += size
        np.savez(tmp_path / "run.npz", t=t, q=q, p=p)
        with pytest.raises(BadInput, match="t is uneven"):
            recordings("run.npz", tmp_path)


def rounded(t, form):
    """Times as a file of that form has them: in single precision, or with decimals."""
    return t.astype(np.float32).astype(float) if form == "single" else np.round(t, form)


@pytest.mark.sampled
@pytest.mark.parametrize("form", ["single", 3, 6])
@pytest.mark.parametrize("interval", [0.1, 0.00625, np.pi / 100])
def test_rounded_times_are_even_as_far_as_their_rounding_allows(tmp_path, form, interval):
    """One that is moved by two units of its last place is refused."""
    t, q, p = motion(1600, interval)
    times = rounded(t, form)
    unit = np.spacing(times.astype(np.float32)).astype(float) if form == "single" else 10.0**-form
    csv(tmp_path / "a.csv", ["t", "q1", "p1"], [times, q[:, 0], p[:, 0]])
    (run,) = recordings("a.csv", tmp_path)
    assert abs(run.step / Fraction(interval) - 1) < 1e-4 and not run.roundings.any()
    if form == "single" and interval != np.pi / 100:
        assert run.step == Fraction(interval).limit_denominator(1000)
    for sign in (1, -1):
        moved = times + 2 * unit * sign * (np.arange(1600) == 1500)
        np.savez(tmp_path / "b.npz", t=moved, q=q, p=p)
        csv(tmp_path / "b.csv", ["t", "q1", "p1"], [moved, q[:, 0], p[:, 0]])
        with pytest.raises(BadInput, match=r"t is uneven"):
            recordings("b.csv" if form != "single" else "b.*", tmp_path)


@pytest.mark.parametrize("form", ["{!r}", "{:.9g}"])
def test_a_run_of_single_precision_has_its_round_off(tmp_path, form):
    """Only if all its numbers are of it."""
    t, q, p = motion(400)
    q, p = (part[:, 0].astype(np.float32) for part in (q, p))
    csv(tmp_path / "a.csv", ["t", "q1", "p1"], [t.astype(np.float32), q, p], form)
    csv(tmp_path / "b.csv", ["t", "q1", "q2", "p1", "p2"],
        [t, np.sin(t), 0 * t + 0.5, np.cos(t), 0 * t], "{!r}")  # fmt: skip
    (run,), (double,) = (recordings(name, tmp_path) for name in ("a.csv", "b.csv"))
    assert run.unit == pytest.approx(2.0**-24, rel=0.1) and run.step == Fraction(1, 10)
    assert double.unit == 0  # a coordinate of 1/2


def test_runs_of_one_step_are_a_sentence(tmp_path):
    for name in ("a", "b"):
        t, q, p = motion()
        np.savez(tmp_path / f"{name}.npz", t=t, q=q, p=p)
    with pytest.raises(BadInput, match=r"a.npz and b.npz have one step, 0.1: .* a column h says"):
        recordings("*.npz", tmp_path)


def test_a_file_is_read_in_pieces_up_to_a_size(tmp_path, monkeypatch):
    t, q, p = motion(50)
    for name, times in (("a", t), ("b", np.cumsum(0 * t + 0.1))):
        csv(tmp_path / f"{name}.csv", ["t", "q1", "p1"], [times, q[:, 0], p[:, 0]])
    whole = [recordings(name, tmp_path)[0] for name in ("a.csv", "b.csv")]
    monkeypatch.setattr(tables, "PIECE", 7)
    parts = [recordings(name, tmp_path)[0] for name in ("a.csv", "b.csv")]
    assert [run.digest for run in whole] == [run.digest for run in parts]
    np.savez_compressed(tmp_path / "a.npz", t=np.arange(1e5), q=np.zeros(10**5), p=np.zeros(10**5))
    assert (tmp_path / "a.npz").stat().st_size < 2**20
    monkeypatch.setattr(tables, "MOST_BYTES", 2**20)
    with pytest.raises(BadInput, match=r"a.npz has 2 MB of numbers, and 1 MB are read at most"):
        recordings("a.npz", tmp_path)
    monkeypatch.setattr(tables, "MOST_BYTES", 1000)
    with pytest.raises(BadInput, match=r"a.csv has .* write fewer rows, each k-th step"):
        recordings("a.csv", tmp_path)


def test_files_that_are_none_are_a_sentence(tmp_path):
    tmp_path.joinpath("a.npz").write_bytes(b"PK\x03\x04 no archive")
    tmp_path.joinpath("a.csv").write_bytes(bytes(range(128, 256)))
    tmp_path.joinpath("a.xlsx").write_bytes(b"")
    tmp_path.joinpath("folder.csv").mkdir()
    np.savez(tmp_path / "b.npz", t=np.array(["a", "b"]), p=np.ones(2))
    np.savez(tmp_path / "c.npz", t=np.arange(3.0), p=np.ones(2))
    np.savez(tmp_path / "d.npz", t=np.arange(2.0), p=np.array([None, None]))
    for pattern, words in {
        "a.npz": "is no npz archive", "a.csv": "is no text", "a.xlsx": "no CSV, npz or parquet",
        "folder.csv": "cannot be read", "b.npz": "no table of real numbers",
        "c.npz": "p has 2 rows and t has 3", "d.npz": "no npz archive", "e*.csv": "is no file e",
        "": "no file", "**a": "no file",
    }.items():  # fmt: skip
        with pytest.raises(BadInput, match=words):
            recordings(pattern, tmp_path)
    for pattern in (None, [], 3, [3]):
        with pytest.raises(BadInput, match=r"runs/\*.csv"):
            recordings(pattern, tmp_path)
    t, q, p = motion(size=2)
    np.savez(tmp_path / "2.npz", t=t, q=q, p=p)
    np.savez(tmp_path / "1.npz", t=t, q=q[:, :1], p=p[:, :1])
    with pytest.raises(BadInput, match=r"1 coordinates and 1 momenta and .* 2 coordinates and 2"):
        recordings(["1.npz", "2.npz"], tmp_path)
