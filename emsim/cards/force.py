"""FORCE: a force on a point of a body, in world axes. Power: f . v of the point."""

from __future__ import annotations

from .base import Card, Default, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import Net, Pen, PointView, Powers, Probes, Scalar, Scene

AXES = ("fx", "fy", "fz")


class Force(Card):
    spec = Spec(
        "FORCE",
        "FORCE name P dir=(x,y) value/{expr}/SIN(..)/PULSE(..)/PWL(..)   or   FORCE name P fx={} fy={}",
        terminals="p:point",
        mark=("dir", "fx", "fy", "fz"),
        meaning="a force on a point of a body",
        meant={"": "dir=(1,0) {}", "f": "dir=(1,0) {}", "force": "dir=(1,0) {}", "value": "dir=(1,0) {}"},
        dir=Default(None, "", "direction in world axes; its length does not count", "vector"),
        value=Default(None, "N", "the force along dir: number, {expression} or waveform", "value"),
        fx=Default(None, "N", "force along world x", "value"),
        fy=Default(None, "N", "force along world y", "value"),
        fz=Default(None, "N", "force along world z", "value"),
    )
    valued = True
    dir: tuple[float, ...] | None
    value: Any
    fx: Any
    fy: Any
    fz: Any
    p: PointView

    def check(self, sink: Sink) -> None:
        components = [a for a in AXES if getattr(self, a) is not None]
        if self.dir is not None and components:
            sink.error(
                "E240", f"FORCE {self.name} has both dir= and {components[0]}=", self.span, self.spec.form
            )
        elif self.dir is not None and self.value is None:
            sink.error(
                "E230", f"FORCE {self.name} needs a value: number, {{expression}} or waveform", self.span
            )
        elif self.dir is None and self.value is not None:
            sink.error("E230", f"FORCE {self.name} needs dir= (its direction)", self.span, self.spec.form)
        elif self.dir is None and not components:
            sink.error(
                "E230", f"FORCE {self.name} needs dir= and a value, or fx= fy=", self.span, self.spec.form
            )
        if self.dir is not None:
            length = sum(c * c for c in self.dir) ** 0.5
            if len(self.dir) not in (2, 3) or length == 0.0:
                sink.error(
                    "E232", f"dir= of FORCE {self.name} is a direction such as (1,0)", self.place("dir")
                )
                return
            self.unit = [*(c / length for c in self.dir), 0.0][:3]

    def leaves_plane(self) -> bool:
        return bool(self.unit[2]) if self.dir is not None else self.fz is not None

    def prepare(self, s: Scene) -> None:
        self.components: list[Expr | float] | None = None

    def _vector(self, s: Scene) -> list[Expr | float]:
        """The force in world axes [N]."""
        if self.components is None:
            if self.dir is not None:
                value = s.compile(self.value, self.place("value"))
                self.components = [value * c if c else 0.0 for c in self.unit]
            else:
                given = [(getattr(self, a), self.place(a)) for a in AXES]
                self.components = [0.0 if v is None else s.compile(v, at) for v, at in given]
        return self.components

    def powers(self, s: Scene) -> Powers:
        pairs = zip(self._vector(s), self.p.vel, strict=True)
        return [(f, v) for f, v in pairs if not isinstance(f, float)]

    def supplied(self, s: Scene) -> Scalar:
        return sum((effort * flow for effort, flow in self.powers(s)), s.b.const(0.0))

    def probes(self, s: Scene) -> Probes:
        power = self.supplied(s)
        if self.dir is not None:
            return {"force": s.compile(self.value, self.place("value")), "power": power}
        squares = sum((f * f for f in self._vector(s)), s.b.const(0.0))
        return {"force": s.b.call("sqrt", squares), "power": power}

    def glyph(self, draw: Pen) -> None:
        parts = [
            draw.channel(f"{a}({self.name})", "N", f) for a, f in zip(AXES, self._vector(draw.m), strict=True)
        ]
        draw.add("force", self, at=draw.terminal(self, "p"), vector=parts)

    def analogue(self, net: Net) -> None:
        """A current source; on a pinned body one that depends on its angle."""
        body, point = net.located(self, "p")
        node = net.node(body)
        if node == "0":
            return
        given = [(getattr(self, a), 1.0) for a in AXES]
        parts = given if self.dir is None else [(self.value, c) for c in self.unit]
        name = f"f_{self.name}"
        if not net.turns(body):
            along = net.direction(body)
            for k, (value, c) in enumerate(parts):
                if value is not None and c * along[k]:
                    net.current(f"{name}{AXES[k]}", node, "0", value, "force", c * along[k])
            return
        # the force as voltages, then its moment
        texts = []
        for k, (value, c) in enumerate(parts[:2]):
            if value is None or not c:
                texts.append("0")
                continue
            net.voltage(f"{name}{AXES[k]}", value, c)
            texts.append(f"v({name}{AXES[k]})")
        net.add(f"B{name} 0 {node} i='{net.moment(body, point, *texts)}'", "moment of the force")
