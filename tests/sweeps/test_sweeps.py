"""Many runs of one deck: what varies, random values, yield, and that neither workers nor interruptions change a bit."""

from __future__ import annotations

import json
import math
import os
import random
import signal
import subprocess
import sys
import time
from statistics import NormalDist

import numpy as np
import pytest

import emsim
from emsim.cli import main
from emsim.sweeps.axes import Axis, parse
from emsim.sweeps.result import Goal

RC = """rc
.param r=1k
V1 a 0 PULSE(0 1 0 1p 1p 1 2)
R1 a b {r}
C1 b 0 1u
.options reltol=1e-7
.tran 50u 5m
.meas tran t50 WHEN v(b)=0.5
.meas tran top MAX v(b)
.end
"""
DIVIDER = """divider
V1 in 0 10
R1 in out {agauss(1k,50,3)}
R2 out 0 {unif(1k,0.05)}
.op
.meas op vout FIND v(out)
.end
"""


# ---- what varies -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("r=1k..4k:4", (1e3, 2e3, 3e3, 4e3)),
        ("r=1k..1meg:4log", (1e3, 1e4, 1e5, 1e6)),
        ("r=10..1000:1dec", (10.0, 100.0, 1000.0)),
        ("r=1..10:1oct", (1.0, 2.0, 4.0, 8.0, 10.0)),
        ("R=1k,2.2k, 4.7k", (1e3, 2.2e3, 4.7e3)),
        ("r=-1..1:3", (-1.0, 0.0, 1.0)),
        ("r=.5..1.5:3", (0.5, 1.0, 1.5)),
        ("r=4k..1k:2", (4e3, 1e3)),
    ],
)
def test_axes(text, values):
    found = parse(text)
    assert isinstance(found, Axis) and found.name == "r"
    assert found.values == pytest.approx(values, rel=1e-14)
    assert found.values[-1] == values[-1]  # to the last bit


@pytest.mark.parametrize(
    "text", ["r=1k..", "r=1..2", "r=0..1:3log", "r=1,x", "r", "r=", "r=1..2:0", "r=1..1e9:1000000000"]
)
def test_axes_that_are_none(text):
    with pytest.raises(ValueError, match="r"):
        parse(text)


def test_a_grid_of_parameter_and_element_follows_its_closed_form():
    s = emsim.sweep(RC, {"r": [100.0, 1e3], "c1": [1e-6, 2e-6, 3e-6]}, signals=["v(b)"])
    assert s.shape == (2, 3) and s.complete and not s.failed
    tau = np.outer([100.0, 1e3], [1e-6, 2e-6, 3e-6])
    np.testing.assert_allclose(s.measure("t50"), tau * math.log(2.0), rtol=1e-6)
    t, v = s.signal("v(b)")
    assert v.shape == (2, 3, 101)
    np.testing.assert_allclose(v, 1.0 - np.exp(-t / tau[..., None]), atol=1e-6)
    assert s.values(4) == {"r": 1e3, "c1": 2e-6}


def test_signals_over_frequency_and_complex_ones():
    """A complex signal was kept as its real part, over an axis that was called time."""
    deck = (
        "t\n.param r=1k\nV1 a 0 AC 1\nR1 a b {r}\nC1 b 0 1u\n.ac dec 3 10 1k\n.meas ac g MAX vdb(b)\n.end\n"
    )
    data = emsim.sweep(deck, ["r=1k,2k"], signals="vdb(b)").to_xarray()
    assert data["vdb(b)"].dims == ("r", "frequency")
    f, r = data["frequency"].to_numpy(), np.array([[1e3], [2e3]])
    np.testing.assert_allclose(
        data["vdb(b)"], -10.0 * np.log10(1.0 + (2.0 * np.pi * f * r * 1e-6) ** 2), atol=1e-9
    )
    assert all(
        "E348: `v(b)` is complex" in said
        for said in emsim.sweep(deck, ["r=1k,2k"], signals="v(b)").failed.values()
    )


def test_each_run_is_the_run_of_its_deck():
    s = emsim.sweep(RC, ["r=500,2k"])
    for value, top in zip((500, 2000), s.measure("top"), strict=True):
        assert emsim.run(RC, defines={"r": value}).measures["top"] == top


def test_a_source_an_inductor_and_a_deck_without_measures():
    deck = "t\nV1 a 0 5\nR1 a b 1k\nL1 b 0 1m\nI1 0 c 1m\nR2 c 0 1k\n.op\n.print op v(c) i(l1)\n.end\n"
    s = emsim.sweep(deck, {"v1": [1.0, 2.0], "i1": [1e-3, 3e-3]})
    np.testing.assert_allclose(s.measure("v(c)"), [[1.0, 3.0], [1.0, 3.0]], rtol=1e-9)
    np.testing.assert_allclose(s.measure("i(l1)"), [[1e-3, 1e-3], [2e-3, 2e-3]], rtol=1e-9)


def test_temperature_and_a_parameter_of_a_model():
    deck = "t\nV1 a 0 5\nR1 a b 1k tc1=1m\nR2 b 0 1k\nD1 a d dd\nR3 d 0 1k\n.model dd d(is=1e-14)\n.op\n"
    deck += ".print op v(b) v(d)\n.end\n"
    s = emsim.sweep(deck, {"temp": [27.0, 127.0]})
    np.testing.assert_allclose(s.measure("v(b)"), [2.5, 5.0 / 2.1], rtol=1e-9)
    s = emsim.sweep(deck, {"dd(is)": [1e-14, 1e-12]})
    low, high = s.measure("v(d)")
    vt = 1.38064852e-23 / 1.6021766208e-19 * 300.15
    assert high - low == pytest.approx(
        vt * math.log(100.0 * low / high), rel=1e-3
    )  # drops by the ratio of is, but for i


@pytest.mark.parametrize("card", [".step param r list 1 2", ".control\nrun\n.endc"])
def test_a_deck_that_says_itself_what_is_run(card):
    with pytest.raises(emsim.DeckError, match="E348"):
        emsim.sweep(f"t\n.param r=1\nV1 a 0 1\nR1 a 0 {{r}}\n{card}\n.op\n.print op i(v1)\n.end\n", ["r=1,2"])


def test_a_machine():
    deck = """arm
.param m=0.2
.gravity 9.81
BODY a shape=rod(0.3) m={m}
JOINT h 0 a pin ic=0.1
SPRING s h k=2 q0=0
.op static
.print op angle(h)
.end
"""
    s = emsim.sweep(deck, {"m": [0.1, 0.2]})
    for m, angle in zip(
        (0.1, 0.2), s.measure("angle(h)"), strict=True
    ):  # k q + m g l/2 cos q = 0, the rod along x
        assert 2.0 * angle + m * 9.81 * 0.15 * math.cos(angle) == pytest.approx(0.0, abs=1e-9)


# ---- random values -----------------------------------------------------------------------------


def test_yield_of_a_normal_and_of_an_even_value():
    deck = "t\nV1 a 0 {agauss(5,0.6,3)}\nR1 a 0 1k\nV2 b 0 {unif(5,0.1)}\nR2 b 0 1\n.op\n"
    deck += ".meas op x FIND v(a)\n.meas op y FIND v(b)\n.end\n"
    for scheme, runs, tolerance in (("mc", 2000, 0.035), ("lhs", 512, 0.01), ("sobol", 512, 0.01)):
        s = emsim.sweep(deck, scheme=scheme, runs=runs)
        met, n, low, high = s.yielded([Goal("x < 5.2")])
        assert n == runs and low < met / n < high
        assert met / n == pytest.approx(NormalDist().cdf(1.0), abs=tolerance)
        assert s.yielded([Goal("y>=4.75")])[0] / n == pytest.approx(0.75, abs=tolerance)
        both = NormalDist().cdf(1.0) * 0.75
        assert s.yielded([Goal("x<5.2"), Goal("y>=4.75")])[0] / n == pytest.approx(both, abs=0.04)
        assert s.statistics("x")["mean"] == pytest.approx(5.0, abs=0.02)
        assert s.statistics("x")["deviation"] == pytest.approx(0.2, rel=0.05)


def test_yield_of_a_filter():
    # corner 1/(2 pi r c) below 1.65 kHz: r c above 96.4575 us, r even within 10 % of 1k, c = 100 nF
    deck = "t\nV1 a 0 AC 1\nR1 a b {unif(1k,0.1)}\nC1 b 0 100n\n.ac dec 200 100 100k\n.meas ac corner WHEN vdb(b)=-3.0103\n.end\n"
    s = emsim.sweep(deck, scheme="lhs", runs=256)
    share = s.yielded([Goal("corner<1.65k")])[0] / 256
    least = 1.0 / (2.0 * math.pi * 1.65e3 * 100e-9)
    assert share == pytest.approx((1100.0 - least) / 200.0, abs=0.02)


def test_corners_and_one_at_a_time():
    corners = emsim.sweep(DIVIDER, scheme="corners")
    wanted = {10.0 * b / (a + b) for a in (950.0, 1050.0) for b in (950.0, 1050.0)}
    assert sorted(corners.measure("vout")) == pytest.approx(sorted([*wanted, 5.0]), rel=1e-9)
    s = emsim.sweep(DIVIDER, scheme="sensitivity")
    assert len(s) == 5
    found = {label.partition("(")[0]: (low, high) for label, low, high in s.influences("vout")}
    assert found["agauss"] == pytest.approx((10.0 * 1000 / 1950 - 5.0, 10.0 * 1000 / 2050 - 5.0), rel=1e-9)
    assert found["unif"] == pytest.approx((10.0 * 950 / 1950 - 5.0, 10.0 * 1050 / 2050 - 5.0), rel=1e-9)


def test_a_grid_of_monte_carlo_has_a_dimension_for_its_runs():
    s = emsim.sweep(
        DIVIDER.replace("agauss(1k,", "agauss(r,").replace("V1", ".param r=1k\nV1", 1), ["r=500,1k"], "mc", 40
    )
    assert s.shape == (2, 40)
    means = s.measure("vout").mean(axis=1)
    assert means == pytest.approx([10.0 / 1.5, 5.0], rel=0.02)


# ---- bits ----------------------------------------------------------------------------------------


def bits(s) -> list[bytes]:
    return [s.measure(name).tobytes() for name in s.names]


def test_workers_change_no_bit():
    alone = emsim.sweep(DIVIDER, scheme="mc", runs=60, seed=3)
    assert bits(alone) == bits(emsim.sweep(DIVIDER, scheme="mc", runs=60, seed=3, jobs=2))
    assert bits(alone) != bits(emsim.sweep(DIVIDER, scheme="mc", runs=60, seed=4))


def test_an_interrupted_sweep_goes_on(tmp_path):
    whole = emsim.sweep(DIVIDER, scheme="mc", runs=50)
    path = str(tmp_path / "j")
    part = emsim.sweep(DIVIDER, scheme="mc", runs=50, journal=path, progress=lambda done, runs: True)
    assert 1 <= len(part.outcomes) < 50 and not part.complete
    with open(path, "a", encoding="utf-8") as file:
        file.write('[49, {"vout": 1')  # a crash in the middle of a line
    rest = emsim.sweep(DIVIDER, scheme="mc", runs=50, journal=path)
    assert rest.resumed == len(part.outcomes) and rest.complete
    assert bits(rest) == bits(whole)
    assert not os.path.exists(path)


def test_a_journal_of_another_sweep_is_not_used(tmp_path):
    path = str(tmp_path / "j")
    emsim.sweep(DIVIDER, scheme="mc", runs=50, journal=path, progress=lambda done, runs: True)
    other = emsim.sweep(DIVIDER.replace("10", "11", 1), scheme="mc", runs=50, journal=path)
    assert other.resumed == 0 and other.statistics("vout")["mean"] > 5.3


@pytest.mark.skipif(os.name != "posix", reason="kill")
def test_a_killed_sweep_goes_on_to_the_same_bits(tmp_path):
    slow = DIVIDER.replace(".op\n", ".op\nV9 s 0 SIN(0 1 10k)\nR9 s t 1k\nC9 t 0 1n\n.tran 1u 30m\n")
    (tmp_path / "d.cir").write_text(slow)
    command = [sys.executable, "-m", "emsim", "sweep", "d.cir", "--mc", "24", "-j", "1", "-q"]
    process = subprocess.Popen(command, cwd=tmp_path)
    journal = tmp_path / "d.sweep.journal"
    end = time.monotonic() + 60
    while not (journal.exists() and len(journal.read_text().splitlines()) > 3):
        assert time.monotonic() < end and process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert not (tmp_path / "d.sweep.csv").exists()
    done = subprocess.run(command[:-1], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and "of them from before" in done.stdout
    whole = emsim.sweep(slow, scheme="mc", runs=24)
    rows = (tmp_path / "d.sweep.csv").read_text().splitlines()[1:]
    assert [float(row.split(",")[-2]) for row in rows] == list(whole.measure("vout"))


def test_a_dask_cluster_whose_workers_die_at_random_moments(tmp_path):
    distributed = pytest.importorskip("distributed")
    (tmp_path / "d.cir").write_text(
        DIVIDER.replace(".op\n", ".op\nV9 s 0 SIN(0 1 10k)\nR9 s t 1k\nC9 t 0 1n\n.tran 1u 10m\n")
    )
    path = str(tmp_path / "d.cir")
    alone = emsim.sweep(path, scheme="mc", runs=80)
    local = {"processes": True, "host": "127.0.0.1", "dashboard_address": None, "silence_logs": 50}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **local) as cluster:
        chance, killed = random.Random(1), []
        moments = sorted(chance.sample(range(1, 80), 3))
        with distributed.Client(cluster, set_as_default=False) as client:
            pids = list(client.run(os.getpid).values())
            assert len(pids) == 2 and os.getpid() not in pids

            def kill_one(done: int, runs: int) -> None:
                if moments and done >= moments[0]:
                    while moments and done >= moments[0]:
                        moments.pop(0)
                    client.wait_for_workers(2, timeout=60)
                    killed.append(chance.choice(list(client.run(os.getpid, on_error="ignore").values())))
                    os.kill(killed[-1], signal.SIGKILL)

            s = emsim.sweep(path, scheme="mc", runs=80, cluster=cluster.scheduler_address, progress=kill_one)
    assert killed and s.complete
    assert bits(s) == bits(alone)


def test_a_scheduler_that_dies_is_told_and_what_was_done_is_kept(tmp_path):
    pytest.importorskip("distributed")
    (tmp_path / "d.cir").write_text(
        DIVIDER.replace(".op\n", ".op\nV9 s 0 SIN(0 1 10k)\nR9 s t 1k\nC9 t 0 1n\n.tran 1u 10m\n")
    )
    path, journal, told = str(tmp_path / "d.cir"), str(tmp_path / "j"), tmp_path / "scheduler.json"
    command = [
        sys.executable,
        "-m",
        "distributed.cli.dask_scheduler",
        "--host",
        "127.0.0.1",
        "--port",
        "0",
        "--no-dashboard",
    ]
    scheduler = subprocess.Popen([*command, "--scheduler-file", str(told)], stderr=subprocess.DEVNULL)
    workers: list[subprocess.Popen[bytes]] = []
    try:
        end = time.monotonic() + 60
        while not told.exists():
            assert time.monotonic() < end and scheduler.poll() is None
            time.sleep(0.05)
        address = json.loads(told.read_text())["address"]
        worker = [
            sys.executable,
            "-m",
            "distributed.cli.dask_worker",
            address,
            "--host",
            "127.0.0.1",
            "--no-dashboard",
            "--no-nanny",
        ]
        workers = [
            subprocess.Popen(
                [*worker, "--no-nanny", "--nthreads", "1", "--death-timeout", "5"],
                stderr=subprocess.DEVNULL,
                cwd=tmp_path,
            )
            for _ in range(2)
        ]

        def kill(done: int, runs: int) -> None:
            scheduler.kill()

        with pytest.raises(emsim.OutsideError) as caught:
            emsim.sweep(path, scheme="mc", runs=160, cluster=address, journal=journal, progress=kill)
        assert [d.code for d in caught.value.diagnostics] == ["E523"]
    finally:
        for process in (scheduler, *workers):
            process.kill()
            process.wait()
    s = emsim.sweep(path, scheme="mc", runs=160, journal=journal, jobs=None)
    assert s.resumed and bits(s) == bits(emsim.sweep(path, scheme="mc", runs=160))


# ---- failures, files, the command ------------------------------------------------------------------


def test_runs_that_fail_are_kept_apart(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "d.cir").write_text(
        "t\n.param x=1\nV1 a 0 1\nR1 a 0 {1/x}\n.op\n.meas op i FIND i(v1)\n.end\n"
    )
    assert main(["sweep", "d.cir", "-D", "x=1,0,2", "-j", "1"]) == 0
    told = capsys.readouterr()
    assert "warning[W430]: 1 of 3 runs failed: E124" in told.err and "in 2 runs" in told.out
    rows = (tmp_path / "d.sweep.csv").read_text().splitlines()
    assert rows[0] == "run,x,i,error" and rows[2].startswith("1,0.0,nan,") and "E124" in rows[2]
    assert main(["sweep", "d.cir", "-D", "x=0,0", "-j", "1"]) == 1
    assert "error[E432]" in capsys.readouterr().err


def test_warnings_of_runs_are_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "d.cir").write_text(
        "t\n.param r=1\nV1 a 0 1\nR1 a b {r}\nR2 b 0 1\n.op\n.print op v(b)\n.end\n"
    )
    assert main(["sweep", "d.cir", "-D", "r=1,0", "-j", "1"]) == 0
    assert "warning[W281]" in (said := capsys.readouterr().err) and "in 1 of 2 runs, the first is 1" in said


def test_files_and_pictures(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rc.cir").write_text(RC)
    assert (
        main(
            [
                "sweep",
                "rc.cir",
                "-D",
                "r=100..10k:5log",
                "--save",
                "v(b)",
                "-o",
                "rc.nc",
                "--plot",
                "rc.svg",
                "-j",
                "1",
            ]
        )
        == 0
    )
    import xarray as xr

    with xr.open_dataset(tmp_path / "rc.nc", engine="h5netcdf") as data:
        assert data["v(b)"].dims == ("r", "time") and data["v(b)"].shape == (5, 101)
        assert float(data["t50"].sel(r=1000.0, method="nearest")) == pytest.approx(
            1e-3 * math.log(2.0), rel=1e-6
        )
    assert "</svg>" in (tmp_path / "rc.svg").read_text()
    pytest.importorskip("zarr")
    assert main(["sweep", "rc.cir", "-D", "r=1k,2k", "-o", "rc.zarr", "-q", "-j", "1"]) == 0
    with xr.open_zarr(tmp_path / "rc.zarr") as data:
        assert data["t50"].shape == (2,)


@pytest.mark.parametrize("args", [["--mc", "50"], ["--sensitivity"], ["--corners"]])
def test_pictures_of_random_values(args, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "d.cir").write_text(DIVIDER)
    assert main(["sweep", "d.cir", *args, "--plot", "d.png", "-j", "1", "--goal", "vout<5.1"]) == 0
    assert (tmp_path / "d.png").read_bytes()[:4] == b"\x89PNG"


def test_as_json(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "d.cir").write_text(DIVIDER)
    assert main(["sweep", "d.cir", "--lhs", "16", "--goal", "vout>0", "--json", "-j", "1"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["runs"] == 16 and told["goals"]["met"] == 16 and set(told["measures"]) == {"vout"}
    assert told["random_values"] == {"r1": "agauss(1000,50,3) line 3", "r2": "unif(1000,0.05) line 4"}


@pytest.mark.parametrize(
    ("args", "code", "said"),
    [
        (["-D", "q=1,2"], 1, "E346"),
        (["-D", "v1=1,2"], 1, "E345"),  # a source with a waveform
        (["-D", "r=1.."], 1, "E348"),
        (["-D", "r=1,2", "-D", "r=1"], 1, "given twice"),
        (["--mc", "5"], 1, "E347"),
        (["--mc", "5", "--lhs", "5"], 2, "exclude each other"),
        (["--goal", "vmax"], 2, "a goal is"),
        (["-D", "r=1,2", "--goal", "nothing<1"], 2, "no measure nothing"),
        (["-o", "x.txt"], 2, ".csv, .parquet, .nc or .zarr"),
        (["--plot", "x.txt"], 2, ".png, .svg or .pdf"),
        (["-D", "r=1,2", "--dask", "tcp://127.0.0.1:9"], 5, "E522"),
    ],
)
def test_what_is_wrong_is_said(args, code, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    deck = "t\n.param r=1\nV1 a 0 PULSE(0 1 0 1u 1u 1m)\nR1 a 0 {r}\n.op\n.print op v(a)\n.end\n"
    (tmp_path / "d.cir").write_text(deck)
    assert main(["sweep", "d.cir", "-j", "1", *args]) == code
    assert said in capsys.readouterr().err


TOLERANCES = """a divider of parts that are off
V1 in 0 10
R1 in out 1k tol=5%
R2 out 0 1k tol=5
.op
.meas op vout FIND v(out)
.end
"""


def test_tolerances_of_cards_are_drawn_in_sweeps_alone():
    assert emsim.run(TOLERANCES).measures["vout"] == 5.0
    assert emsim.sweep(TOLERANCES, {"v1": [10.0]}).measure("vout")[0] == 5.0
    corners = emsim.sweep(TOLERANCES, scheme="corners")
    # 10 * 1.05/(0.95 + 1.05) and its mirror
    assert sorted(corners.measure("vout")) == pytest.approx([4.75, 5.0, 5.0, 5.25])
    assert corners.labels == ["r1 tol=5% line 3", "r2 tol=5% line 4"]


def test_the_yield_of_a_divider_with_tolerances_is_the_closed_form():
    # the share of the square |a|, |b| <= 0.05 in which (1 + b)/(2 + a + b) < 0.51, or 0.49 b - 0.51 a < 0.02
    a = (np.arange(4000) + 0.5) / 2000 - 1.0
    share = np.mean(np.clip(((0.02 + 0.51 * 0.05 * a) / 0.49 / 0.05 + 1.0) / 2.0, 0.0, 1.0))
    swept = emsim.sweep(TOLERANCES, scheme="sobol", runs=4096)
    met, runs, low, high = swept.yielded([Goal("vout<5.1")])
    assert met / runs == pytest.approx(share, abs=2e-3) and low < share < high


def test_the_worst_case_by_sensitivities_is_that_of_the_corners():
    swept = emsim.sweep(TOLERANCES, scheme="sensitivity")
    assert swept.worst("vout") == pytest.approx((4.75, 5.25))


def test_a_tolerance_of_more_than_all_is_refused():
    with pytest.raises(emsim.DeckError, match="cannot be off"):
        emsim.run(TOLERANCES.replace("5%", "150%"))


def test_words_of_machine_cards_and_elements_are_swept():
    deck = "a motor\nV1 a 0 1\nBODY rotor m=1 j=1m\nJOINT shaft 0 rotor pin\nMOTOR m1 a 0 shaft kt=0.1 r=1\n.tran 1m 0.5 uic\n"
    deck += ".meas tran speed FIND omega(shaft) AT=0.5\n.end\n"
    # w = v/k (1 - exp(-k^2 t/(r j)))
    found = emsim.sweep(deck, {"m1(kt)": [0.1, 0.05]}).measure("speed")
    exact = [1.0 / k * (1.0 - np.exp(-(k**2) * 0.5 / 1e-3)) for k in (0.1, 0.05)]
    assert found == pytest.approx(exact, rel=1e-3)
    with pytest.raises(emsim.DeckError, match="has no number `kv`"):
        emsim.sweep(deck, {"m1(kv)": [0.1]})


def test_the_page_of_a_sweep(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "d.cir").write_text(TOLERANCES)
    assert (
        main(["sweep", "d.cir", "--sensitivity", "--goal", "vout<5.1", "--html", "d.html", "-j", "1", "-q"])
        == 0
    )
    page = (tmp_path / "d.html").read_text()
    assert page.startswith("<!doctype html>") and "a divider of parts that are off" in page
    assert "<td>4.75</td><td>5.25</td>" in page and "Yield 60 %" in page
    assert page.count("<svg") == 1 and "http://www.w3.org" in page and "<script" not in page


def test_forked_workers_change_no_bit():
    """In a process of one thread workers are forked, elsewhere they are made anew: the same bits."""
    code = "import emsim, json; s = emsim.sweep(DECK, ['r=1k..2k:40'], jobs=JOBS); print(json.dumps(s.measure('top').tolist()))"
    told = [
        subprocess.run(
            [sys.executable, "-c", code.replace("DECK", repr(RC)).replace("JOBS", jobs)],
            capture_output=True, text=True, timeout=120, check=True,
        ).stdout
        for jobs in ("1", "2")
    ]  # fmt: skip
    assert told[0] == told[1] and len(json.loads(told[0])) == 40


def test_a_signal_of_an_operating_point_is_one_value_a_run(tmp_path, monkeypatch):
    """`--save` with .op ended in an internal error."""
    import xarray

    monkeypatch.chdir(tmp_path)
    (tmp_path / "d.cir").write_text("t\n.param r=1k\nV1 in 0 10\nR1 in out {r}\nR2 out 0 1k\n.op\n.end\n")
    assert main(["sweep", "d.cir", "-D", "r=1k,2k", "--save", "v(out)", "-o", "x.nc", "-j", "1"]) == 0
    with xarray.open_dataset("x.nc") as found:
        assert found["v(out)"].dims == ("r",)
        assert found["v(out)"].values == pytest.approx([5.0, 10 / 3])


def test_signals_of_each_analysis(tmp_path, monkeypatch, capsys):
    """An RC at rest, over frequency, and its noise 4 k T r / (1 + (w r c)^2), each over an axis of its own."""
    import xarray

    monkeypatch.chdir(tmp_path)
    (tmp_path / "d.cir").write_text(
        "t\n.param r=1k\nV1 a 0 2 AC 1\nR1 a b {r}\nC1 b 0 1u\n.op\n.ac dec 3 10 1k\n.noise v(b) v1 dec 2 1 100\n.end\n"
    )
    names = ["op:v(b)", "ac:vdb(b)", "noise:onoise_spectrum"]
    words = [word for name in names for word in ("--save", name)]
    assert (
        main(["sweep", "d.cir", "-D", "r=1k,2k,4k", *words, "-o", "x.nc", "-j", "1", "--plot", "x.png"]) == 0
    )
    with xarray.open_dataset("x.nc") as found:
        r = found["r"].values[:, None]
        assert found["op:v(b)"].dims == ("r",) and found["op:v(b)"].values == pytest.approx([2.0] * 3)
        f = found[found["ac:vdb(b)"].dims[1]].values
        np.testing.assert_allclose(
            found["ac:vdb(b)"], -10.0 * np.log10(1.0 + (2.0 * np.pi * f * r * 1e-6) ** 2), atol=1e-9
        )
        f = found[found["noise:onoise_spectrum"].dims[1]].values
        density = np.sqrt(4.0 * 1.38064852e-23 * 300.15 * r / (1.0 + (2.0 * np.pi * f * r * 1e-6) ** 2))
        np.testing.assert_allclose(found["noise:onoise_spectrum"], density, rtol=1e-6)
        assert len({d for n in names for d in found[n].dims}) == 3
    capsys.readouterr()
    assert main(["sweep", "d.cir", "-D", "r=1k,2k", "--save", "tran:v(b)", "-j", "1", "-q"]) != 0
    assert "no analysis `tran` ran" in capsys.readouterr().err
