"""Solutions that leave for infinity within the run. Beyond the pole an implicit stage has solutions that are none of the
equation's, and the tolerance has grown with the values: what came back as a result was noise of 1e6 and more."""

import numpy as np
import pytest
from support import run

import emsim

METHODS = (
    "auto",
    "radau",
    "radau5",
    "radau9",
    "radau13",
    "dop853",
    "rk45",
    "gear",
    "trap",
    "trbdf2",
    "esdirk",
)
# dv/dt, v(0), the pole
POLES = {
    "1/(1 - t)": ("v(x)*v(x)", 1.0, 1.0),
    "1/sqrt(1 - 2t)": ("v(x)**3", 1.0, 0.5),
    "tan(t + pi/4)": ("1 + v(x)*v(x)", 1.0, np.pi / 4),
    "-1/(1 - 2t)": ("-2*v(x)*v(x)", -1.0, 0.5),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("pole", POLES)
@pytest.mark.parametrize("reltol", [3e-2, 1e-2, 1e-3, 1e-5])
def test_a_run_ends_at_a_pole(pole: str, method: str, reltol: float) -> None:
    rate, start, end = POLES[pole]
    text = f"{pole}\nC1 x 0 1\nB1 0 x I={{{rate}}}\n.ic v(x)={start}\n.tran 0.01 2\n.end\n"
    with pytest.raises(emsim.ConvergenceError) as caught:
        run(text, f"method={method} reltol={reltol!r}")
    partial = caught.value.partial
    assert caught.value.diagnostics[0].code in ("E410", "E412") and partial is not None
    assert partial.time[-1] == pytest.approx(end, abs=max(2 * reltol, 1e-3))
    assert abs(partial["v(x)"][-1]) > 30 * abs(start)


@pytest.mark.parametrize("method", ["auto", "radau", "radau5", "radau9", "radau13", "gear"])
def test_what_grows_and_stops_growing_is_no_pole(method: str) -> None:
    """Logistic growth within ten nanoseconds of a run of a second."""
    text = "logistic\nC1 x 0 1 IC=1m\nB1 0 x I={v(x)*(1 - v(x))*1e9}\n.tran 10m 1 uic\n.end\n"
    result = run(text, f"method={method} reltol=1e-4")
    exact = 1 / (1 + 999 * np.exp(-1e9 * result.time))
    assert np.abs(result["v(x)"] - exact).max() < 2e-3


@pytest.mark.parametrize("method", ["radau", "radau5"])
def test_what_starts_from_rest_is_no_pole(method: str) -> None:
    """Behind a jump at t = 0 the nodes of a rectifier move by millivolts in 1e-20 s, every step by more than the one before, and
    no step can be shorter."""
    text = """a series resonant converter
V1 a 0 PULSE(-24 24 0 50n 50n 4.95u 10u)
L1 a b 20u
C1 b c 100n
D1 c p dm
D2 0 p dm
D3 n c dm
D4 n 0 dm
Co p n 47u ic=12
Rl p n 10
Rg n 0 1meg
.model dm D(is=1e-10 n=1.1 rs=10m cjo=150p)
.tran 0.1u 20u uic
.end
"""
    result, other = run(text, f"method={method} reltol=1e-9"), run(text, "method=gear reltol=1e-6")
    times = 1e-7 * np.arange(1, 200)
    assert np.abs(result.at("v(c)", times) - other.at("v(c)", times)).max() < 1e-3 * np.ptp(other["v(c)"])
