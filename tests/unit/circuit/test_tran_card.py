"""The .tran card's arguments, the order of analyses, and runs that fail."""

from __future__ import annotations

import math
import os
import re
import signal
import threading

import numpy as np
import pytest
from circuit_decks import codes, deck, remarks

import emsim

RC = ("V1 a 0 PULSE(0 1 0 1u 1u)", "R1 a b 1k", "C1 b 0 1u")


@pytest.mark.parametrize("args", ["1m 0", "1m -1", "0 1", "-1m 1", "1m 1 2", "1m 1 -1", "1m 1 0 -1"])
def test_wrong_arguments(args: str) -> None:
    assert codes(*RC, f".tran {args}") == ["E305"]


@pytest.mark.parametrize("args", ["", "1m", "1m 1 0 1 1"])
def test_wrong_number_of_arguments(args: str) -> None:
    assert codes(*RC, f".tran {args}") == ["E118"]


def test_tstart_and_tmax() -> None:
    r = emsim.run(deck(*RC, ".tran 1m 10m 5m 0.01m"))
    assert r.time[0] >= 5e-3 - 1e-12
    assert r.time[-1] == pytest.approx(10e-3)
    assert max(r.time[1:] - r.time[:-1]) <= 0.01e-3 * (1 + 1e-9)


@pytest.mark.parametrize("method", ["trap", "gear", "radau", "trbdf2", "esdirk", "gauss", "rk45", "dop853"])
def test_what_is_shown_begins_at_tstart(method: str) -> None:
    """The first row was the first point after it, and .print wrote this in the place of tstart."""
    sine = ("V1 a 0 SIN(0 1 1k)", "R1 a b 1k", "C1 b 0 1u", f".options method={method} reltol=1e-6")
    r = emsim.run(deck(*sine, ".tran 10u 0.2m 53u"))
    assert r.time[0] == pytest.approx(53e-6, rel=1e-12) and r.time[1] > 53e-6
    assert r["v(a)"][0] == pytest.approx(math.sin(2 * math.pi * 0.053), abs=1e-4)
    assert r["v(b)"][0] == pytest.approx(emsim.run(deck(*sine, ".tran 1u 0.2m")).at("v(b)", 53e-6), abs=1e-5)


@pytest.mark.parametrize("span", ["5m", "100m"])
@pytest.mark.parametrize("method", ["trap", "gear", "radau", "trbdf2", "esdirk", "gauss", "rk45", "dop853"])
def test_straight_lines_between_the_rows_follow_a_sine_that_the_print_grid_does_not(
    method: str, span: str
) -> None:
    """Steps of a high order are half a period long, the grid a whole one: curves missed half of the amplitude."""
    r = emsim.run(
        deck(
            "V1 a 0 SIN(0 1 1k)", "R1 a b 1k", "C1 b 0 0.1u", f".options method={method}", f".tran 1m {span}"
        )
    )
    w = 2 * math.pi * 1e3
    answer = 1 / (1 + 1j * w * 1e-4)
    t = np.linspace(0, r.time[-1], 20001)
    exact = (answer * np.exp(1j * w * t)).imag - answer.imag * np.exp(-t / 1e-4)
    assert abs(np.interp(t, r.time, r["v(b)"]) - exact).max() < 0.05
    # where .print looks there are rows
    grid = np.arange(1, r.time[-1] / 1e-3) * 1e-3
    assert method == "trap" or min(abs(r.time - k).min() for k in grid) == 0


@pytest.mark.parametrize("method", ["trap", "radau", "auto"])
def test_the_last_moment_of_a_long_run(method: str) -> None:
    """Steps a fiftieth of what is shown as long, from the beginning on, were a hundred million."""
    sine = ("V1 a 0 SIN(0 1 1k)", "R1 a b 1k", "C1 b 0 0.1u", f".options method={method}")
    r = emsim.run(deck(*sine, ".tran 1m 1 0.9999999"))
    assert len(r) >= 50 and r.stats["steps"] < 200_000
    answer = 1 / (1 + 1j * 2 * math.pi * 0.1)
    assert r["v(b)"] == pytest.approx((answer * np.exp(2j * math.pi * 1e3 * (r.time - 1))).imag, abs=2e-3)


def test_analyses_run_in_order() -> None:
    r = emsim.run(deck(*RC, ".op", ".tran 1m 10m"))
    assert [p.kind for p in r.plots] == ["op", "tran"]


def test_other_analyses_make_one_error_each_and_the_rest_runs() -> None:
    r = emsim.run(deck(*RC, ".hb 1k", ".mc 10", ".mc 20", ".tran 1m 10m"))
    assert [(d.severity, d.code) for d in r.diagnostics] == [("error", "E306"), ("error", "E306")]
    assert [p.kind for p in r.plots] == ["tran"] and r.time[-1] == pytest.approx(10e-3)


def test_a_deck_with_no_other_analysis_is_refused() -> None:
    with pytest.raises(emsim.DeckError, match="E306"):
        emsim.run(deck(*RC, ".hb 1k"))


def test_no_analysis() -> None:
    assert [d.code for d in remarks(*RC)] == ["N283"]


def test_failure_names_the_line_and_keeps_what_was_computed() -> None:
    # 1/(1 - t) has a pole at 1 s, inside the run
    lines = ("V1 a 0 1", "C1 x 0 1", "B1 0 x I={v(x)*v(x)}", ".ic v(x)=1", ".tran 0.01 2")
    with pytest.raises(emsim.ConvergenceError) as caught:
        emsim.run(deck(*lines, "R1 a 0 1"))
    error = caught.value
    assert error.diagnostics[0].code in ("E410", "E412")
    assert error.diagnostics[0].span.line in (3, 4)
    assert "try:" in error.diagnostics[0].hint
    assert error.partial is not None
    assert error.partial.status == "failed"
    assert 0.9 < error.partial.time[-1] < 1.1


def test_progress_is_called_and_can_stop() -> None:
    calls: list[float] = []

    def stop(t: float, tstop: float, h: float, steps: int, events: int) -> bool:
        calls.append(t)
        return True

    r = emsim.run(deck("V1 a 0 SIN(0 1 1meg)", "R1 a b 1k", "C1 b 0 1n", ".tran 1n 20m"), progress=stop)
    assert r.status == "interrupted"
    assert len(calls) == 1


LONG = deck("V1 a 0 SIN(0 1 1meg)", "R1 a b 1k", "C1 b 0 1n", "D1 b 0 dm", ".model dm d", ".tran 1u 10 0 20n")


def test_what_a_progress_callback_raises_is_raised() -> None:
    def wrong(*_: object) -> bool:
        raise ZeroDivisionError("in the callback")

    with pytest.raises(ZeroDivisionError, match="in the callback"):
        emsim.run(LONG, progress=wrong)


@pytest.mark.parametrize("progress", [None, lambda *_: None])
def test_ctrl_c_ends_a_sweep_and_keeps_what_was_computed(progress) -> None:
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        timer.start()
        with pytest.raises(KeyboardInterrupt) as stop:
            emsim.run(LONG, progress=progress)
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)
    assert isinstance(stop.value, emsim.Interrupted)
    assert stop.value.partial.status == "interrupted" and 0 < stop.value.partial.time[-1] < 10


@pytest.mark.parametrize(
    "card",
    [".tran 1p 1e3", ".ac lin 1e9 1 1meg", ".noise v(b) v1 dec 1e9 1 1k", ".sens v(b) ac oct 1e9 1 2", ".disto lin 1e9 1 2",
     ".dc v1 0 1 1e-9", ".dc v1 0 1 1e-5 v1 0 1 1e-5"],
)  # fmt: skip
def test_more_rows_than_memory_are_refused_before_the_run(card: str) -> None:
    """A picosecond's rows over a second, a list of 1e9 frequencies: both were begun, and took what memory there was."""
    with pytest.raises(emsim.OutsideError) as stop:
        emsim.run(deck("V1 a 0 dc 0 ac 1 distof1 1", "R1 a b 1k", "C1 b 0 1u", card))
    (said,) = [d for d in stop.value.diagnostics if d.severity == "error"]
    assert (
        said.code == "E509"
        and said.span.line == 5
        and re.search(r"\de\+\d+ rows of \d columns", said.message)
    )


def test_check_tells_the_facts() -> None:
    facts = emsim.check(deck(*RC, ".tran 1m 10m uic"))
    assert facts["unknowns"] == {"node": 2, "branch": 1}
    assert facts["analyses"] == [".tran 0.001 0.01 uic"]
    assert facts["method"] == "auto"
    assert facts["machine"] is None
