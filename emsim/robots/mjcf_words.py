"""The words of MJCF (its reference: mujoco.readthedocs.io/en/stable/XMLreference.html), and its classes of defaults.

`read` is read; `idle` does not bear on the motion of what is imported: pictures, solvers, and what softens limits, friction and
loops, which are rigid here.
"""

from __future__ import annotations

from ..diagnostics import suggest
from .xml import Element, Words

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink, Span

TURNED = "quat axisangle xyaxes zaxis euler"
SOFT = "solref solimp solreflimit solimplimit solreffriction solimpfriction margin gap"
DRIVEN = "name class joint tendon gear ctrlrange ctrllimited forcerange forcelimited"
DRIVE_IDLE = "group user lengthrange actlimited actrange actearly"
INSIDE = "inertial joint freejoint geom site camera light body frame"
GROUPS = "compiler option default asset worldbody tendon actuator equality contact keyframe"
UNUSED = ("size", "statistic", "visual", "custom", "sensor")  # sections that do not bear on motion
WORDS = {
    "mujoco": Words("model", "", f"{GROUPS} {' '.join(UNUSED)}"),
    "compiler": Words(
        "angle eulerseq autolimits inertiafromgeom inertiagrouprange balanceinertia boundmass boundinertia settotalmass "
        "coordinate meshdir assetdir",
        "texturedir discardvisual usethread fusestatic alignfree strippath saveinertial convexhull fitaabb exactmeshinertia",
        "lengthrange",
    ),
    "option": Words(
        "gravity timestep density viscosity",
        "wind magnetic integrator cone jacobian solver iterations tolerance ls_iterations ls_tolerance noslip_iterations "
        "noslip_tolerance ccd_iterations ccd_tolerance mpr_iterations mpr_tolerance sdf_iterations sdf_initpoints impratio "
        "apirate o_margin o_solref o_solimp o_friction sleep_tolerance",
        "flag",
    ),
    "flag": Words(
        "equality frictionloss limit contact passive spring damper gravity clampctrl actuation constraint",
        "warmstart filterparent refsafe sensor midphase eulerdamp override energy fwdinv invdiscrete multiccd island nativeccd "
        "autoreset sleep",
    ),
    "worldbody": Words("", "", INSIDE),
    "body": Words(f"name pos {TURNED} childclass mocap gravcomp", "user sleep", INSIDE),
    "frame": Words(f"pos {TURNED} childclass", "name", INSIDE),
    "inertial": Words(f"pos mass diaginertia fullinertia {TURNED}"),
    "joint": Words(
        "name class type pos axis range limited ref springref stiffness damping armature frictionloss springdamper "
        "actuatorfrcrange actuatorfrclimited actuatorgravcomp",
        f"group user {SOFT}",
    ),
    "freejoint": Words("name", "group align"),
    "geom": Words(
        f"name class type pos size fromto mass density shellinertia contype conaffinity mesh group {TURNED}",
        f"condim priority friction solmix material rgba hfield user fluidshape fluidcoef fitscale {SOFT}",
    ),
    "site": Words(f"name class pos fromto {TURNED}", "type group material size rgba user"),
    "mesh": Words(
        "name class file scale refpos refquat vertex inertia",
        "content_type smoothnormal face normal texcoord maxhullvert",
    ),
    "fixed": Words(
        "name class limited range stiffness damping frictionloss springlength armature actuatorfrcrange actuatorfrclimited",
        f"group user {SOFT}",
        "joint",
    ),
    "spatial": Words(
        "name class limited range stiffness damping frictionloss springlength armature actuatorfrcrange actuatorfrclimited",
        f"group user width material rgba {SOFT}",
        "site geom pulley",
    ),
    "motor": Words(DRIVEN, DRIVE_IDLE),
    "position": Words(f"{DRIVEN} kp kv dampratio timeconst inheritrange", DRIVE_IDLE),
    "velocity": Words(f"{DRIVEN} kv", DRIVE_IDLE),
    "damper": Words(f"{DRIVEN} kv", DRIVE_IDLE),
    "general": Words(f"{DRIVEN} dyntype gaintype biastype dynprm gainprm biasprm", DRIVE_IDLE),
    "connect": Words("name class active body1 body2 anchor", SOFT),
    "weld": Words("name class active body1 body2 anchor relpose", f"torquescale {SOFT}"),
    "equality_joint": Words("name class active joint1 joint2 polycoef", SOFT),
    "pair": Words("name class geom1 geom2 condim friction", SOFT),
    "exclude": Words("name body1 body2"),
    "key": Words("name qpos qvel ctrl", "time act mpos mquat"),
}
# what <default> may hold, and which elements it is for
KEYS = {
    "motor": "actuator", "position": "actuator", "velocity": "actuator", "damper": "actuator", "general": "actuator",
    "fixed": "tendon", "spatial": "tendon", "connect": "equality", "weld": "equality", "equality_joint": "equality",
}  # fmt: skip
IDLE_DEFAULTS = (
    "material", "camera", "light", "texture", "hfield", "skin", "intvelocity", "cylinder", "muscle", "adhesion",
)  # fmt: skip
IN_DEFAULT = (
    "joint", "geom", "site", "mesh", "tendon", "equality", "motor", "position", "velocity", "damper", "general", "pair",
    "default", *IDLE_DEFAULTS,
)  # fmt: skip
MAIN = "main"  # the class of the outermost <default>


class Filled(Element):
    """An element with what its class adds to it."""

    __slots__ = ("origins",)

    def __init__(self, own: Element, defaults: dict[str, Element]) -> None:
        super().__init__(own.tag, dict(own.attributes), own.file, own.start)
        self.children = own.children
        self.origins: dict[str, Element] = {}
        for key, origin in defaults.items():
            if key not in own.attributes:
                self.attributes[key] = origin.attributes[key]
                self.origins[key] = origin

    def place(self, key: str) -> Span:
        return self.origins[key].place(key) if key in self.origins else super().place(key)


class Classes:
    """Classes of defaults: {class: {kind of element: {attribute: the element that says it}}}, each with what it inherits."""

    def __init__(self, root: Element, sink: Sink) -> None:
        self.sink = sink
        self.found: dict[str, dict[str, dict[str, Element]]] = {MAIN: {}}
        for element in root.all("default"):
            self._read(element, MAIN, MAIN)
            # the outermost class may have a name of its own
            self.found.setdefault(element.get("class") or MAIN, self.found[MAIN])

    def _read(self, element: Element, name: str, above: str) -> None:
        if above != name or name not in self.found:
            if name in self.found:
                said = f"there are two classes of defaults named {name!r}"
                self.sink.error("E534", said, element.place("class"))
            self.found[name] = {kind: dict(values) for kind, values in self.found[above].items()}
        mine = self.found[name]
        inner = []
        for child in element.children:
            if child.tag not in IN_DEFAULT:
                near = suggest(child.tag, IN_DEFAULT)
                said = f"<{child.tag}> in <default> is not read here"
                self.sink.error("E532", said, child.span, f"did you mean <{near}>?" if near else None)
            elif child.tag == "default":
                inner.append(child)
            elif child.tag not in IDLE_DEFAULTS:
                if child.tag in WORDS:
                    WORDS[child.tag].check(child, self.sink)
                kind = KEYS.get(child.tag, child.tag)
                mine.setdefault(kind, {}).update(dict.fromkeys(child.attributes, child))
        for child in inner:
            self._read(child, child.required("class", self.sink), name)

    def fill(self, element: Element, around: str, kind: str = "") -> Filled:
        """The element with the defaults of its own class, else of that `around` it."""
        tag = kind or element.tag
        name = element.get("class") or around or MAIN
        if name not in self.found:
            near = suggest(name, self.found)
            said = f"there is no class of defaults named {name!r}"
            self.sink.error("E534", said, element.place("class"), f"did you mean {near}?" if near else None)
            name = MAIN
        filled = Filled(element, self.found[name].get(KEYS.get(tag, tag), {}))
        WORDS[tag].check(element, self.sink)
        return filled
