"""Draws the README's picture from a run of the pendulum servo: python netlists/plot_readme.py

Needs emsim[plot]. Writes netlists/coupled/pendulum_servo.png.
"""

from math import degrees
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot

import emsim

ROOT = Path(__file__).resolve().parent.parent
DECK = ROOT / "netlists" / "coupled" / "pendulum_servo.cir"


def main() -> None:
    r = emsim.run(DECK)
    panels = [
        ("arm angle [deg]", [("angle(hinge)", degrees(1.0), "#c8553d")]),
        (
            "voltage [V]",
            [("v(set)", 1.0, "#9aa5b1"), ("v(wip)", 1.0, "#2f6690"), ("v(drive)", 1.0, "#588b8b")],
        ),
        ("motor current [A]", [("i(m1)", 1.0, "#f28f3b")]),
    ]
    figure, axes = pyplot.subplots(len(panels), 1, sharex=True, figsize=(8, 5), layout="constrained")
    for axis, (label, curves) in zip(axes, panels, strict=True):
        for name, factor, colour in curves:
            axis.plot(r.time, factor * r[name], label=name, color=colour)
        axis.set_ylabel(label)
        axis.legend(loc="upper right", fontsize="small")
        axis.grid(alpha=0.25)
    axes[-1].set_xlabel("time [s]")
    axes[0].set_title(r.title, fontsize="medium")
    figure.savefig(DECK.with_suffix(".png"), dpi=100)


if __name__ == "__main__":
    main()
