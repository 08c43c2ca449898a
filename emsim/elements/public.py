"""Public compact models that are not among the devices here: how the names of their modules begin, and under which levels the
simulators have them. Their texts run by `.hdl`, or by level once `emsim models add` has read them (added.py).

Sources of the numbers: ngspice, src/spicelib/parser/inpdomod.c; Xyce, what its device models register (registerModelType in
src/DeviceModelPKG). HSPICE's were not compared with its manuals.
Names of modules are those of the published Verilog-A.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable


class Public:
    """One model: what it is called, the letter of its lines, how its modules are called from their beginning on (in lower
    case), and its levels by simulator."""

    __slots__ = ("heads", "letter", "levels", "title")

    def __init__(self, title: str, letter: str, heads: str, **levels: tuple[int, ...]) -> None:
        self.title, self.letter, self.heads, self.levels = title, letter, tuple(heads.split()), levels

    def numbers(self) -> list[int]:
        """Its levels, each once."""
        return sorted({number for numbers in self.levels.values() for number in numbers})

    def where(self, level: int) -> str:
        """The simulators that have it under a level: `HSPICE and Xyce`."""
        return " and ".join(SPELLED[name] for name, numbers in self.levels.items() if level in numbers)


SPELLED = {"ngspice": "ngspice", "xyce": "Xyce", "hspice": "HSPICE"}
# a longer beginning stands before a shorter one
PUBLIC = (
    Public("MEXTRAM 505", "q", "bjt505 bjtd505"),
    Public("MEXTRAM 504 with self-heating", "q", "bjt504t bjtd504t", ngspice=(6,), xyce=(505,)),
    Public("MEXTRAM 504", "q", "bjt504 bjtd504", xyce=(504,), hspice=(6,)),
    Public("HICUM level 0", "q", "hicuml0 hic0", ngspice=(7,), xyce=(230,), hspice=(13,)),
    Public("HICUM level 2", "q", "hicuml2 hicum", ngspice=(8,), xyce=(234,), hspice=(8,)),
    Public("VBIC 1.3", "q", "vbic13", xyce=(11, 12)),
    Public("FBH HBT", "q", "fbh_hbt hbt_x", xyce=(23,)),
    Public("BSIM1", "m", "bsim1 sp_bsim1", ngspice=(4,)),
    Public("BSIM2", "m", "bsim2 sp_bsim2", ngspice=(5,)),
    Public("EKV 2.6", "m", "ekv_va ekv26 ekv", ngspice=(44,), xyce=(260,), hspice=(55,)),
    Public("PSP 102", "m", "psp102 pspnqs102", ngspice=(45,), xyce=(102,)),
    Public("PSP 103 with self-heating", "m", "psp103t", xyce=(1031,)),
    Public("PSP 104", "m", "psp104 pspnqs104"),
    Public("PSPHV", "m", "psphv"),
    Public("PSP 103", "m", "psp103 pspnqs103 psp", xyce=(103,), hspice=(69,)),
    Public("BSIM3SOI, fully depleted", "m", "b3soifd sp_b3soifd", ngspice=(55,), hspice=(59,)),
    Public("BSIM3SOI, dynamically depleted", "m", "b3soidd sp_b3soidd", ngspice=(56,), hspice=(60,)),
    Public("BSIM3SOI", "m", "b3soi sp_b3soi", ngspice=(57,), xyce=(10, 57), hspice=(57,)),
    Public("BSIMSOI 4", "m", "bsimsoi", ngspice=(10, 58), xyce=(70, 70450, 70470), hspice=(70,)),
    Public("HiSIM2", "m", "hisim2", ngspice=(68,), hspice=(68,)),
    Public("HiSIM_HV", "m", "hisimhv hisim_hv", ngspice=(73,), hspice=(73,)),
    Public("BSIM-CMG", "m", "bsimcmg", xyce=(107, 108, 110, 111), hspice=(72,)),
    Public("BSIM-BULK (BSIM6)", "m", "bsimbulk bsim6", ngspice=(16,), xyce=(77,), hspice=(77,)),
    Public("L-UTSOI", "m", "l_utsoi", xyce=(10240,), hspice=(76,)),
    Public("MVS, ETSOI", "m", "mvs_2_0_0_etsoi", xyce=(2000,)),
    Public("MVS, HEMT", "m", "mvs_2_0_0_hemt", xyce=(2001,)),
    Public("MVSG-HV", "m", "mvsg_cmc", xyce=(2002,)),
    Public("BSIM-IMG", "m", "bsimimg"),
    Public("ASM-HEMT", "m", "asmhemt"),
    Public("MESA", "z", "mesa sp_mesa", ngspice=(2, 3, 4)),
    Public("HFET 1", "z", "hfet1 sp_hfet1", ngspice=(5,)),
    Public("HFET 2", "z", "hfet2 sp_hfet2", ngspice=(6,)),
    Public("JUNCAP200", "d", "juncap200", xyce=(200,)),
    Public("DIODE_CMC", "d", "diode_cmc", xyce=(2002,)),
)  # fmt: skip


def of_level(letter: str, level: int) -> list[Public]:
    """What the simulators mean by a level of a letter; more than one where they differ."""
    return [p for p in PUBLIC if p.letter == letter and level in p.numbers()]


def of_module(name: str) -> Public | None:
    """The model of a module, by its name."""
    return next((p for p in PUBLIC if name.lower().startswith(p.heads)), None)


def told(models: Iterable[Public], level: int) -> str:
    """`EKV 2.6 (HSPICE), BSIM3SOI (ngspice)`."""
    return ", ".join(f"{p.title} ({p.where(level)})" if p.where(level) else p.title for p in models)
