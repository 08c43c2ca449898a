"""`emsim import`: mistakes in files and where they are told, what is refused by name, the cards of single features."""

from __future__ import annotations

import pytest

import emsim
from emsim import robots
from emsim.cli import main
from emsim.diagnostics import DeckError, Sink
from emsim.readers import stl

MASSIVE = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'


def link(name: str, inside: str = MASSIVE) -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(parent: str, child: str, inside: str = "", kind: str = "continuous", name: str = "") -> str:
    return (
        f'<joint name="{name or child + "_joint"}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f"{inside}</joint>"
    )


def urdf(*parts: str) -> str:
    return "\n".join(['<robot name="r">', *parts, "</robot>"])


ARM = (link("base", ""), link("arm"), joint("base", "arm", '<axis xyz="0 1 0"/>', name="hinge"))


def mjcf(body: str, more: str = "", joint: str = '<joint name="h" axis="0 1 0"/>') -> str:
    geom = '<geom name="rod" type="capsule" size="0.02" fromto="0 0 0 0 0 -0.5"/>'
    return f'<mujoco model="m">\n{more}\n<worldbody><body name="b">{joint}{geom}{body}</body></worldbody>\n</mujoco>'


def deck(tmp_path, text: str, sink: Sink | None = None, **options) -> str:
    path = tmp_path / "robot.xml"
    path.write_text(text, encoding="utf-8")
    return robots.imported(str(path), robots.Options(**options), sink or Sink())


def cards(text: str) -> list[str]:
    return [" ".join(line.split()) for line in text.splitlines() if line[:1] not in "*."]


def told(tmp_path, text: str, **options) -> tuple[str, str, str]:
    """Code, message and hint of the first error, and that it points at a place."""
    with pytest.raises(DeckError) as caught:
        deck(tmp_path, text, **options)
    first = next(d for d in caught.value.diagnostics if d.severity == "error")
    assert first.span is not None and first.span.text
    return first.code, f"{first.message} | {first.hint or ''}", first.span.text


BOMB = '<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>\n'
TWICE = joint("arm", "tool", name="one") + joint("base", "tool", name="two")
MISTAKES = {
    "no XML": (urdf("<link>"), "E530", "mismatched tag"),
    "another file": ("<svg/>", "E530", "neither <robot> (URDF) nor <mujoco> (MJCF)"),
    "macros": (
        '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arm/></robot>',
        "E530",
        "macro file",
    ),
    "levels without end": (
        "<mujoco>" + "<body>" * 400 + "</body>" * 400 + "</mujoco>",
        "E530",
        "levels deep",
    ),
    "entities": (BOMB + urdf(*ARM), "E531", "grow without end"),
    "a file of the machine": (
        '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/hostname">]>' + urdf('<link name="&a;"/>'),
        "E531",
        "",
    ),
    "unknown element": (urdf(*ARM, "<lnk/>"), "E532", "did you mean <link>?"),
    "unknown attribute": (urdf(link("a", MASSIVE.replace("iyy", "iyx"))), "E532", "did you mean"),
    "a link that is not there": (urdf(*ARM[:2], joint("bse", "arm")), "E534", "did you mean base?"),
    "two links of a name": (urdf(*ARM, link("arm")), "E534", "two <link> named 'arm'"),
    "two parents": (urdf(*ARM, link("tool"), TWICE), "E535", "child of two joints, one and two"),
    "a circle": (urdf(*ARM[:2], joint("arm", "arm")), "E535", "go in a circle: arm -> arm"),
    "two roots": (urdf(link("a"), link("b")), "E535", "2 links are nobody's child"),
    "no link": (urdf(), "E535", "has no <link>"),
    "no mass": (urdf(link("base"), link("arm", ""), ARM[2]), "E536", "'hinge' moves 'arm'"),
    "no inertia about the axis": (
        urdf(link("base"), link("arm", MASSIVE.replace('iyy="1"', 'iyy="0"')), ARM[2]),
        "E536",
        "no mass that resists",
    ),
    "a negative mass": (urdf(link("a", MASSIVE.replace('value="1"', 'value="-1"'))), "E536", "-1 kg"),
    "a negative inertia": (
        urdf(link("a", MASSIVE.replace('izz="1"', 'izz="-1"'))),
        "E536",
        "could be negative",
    ),
    "no number": (
        urdf(link("a", MASSIVE.replace('value="1"', 'value="1kg"'))),
        "E533",
        "'1kg', which is no number",
    ),
    "infinite": (urdf(link("a", MASSIVE.replace('value="1"', 'value="inf"'))), "E533", "no number"),
    "no type": (urdf(*ARM[:2], joint("base", "arm", kind="revolut")), "E533", "did you mean revolute?"),
    "no ends": (urdf(*ARM[:2], joint("base", "arm", kind="revolute")), "E533", "of type continuous"),
    "ends in the wrong order": (
        urdf(*ARM[:2], joint("base", "arm", '<limit lower="1" upper="-1"/>', "revolute")),
        "E533",
        "lies above its upper end",
    ),
    "an axis without direction": (
        urdf(*ARM[:2], joint("base", "arm", '<axis xyz="0 0 0"/>')),
        "E533",
        "no direction",
    ),
    "a mimic of nobody": (
        urdf(*ARM[:2], joint("base", "arm", '<mimic joint="x"/>', name="hinge")),
        "E534",
        "no other joint that moves",
    ),
    "mimics in a circle": (
        urdf(
            *ARM[:2],
            link("tool"),
            joint("base", "arm", '<mimic joint="q"/>', name="p"),
            joint("arm", "tool", '<mimic joint="p"/>', name="q"),
        ),
        "E535",
        "in a circle",
    ),
    "a transmission of a kind": (
        urdf(*ARM, '<transmission name="t"><type>Differential</type><joint name="hinge"/></transmission>'),
        "E532",
        "only SimpleTransmission",
    ),
    "a class that is not there": (mjcf('<geom class="x"/>'), "E534", "no class of defaults named 'x'"),
    "an actuator of nobody": (mjcf("", '<actuator><motor joint="g"/></actuator>'), "E534", "no such joint"),
    "muscles": (mjcf("", '<actuator><muscle joint="h"/></actuator>'), "E532", "<muscle>"),
    "filters": (
        mjcf("", '<actuator><general joint="h" dyntype="filter"/></actuator>'),
        "E532",
        "dyntype 'filter'",
    ),
    "a medium": (mjcf("", '<option density="1000"/>'), "E532", "flows round bodies"),
    "global coordinates": (mjcf("", '<compiler coordinate="global"/>'), "E532", "local"),
    "a limited ball": (mjcf("", joint='<joint type="ball" range="0 30"/>'), "E532", "range of a ball"),
    "springdamper": (mjcf("", joint='<joint springdamper="1 1"/>'), "E532", "springdamper"),
    "a free body on another": (
        mjcf('<body name="c"><freejoint/><geom size="1"/></body>'),
        "E535",
        "hangs on another",
    ),
    "a joint of the world": (
        "<mujoco><worldbody><joint/></worldbody></mujoco>",
        "E535",
        "the world has a joint",
    ),
    "two rotations": (mjcf('<body quat="1 0 0 0" euler="0 0 0"/>'), "E533", "each says how it stands"),
    "a size": (mjcf('<geom type="box" size="1 1"/>'), "E533", "3 numbers above 0"),
    "a mesh that is not there": (mjcf('<geom mesh="m"/>'), "E534", "no <mesh> named 'm'"),
    "a mesh of another kind": (
        mjcf('<geom mesh="m"/>', '<asset><mesh name="m" file="m.obj"/></asset>'),
        "E537",
        "only STL meshes",
    ),
    "a tendon's end": (
        mjcf("", '<tendon><fixed range="0 1"><joint joint="h" coef="1"/></fixed></tendon>'),
        "E532",
        "range of <fixed>",
    ),
    "plugins": (mjcf("", "<extension/>"), "E532", "<extension>"),
    "a weld elsewhere": (
        mjcf("", '<equality><weld body1="b" relpose="0 0 1 1 0 0 0"/></equality>'),
        "E532",
        "relpose",
    ),
    "two classes of a name": (
        mjcf("", '<default><default class="a"/><default class="a"/></default>'),
        "E534",
        "two classes",
    ),
    "massless": ('<mujoco><worldbody><body name="b"><joint/></body></worldbody></mujoco>', "E536", "no mass"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_told_at_its_place(name, tmp_path):
    text, code, words = MISTAKES[name]
    said = told(tmp_path, text)
    assert said[0] == code and words in said[1], said


def test_a_key_that_is_not_there(tmp_path):
    assert told(tmp_path, mjcf("", '<keyframe><key name="up"/></keyframe>'), key="down")[0] == "E534"


def test_a_file_that_includes_itself(tmp_path):
    assert told(tmp_path, mjcf("", '<include file="robot.xml"/>'))[0] == "E535"


def test_an_included_file_is_part_of_the_model(tmp_path):
    (tmp_path / "rules.xml").write_text('<mujoco><option gravity="0 0 -1.62"/></mujoco>')
    assert ".gravity 0 0 -1.62" in deck(tmp_path, mjcf("", '<include file="rules.xml"/>'))


def test_places_behind_letters_of_several_bytes(tmp_path):
    text = urdf("<!-- größer als µ -->", *ARM, '<lnk é="1"/>')
    assert told(tmp_path, text)[2] == "lnk"


# ---- single features ----------------------------------------------------------------------------------


def test_urdf_ends_friction_and_mimic(tmp_path):
    text = urdf(
        *ARM[:2],
        link("finger"),
        link("other"),
        joint(
            "base",
            "arm",
            '<limit lower="-1" upper="2" effort="5"/><dynamics damping="0.1" friction="0.3"/>',
            "revolute",
            "a",
        ),
        joint("arm", "finger", '<mimic joint="a" multiplier="-2"/>', name="f"),
        joint("arm", "other", '<mimic joint="a" multiplier="2" offset="0.5"/>', name="g"),
    )
    found = cards(deck(tmp_path, text))
    assert "JOINT a 0 arm pin axis=(1,0,0) damp=0.1" in found
    assert "STOP a_ends a min=-1 max=2 e=0" in found
    assert "FRICTION a_friction a fc=0.3" in found
    assert "GEAR f_mimic f a ratio=-2" in found
    assert "CAM g_mimic g a lift={0.5+2*angle(a)}" in found


def test_a_mimic_moves_as_it_is_told(tmp_path):
    text = urdf(
        *ARM,
        link("other"),
        joint("base", "other", '<mimic joint="hinge" multiplier="2" offset="0.5"/>', name="m"),
    ).replace('<mass value="1"/>', '<origin xyz="0.1 0 0"/><mass value="1"/>')
    r = emsim.run(deck(tmp_path, text))
    assert r["angle(m)"][-1] == pytest.approx(0.5 + 2 * r["angle(hinge)"][-1], abs=1e-6)
    assert abs(r["angle(hinge)"][-1]) > 0.1


def test_urdf_transmissions_are_torques_with_an_input(tmp_path):
    parts = (
        *ARM[:2],
        joint("base", "arm", '<limit lower="-1" upper="2" effort="50"/>', "revolute", "a"),
        '<transmission name="t"><type>transmission_interface/SimpleTransmission</type><joint name="a"/>',
        '<actuator name="m"><mechanicalReduction>100</mechanicalReduction></actuator></transmission>',
    )
    found = cards(deck(tmp_path, urdf(*parts)))
    assert "Va_motor a_motor 0 0" in found
    assert "TORQUE a_motor a tau={100*(min(max(v(a_motor),-0.5),0.5))}" in found


def test_what_is_fixed_is_one_with_its_parent(tmp_path):
    tool = MASSIVE.replace("<mass", '<origin xyz="0 0 1"/><mass')
    text = urdf(*ARM, link("tool", tool), joint("arm", "tool", '<origin xyz="1 0 0"/>', "fixed"))
    found = cards(deck(tmp_path, text))
    # two masses of 1 kg, at the origin and at (1,0,1): each tensor 1, and m d^2 of half the distance twice
    assert "BODY arm m=2 com=(0.5,0,0.5) j=(2.5,3,2.5,0,-0.5,0)" in found
    assert "POINT arm.tool 1 0 0" in found


def test_a_planar_joint_is_two_slides_and_a_pin(tmp_path):
    text = urdf(*ARM[:2], joint("base", "arm", '<axis xyz="0 0 1"/>', "planar", "p"))
    found = cards(deck(tmp_path, text))
    assert [line for line in found if line.startswith("JOINT")] == [
        "JOINT p_x 0 arm_p_x slide axis=(1,0,0)",
        "JOINT p_y arm_p_x arm_p_y slide axis=(0,1,0)",
        "JOINT p_turn arm_p_y arm pin axis=(0,0,1)",
    ]
    emsim.run("\n".join(deck(tmp_path, text).splitlines()))


def test_the_base_may_be_free(tmp_path):
    assert "JOINT base_free 0 base free ic=(0,0,0,0,0,0)" not in deck(tmp_path, urdf(link("base")))
    text = deck(tmp_path, urdf(link("base")), free=True)
    r = emsim.run(text.replace(".tran 1m 1", ".tran 10m 0.1"))
    assert r["z(base_free)"][-1] == pytest.approx(-0.5 * 9.81 * 0.01, rel=1e-9)


def test_a_link_may_be_free_beside_a_moving_one(tmp_path):
    inside = '<origin xyz="0 0 2" rpy="1 0 0"/>'
    text = urdf(*ARM, link("drone"), joint("arm", "drone", inside, "floating", "float"))
    found = cards(deck(tmp_path, text.replace('"hinge"', '"hinge"', 1)))
    assert "JOINT float arm drone free ic=(0,0,2,0,0,0)" in found
    r = emsim.run(deck(tmp_path, text).replace(".tran 1m 1", ".tran 10m 0.1"))
    assert r["z(float)"][-1] == pytest.approx(2 - 0.5 * 9.81 * 0.01, rel=1e-6)


CUBE = [
    ((0, 0, 0), (0, 1, 0), (1, 1, 0)), ((0, 0, 0), (1, 1, 0), (1, 0, 0)), ((0, 0, 1), (1, 1, 1), (0, 1, 1)),
    ((0, 0, 1), (1, 0, 1), (1, 1, 1)), ((0, 0, 0), (1, 0, 0), (1, 0, 1)), ((0, 0, 0), (1, 0, 1), (0, 0, 1)),
    ((0, 1, 0), (1, 1, 1), (1, 1, 0)), ((0, 1, 0), (0, 1, 1), (1, 1, 1)), ((0, 0, 0), (0, 0, 1), (0, 1, 1)),
    ((0, 0, 0), (0, 1, 1), (0, 1, 0)), ((1, 0, 0), (1, 1, 0), (1, 1, 1)), ((1, 0, 0), (1, 1, 1), (1, 0, 1)),
]  # fmt: skip


@pytest.mark.parametrize("inside_out", [False, True])
def test_a_mesh_of_a_package_weighs_by_density(tmp_path, inside_out):
    """A cube as text, of 100 mm by its scale, found above the file's folder; corners in either order."""
    facets = [facet[::-1] if inside_out else facet for facet in CUBE]
    lines = [f"vertex {x} {y} {z}" for facet in facets for x, y, z in facet]
    parts = [
        "facet\nouter loop\n" + "\n".join(lines[k : k + 3]) + "\nendloop\nendfacet" for k in range(0, 36, 3)
    ]
    for folder in ("meshes", "urdf"):
        (tmp_path / folder).mkdir()
    (tmp_path / "meshes" / "cube.stl").write_text("solid cube\n" + "\n".join(parts) + "\nendsolid")
    shape = '<collision><geometry><mesh filename="package://arm/meshes/cube.stl" scale="0.1 0.1 0.1"/></geometry></collision>'
    found = cards(deck(tmp_path / "urdf", urdf(link("base"), link("arm", shape), ARM[2]), density=3000.0))
    j = 3.0 * (0.1**2 + 0.1**2) / 12
    assert found[1] == f"BODY arm m=3 com=(0.05,0.05,0.05) j=({j:g},{j:g},{j:g})"


def test_shapes_for_pictures(tmp_path):
    """A rod of a deck begins at its body's origin, along x; a cylinder of a file is centred, along z."""
    shapes = (
        '<visual><origin xyz="0 0 0.5"/><geometry><cylinder radius="0.1" length="1"/></geometry></visual>'
        '<visual><origin xyz="1 0 0" rpy="0 0 1"/><geometry><box size="1 2 3"/></geometry></visual>'
        '<visual><geometry><mesh filename="a.dae"/></geometry></visual>'
    )
    text = urdf(link("base"), link("arm", MASSIVE + shapes), ARM[2])
    found = cards(deck(tmp_path, text, looks=True))
    assert (
        "BODY arm_look1 m=0 shape=rod(1,0.2)" in found
        and "BODY arm_look2 m=0 j=(0,0,0) look=plate(1,2,3)" in found
    )
    assert "JOINT arm_look1_weld arm arm_look1 weld axis=(0,-1,0) zero=1.5707963267949" in found
    assert "JOINT arm_look2_weld arm(1,0,0) arm_look2 weld axis=(0,0,1) zero=1" in found
    assert not any("look" in card for card in cards(deck(tmp_path, text)))
    r = emsim.run(deck(tmp_path, text, looks=True).replace(".end", ".save all z(arm_look1(1,0,0))\n.end"))
    assert r["z(arm_look1(1,0,0))"][0] == pytest.approx(1.0)


def test_geoms_for_pictures(tmp_path):
    more = '<geom type="box" size="1 2 3" group="3"/><geom type="ellipsoid" size="1 2 3"/><geom size="0.3" pos="0 0 1"/>'
    found = cards(deck(tmp_path, mjcf(more), looks=True))
    assert [card for card in found if "look" in card and card.startswith("BODY")] == [
        "BODY b_look1 m=0 shape=rod(0.5,0.04)",
        "BODY b_look2 m=0 j=(0,0,0) look=ball(0.3)",
    ]
    assert "JOINT b_look2_weld b(0,0,1) b_look2 weld" in found


def test_options_of_the_other_format_are_refused(tmp_path):
    assert told(tmp_path, urdf(*ARM), key="up")[0] == "E532"
    assert told(tmp_path, mjcf(""), density=1.0)[0] == "E532"


def test_the_outermost_class_may_have_a_name(tmp_path):
    more = '<default class="robot"><joint damping="0.1"/></default>'
    assert "damp=0.1" in deck(tmp_path, mjcf("", more, '<joint name="h" class="robot" axis="0 1 0"/>'))


def test_masses_by_density(tmp_path):
    shape = '<collision><origin xyz="0 0 1"/><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'
    found = cards(deck(tmp_path, urdf(link("base"), link("arm", shape), ARM[2]), density=1000.0))
    assert found[1] == "BODY arm m=6 com=(0,0,1) j=(0.065,0.05,0.025)"


def test_names_of_the_deck(tmp_path):
    text = urdf(
        link("base"),
        link("a-b"),
        link("A_b"),
        joint("base", "a-b", name="a b"),
        joint("base", "A_b", name="2"),
    )
    found = cards(deck(tmp_path, text))
    names = [line.split()[1] for line in found if line.split()[0] in ("BODY", "JOINT")]
    assert len({name.lower() for name in names}) == 4 and all(
        name.replace("_", "").isalnum() for name in names
    )
    emsim.run(deck(tmp_path, text))


def test_defaults_and_classes(tmp_path):
    more = (
        """<default><joint damping="0.1"/><default class="stiff"><joint stiffness="7"/></default></default>"""
    )
    found = cards(deck(tmp_path, mjcf("", more, '<joint name="h" class="stiff" axis="0 1 0"/>')))
    assert "JOINT h 0 b pin axis=(0,1,0) damp=0.1" in found and "SPRING h_spring h k=7 q0=0" in found


def test_what_flags_disable_is_left_out(tmp_path):
    more = (
        '<option><flag gravity="disable" limit="disable" frictionloss="disable" passive="disable"/></option>'
    )
    text = deck(
        tmp_path, mjcf("", more, '<joint name="h" range="-9 9" damping="1" stiffness="1" frictionloss="1"/>')
    )
    assert ".gravity 0 0 0" in text
    assert [line.split()[0] for line in cards(text)[1:]] == ["BODY", "JOINT"] and "damp" not in text


def test_gravity_that_is_carried(tmp_path):
    text = mjcf("", joint='<joint name="h" axis="0 1 0" damping="0"/>').replace(
        'name="b"', 'name="b" gravcomp="1"'
    )
    r = emsim.run(deck(tmp_path, text.replace('fromto="0 0 0 0 0 -0.5"', 'fromto="0 0 0 0.5 0 0"')))
    assert abs(r["angle(h)"][-1]) < 1e-9


def test_loops_close(tmp_path):
    inner = '<body name="c" pos="0 0 -0.5"><joint name="k" axis="0 1 0"/><geom type="box" size="0.1 0.1 0.1"/></body>'
    more = '<equality><connect body1="c" body2="world" anchor="0.3 0 0"/></equality>'
    text = deck(tmp_path, mjcf(inner, more))
    assert "JOINT connect1 c(0.3,0,0) 0(0.3,0,-0.5) ball cut=yes" in cards(text)
    r = emsim.run(text)
    assert max(abs(r["angle(h)"])) < 1e-6  # a triangle


def test_speeds_at_the_start_of_a_loop_are_refused(tmp_path):
    more = '<equality><connect body1="b" body2="world" anchor="0.3 0 0"/></equality><keyframe><key qpos="0" qvel="1"/></keyframe>'
    assert told(tmp_path, mjcf("", more), key="0")[0] == "E532"
    assert "JOINT connect1" in deck(tmp_path, mjcf("", more))


def test_polynomials_of_equalities(tmp_path):
    inner = (
        '<body name="c"><joint name="k" axis="0 1 0" ref="1"/><geom type="box" size="0.1 0.1 0.1"/></body>'
    )
    more = '<compiler angle="radian"/><equality><joint name="e" joint1="h" joint2="k" polycoef="0 2 0.5"/></equality>'
    # h = 2 (k - 1) + 0.5 (k - 1)^2
    assert "CAM e h k lift={-1.5+1*angle(k)+0.5*angle(k)*angle(k)}" in cards(
        deck(tmp_path, mjcf(inner, more))
    )


def test_what_does_not_bear_on_motion_is_named(tmp_path):
    more = "<visual/><sensor/><statistic/>"
    text = deck(tmp_path, mjcf('<camera name="eye"/><light/>', more))
    for word in ("<visual>", "<sensor>", "<statistic>", "1 <camera>, 1 <light>", "time step"):
        assert word in text


def test_warnings(tmp_path):
    sink = Sink()
    deck(
        tmp_path,
        mjcf(
            '<body name="c"><joint/><body name="d" pos="1 0 0"><joint/><geom name="far" size="1"/></body><geom size="1"/></body>'
        ),
        sink,
    )
    assert [d.code for d in sink.diagnostics] == ["W530"]
    sink = Sink()
    deck(tmp_path, urdf(link("base"), link("arm", MASSIVE.replace('ixx="1"', 'ixx="3"')), ARM[2]), sink)
    assert [d.code for d in sink.diagnostics] == ["W536"]


# ---- the verb -----------------------------------------------------------------------------------------


def test_the_verb_writes_a_deck_that_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robot.urdf").write_text(urdf(*ARM))
    assert main(["import", "robot.urdf", "-o", "robot.cir"]) == 0
    assert main(["robot.cir"]) == 0
    assert main(["import", "robot.urdf"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == ".end"
    assert main(["import", "none.urdf"]) == 5
    assert main(["import"]) == 2
    assert main(["import", "robot.urdf", "-o", "robot.urdf"]) == 2
    (tmp_path / "robot.urdf").write_bytes(b"\0\1\2")
    assert main(["import", "robot.urdf"]) == 5


def test_a_robot_that_is_run_as_a_deck_is_told_of_the_verb(tmp_path):
    with pytest.raises(DeckError) as caught:
        emsim.run(urdf(*ARM))
    assert "emsim import robot.urdf" in (caught.value.diagnostics[0].hint or "")


# ---- STL ----------------------------------------------------------------------------------------------

TEXT = b"""solid t
facet normal 0 0 1
 outer loop
  vertex 0 0 0
  vertex 1 0 0
  vertex 0 1e0 0.5
 endloop
endfacet
endsolid t
"""


def test_stl_as_text():
    assert stl.triangles(TEXT).tolist() == [[[0, 0, 0], [1, 0, 0], [0, 1, 0.5]]]


def test_binary_stl_that_begins_as_a_text_does():
    import struct

    data = b"solid".ljust(80) + (1).to_bytes(4, "little") + struct.pack("<12fH", *range(12), 0)
    assert stl.triangles(data).tolist() == [[[3, 4, 5], [6, 7, 8], [9, 10, 11]]]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "no STL file"),
        (b"\0" * 84, "no triangle"),
        (b"\0" * 100, "of 0 triangles it would have 84 bytes"),
        (TEXT.replace(b"  vertex 1 0 0\n", b""), "1 facets and 2 corners"),
        (TEXT.replace(b"1e0", b"x"), "no number"),
        (TEXT.replace(b"1e0", b"nan"), "no number"),
    ],
)
def test_what_is_no_stl_file(data, words):
    with pytest.raises(ValueError, match=words):
        stl.triangles(data)


def test_an_open_mesh_encloses_nothing(tmp_path):
    (tmp_path / "open.stl").write_bytes(TEXT)
    shape = '<collision><geometry><mesh filename="package://r/open.stl"/></geometry></collision>'
    said = told(tmp_path, urdf(link("base"), link("arm", shape), ARM[2]), density=1000.0)
    assert said[0] == "E537" and "not closed" in said[1]


# ---- tyre property files ------------------------------------------------------------------------------

TIR = """[MDI_HEADER]
FILE_TYPE = 'tir'
[UNITS]
LENGTH = 'meter'
ANGLE = 'radians'
[MODEL]
PROPERTY_FILE_FORMAT = 'PAC2002'
[DIMENSION]
UNLOADED_RADIUS = 0.313  $ free radius
[SHAPE]
{radial width}
1.0 0.0
[VERTICAL]
FNOMIN = 4000
[LONGITUDINAL_COEFFICIENTS]
PCX1 = 1.685
! a comment = 3
PDX1 = 1.21
PDX3 = 0
[LATERAL_COEFFICIENTS]
PDY3 = -11.23
"""


def tir(tmp_path, text: str) -> str:
    path = tmp_path / "summer-205.tir"
    path.write_text(text)
    return robots.imported(str(path), robots.Options(), Sink())


def test_a_tyre_property_file_is_a_model(tmp_path):
    text = tir(tmp_path, TIR)
    assert ".model summer_205 tyre r0=0.313 fnomin=4000 pcx1=1.685 pdx1=1.21" in text
    assert "PDY3" in text and "FILE_TYPE" not in text


@pytest.mark.parametrize(
    ("old", "new", "code", "words"),
    [
        ("'meter'", "'mm'", "E532", "unit of length is 'mm'"),
        ("'PAC2002'", "'MF61'", "E532", "another formula"),
        ("FILE_TYPE = 'tir'", "FITTYP = 61", "E532", "another formula"),
        ("1.21", "1,21", "E533", "no number"),
        ("FNOMIN = 4000", "", "E530", "no FNOMIN"),
        ("PDX3 = 0", "PDX1 = 1.3", "E534", "given twice"),
    ],
)
def test_a_wrong_tyre_property_file_is_told(tmp_path, old, new, code, words):
    with pytest.raises(DeckError) as caught:
        tir(tmp_path, TIR.replace(old, new))
    first = caught.value.diagnostics[0]
    assert first.code == code and words in first.message and first.span is not None
