"""What an FMU carries: a library that needs no Python, the model, the description; the same for the same deck."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import zipfile
from pathlib import Path

import pytest

from emsim import _engine
from emsim.diagnostics import DeckError, OutsideError
from emsim.fmus import export
from emsim.fmus.description import exponents
from emsim.fmus.library import binaries, format_of, without_python

RC = "an RC\nV1 in 0 0\nR1 in out 1k\nC1 out 0 1u\n.tran 10u 5m\n.options reltol=1e-9\n.fmu in=v1 out=v(out)\n.end\n"
# leads an instance as a program without Python would: library, resources, token
LEADER = r"""
#include <dlfcn.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
static void say(void *e, int s, const char *c, const char *m) { printf("%d %s\n", s, m); }
int main(int n, char **a) {
    void *lib = dlopen(a[1], RTLD_NOW | RTLD_LOCAL);
    if (!lib) { printf("%s\n", dlerror()); return 1; }
    void *(*make)(const char *, const char *, const char *, bool, bool, bool, bool, const uint32_t *, size_t, void *, void *,
                  void *) = dlsym(lib, "fmi3InstantiateCoSimulation");
    int (*enter)(void *, bool, double, double, bool, double) = dlsym(lib, "fmi3EnterInitializationMode");
    int (*leave)(void *) = dlsym(lib, "fmi3ExitInitializationMode");
    int (*set)(void *, const uint32_t *, size_t, const double *, size_t) = dlsym(lib, "fmi3SetFloat64");
    int (*get)(void *, const uint32_t *, size_t, double *, size_t) = dlsym(lib, "fmi3GetFloat64");
    int (*step)(void *, double, double, bool, bool *, bool *, bool *, double *) = dlsym(lib, "fmi3DoStep");
    void (*end)(void *) = dlsym(lib, "fmi3FreeInstance");
    if (make("wrong", "another token", a[2], 0, 0, 0, 0, 0, 0, 0, say, 0)) return 2;
    void *c = make("one", a[3], a[2], 0, 0, 0, 0, 0, 0, 0, say, 0);
    if (!c) return 3;
    uint32_t in = 1, out = 2;
    double v = 1, last = 0;
    bool b[3];
    if (enter(c, 0, 0, 0, 0, 0) || leave(c) || set(c, &in, 1, &v, 1)) return 4;
    if (step(c, 0, 1e-3, 0, b, b + 1, b + 2, &last) || last != 1e-3) return 5;
    get(c, &out, 1, &v, 1);
    printf("%.9f\n", v);
    end(c);
    return 0;
}
"""
linux = pytest.mark.skipif(os.uname().sysname != "Linux", reason="the engine is an FMU's library on Linux")


def made(folder: Path, version: int = 3) -> Path:
    path = folder / "rc.fmu"
    export(RC, str(path), version)
    return path


@linux
@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a compiler of C")
def test_runs_without_python(tmp_path: Path) -> None:
    with zipfile.ZipFile(made(tmp_path)) as archive:
        archive.extractall(tmp_path)
        text = archive.read("modelDescription.xml").decode()
    token = text.partition('instantiationToken="')[2].partition('"')[0]
    (tmp_path / "leader.c").write_text(LEADER)
    leader = str(tmp_path / "leader")
    subprocess.run(["cc", str(tmp_path / "leader.c"), "-o", leader, "-ldl"], check=True, timeout=120)
    library = next((tmp_path / "binaries").rglob("*.so"))
    done = subprocess.run(
        [leader, str(library), str(tmp_path / "resources"), token], capture_output=True, text=True, timeout=120,
        env={"LD_BIND_NOW": "1"},
    )  # fmt: skip
    refused, value = done.stdout.splitlines()
    assert done.returncode == 0
    assert refused.startswith("3 the description speaks of the model another token")
    assert float(value) == pytest.approx(1 - 2.718281828459045**-1, rel=1e-6)


@linux
def test_the_engine_as_it_is_does_not_load_without_python() -> None:
    """What the change is for: were this to load, nothing would have to be changed."""
    tried = subprocess.run(
        ["/bin/true"],
        env={"LD_PRELOAD": str(_engine.__file__), "LD_BIND_NOW": "1"},
        capture_output=True,
        timeout=60,
    )
    assert tried.returncode != 0 and b"undefined symbol" in tried.stderr


@linux
def test_nothing_but_references_to_python_is_changed() -> None:
    data = Path(str(_engine.__file__)).read_bytes()
    weak = without_python(data)
    assert len(weak) == len(data) and without_python(weak) == weak
    changed = [k for k, (a, b) in enumerate(zip(data, weak, strict=True)) if a != b]
    assert 0 < len(changed) < 400
    assert {data[k] >> 4 for k in changed} == {1} and {weak[k] >> 4 for k in changed} == {2}


def test_the_same_deck_gives_the_same_file(tmp_path: Path) -> None:
    assert made(tmp_path).read_bytes() == made(tmp_path).read_bytes()


def test_licences_go_with_the_library(tmp_path: Path) -> None:
    with zipfile.ZipFile(made(tmp_path)) as archive:
        found = [n for n in archive.namelist() if n.startswith("documentation/licenses/emsim-LICENSE-")]
        assert len(found) == 2 and b"Permission is hereby granted" in b"".join(map(archive.read, found))


def test_another_deck_has_another_token(tmp_path: Path) -> None:
    def token(text: str) -> str:
        export(text, str(tmp_path / "x.fmu"))
        with zipfile.ZipFile(tmp_path / "x.fmu") as archive:
            return archive.read("modelDescription.xml").decode().partition('Token="')[2][:32]

    assert token(RC) == token(RC) != token(RC.replace("1k", "2k"))


@pytest.mark.parametrize(
    ("head", "folders"),
    [
        (b"\x7fELF" + bytes(14) + struct.pack("<H", 0xB7), ("aarch64-linux", None)),
        (b"MZ" + bytes(58) + struct.pack("<I", 64) + b"PE\0\0" + struct.pack("<H", 0x8664), ("x86_64-windows", "win64")),
        (b"\xcf\xfa\xed\xfe" + struct.pack("<I", 0x0100000C), ("aarch64-darwin", None)),
        (b"\xcf\xfa\xed\xfe" + struct.pack("<I", 0x01000007), ("x86_64-darwin", "darwin64")),
    ],
)  # fmt: skip
def test_libraries_of_other_platforms_go_where_fmi_has_them(
    tmp_path: Path, head: bytes, folders: tuple[str, str | None]
) -> None:
    path = tmp_path / "library"
    path.write_bytes(head + b" fmi2Instantiate fmi3InstantiateCoSimulation")
    assert format_of(path.read_bytes()) is not None
    assert binaries([str(path)], 3)[0][0] == folders[0]
    if folders[1] is None:
        with pytest.raises(OutsideError, match=r"FMI 2.0 has no name"):
            binaries([str(path)], 2)
    else:
        assert binaries([str(path)], 2)[0][0] == folders[1]


@pytest.mark.parametrize(
    ("unit", "base"),
    [("V", (1, 2, -3, -1, 0, 0)), ("N m", (1, 2, -2, 0, 0, 0)), ("rad/s^2", (0, 0, -2, 0, 0, 1)), ("N s/m", (1, 0, -1, 0, 0, 0))],
)  # fmt: skip
def test_units_in_base_units(unit: str, base: tuple[int, ...]) -> None:
    assert exponents(unit) == (base, 1.0, 0.0)


def test_a_unit_without_base_units() -> None:
    assert exponents("dB") is None


@pytest.mark.parametrize(
    ("change", "code", "said"),
    [
        (("in=v1", "in=v9"), "E381", "no source and no card `v9`"),
        (("R1 in out 1k", "R1 in out 1k tc=1m\n.fmu in=r1"), "E381", "`r1` cannot come from outside"),
        (("out=v(out)", "out=v(ouch)"), "E289", "ouch"),
        ((".tran 10u 5m", ".step param q 1 2 1\n.tran 10u 5m"), "E383", "steps `q`"),
        ((".options reltol=1e-9", ".options method=multirate"), "E383", "multirate"),
        ((" out=v(out)", ""), "E383", "no output"),
        (
            ("R1 in out 1k", ".param w=1\nR1 in out {1k*w}\nV2 x 0 SIN(0 {w} 1k)\nR2 x 0 1"),
            "E385",
            "`w` comes from outside",
        ),
        (("C1 out 0 1u", "C1 out 0 1u\n.param unread=1"), "E381", "nothing of the deck reads `unread`"),
    ],
)
def test_what_cannot_be_exported_is_told(
    tmp_path: Path, change: tuple[str, str], code: str, said: str
) -> None:
    with pytest.raises(DeckError) as caught:
        more = {"E385": "w", "E381": "unread"}.get(code, "") if ".param" in change[1] else ""
        export(RC.replace(*change), str(tmp_path / "x.fmu"), parameters=more)
    error = next(d for d in caught.value.diagnostics if d.severity == "error")
    assert error.code == code and said in error.message
    assert not (tmp_path / "x.fmu").exists()
