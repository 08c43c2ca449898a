"""`emsim import --contacts`: which geoms of an MJCF file touch, how they rub, and that they stand where the file has them."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim import robots
from emsim.diagnostics import DeckError, Sink

FLOOR = '<geom name="floor" type="plane" size="1 1 1"/>'


def ball(name: str, at: str, more: str = "", inside: str = "") -> str:
    """A body with a ball of 0.1 m, free."""
    geom = f'<geom name="{name}_skin" size="0.1" mass="1" {more}/>'
    return f'<body name="{name}" pos="{at}"><freejoint/>{geom}{inside}</body>'


def model(bodies: str, more: str = "") -> str:
    return f"<mujoco model='m'><worldbody>{FLOOR}{bodies}</worldbody>{more}</mujoco>"


def deck(tmp_path, text: str, sink: Sink | None = None) -> str:
    path = tmp_path / "model.xml"
    path.write_text(text, encoding="utf-8")
    return robots.imported(str(path), robots.Options(contacts=True), sink or Sink())


def contacts(text: str) -> list[str]:
    """The cards without their names."""
    found = (line.split() for line in text.splitlines() if line.startswith("CONTACT"))
    return [" ".join(words[2:]) for words in found]


def run(text: str, tran: str, shown: str, **options):
    return emsim.run(text.replace(".tran 1m 1\n", f".tran {tran}\n.save {shown}\n"), **options)


BITS = 'contype="4" conaffinity="2"'
POST = '<body name="post" pos="1 0 1"><geom name="top" size="0.1"/></body>'
WEIGHS = '<inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>'
TWO = ball("a", "0 0 0.5") + ball("b", "1 0 0.5")


@pytest.mark.parametrize(
    ("bodies", "more", "found"),
    [
        (TWO, "", ["floor a_skin", "floor b_skin", "a_skin b_skin"]),
        (TWO, '<contact><exclude body1="b" body2="a"/></contact>', ["floor a_skin", "floor b_skin"]),
        (ball("a", "0 0 1", 'contype="2"') + ball("b", "1 0 1", 'contype="2" conaffinity="4"'), "", ["floor a_skin"]),
        (ball("a", "0 0 1", 'contype="0" conaffinity="0"'), "", []),
        # the child of a body does not touch it, its grandchild does
        (
            ball("a", "0 0 1", 'contype="2"', f'<body name="k"><joint name="j"/><geom name="in" size="0.1" pos="1 0 0" {BITS}/>'
            f'<body name="l" pos="2 0 0"><joint name="i"/><geom name="end" size="0.1" {BITS}/></body></body>'),
            "", ["floor a_skin", "a_skin end"],
        ),
        (TWO, '<option><flag contact="disable"/></option>', []),
        # ... and does where the file says so
        (
            ball("a", "0 0 1", 'contype="2"', f'<body name="k"><joint/><geom name="in" size="0.1" pos="1 0 0" {BITS}/></body>'),
            '<option><flag filterparent="disable"/></option>', ["floor a_skin", "a_skin in"],
        ),
        # what is fixed to the ground belongs to it
        (ball("a", "0 0 1") + POST, "", ["floor a_skin", "a_skin top"]),
    ],
)  # fmt: skip
def test_which_geoms_touch(tmp_path, bodies, more, found):
    sink = Sink()
    assert [
        " ".join(words.split()[:2]) for words in contacts(deck(tmp_path, model(bodies, more), sink))
    ] == found
    assert not sink.diagnostics


@pytest.mark.parametrize(
    ("more", "rubs"),
    [
        ("", "e=0 mu=1"),
        ('friction="0.3"', "e=0 mu=1"),  # the larger one
        ('friction="1.5"', "e=0 mu=1.5"),
        ('friction="0.3" priority="1"', "e=0 mu=0.3"),
        ('friction="1.5" condim="1"', "e=0 mu=1.5"),  # the larger condim too
        ('friction="1.5" condim="1" priority="1"', "e=0"),
        ('condim="4" friction="1 0.02 0.003"', "e=0 mu=1 drilling=0.02"),
        ('condim="6" friction="1 0.02 0.003"', "e=0 mu=1 drilling=0.02 rolling=0.003"),
    ],
)
def test_how_they_rub(tmp_path, more, rubs):
    assert contacts(deck(tmp_path, model(ball("a", "0 0 1", more)))) == [f"floor a_skin {rubs}"]


def test_a_pair_says_it_all(tmp_path):
    pair = '<contact><pair name="hit" geom1="a_skin" geom2="b_skin" condim="6" friction="0.5 0.5 0.01 0.002 0.002"/></contact>'
    text = deck(tmp_path, model(TWO.replace("mass", 'contype="0" conaffinity="0" mass'), pair))
    assert contacts(text) == ["a_skin b_skin e=0 mu=0.5 drilling=0.01 rolling=0.002"]
    assert "CONTACT hit " in text
    # in place of what the geoms say
    assert contacts(deck(tmp_path, model(TWO, pair)))[2:] == contacts(text)
    by_class = pair.replace(' condim="6"', "") + '<default><pair condim="1"/></default>'
    assert contacts(deck(tmp_path, model(TWO, by_class)))[2:] == ["a_skin b_skin e=0"]


TURNED = 'pos="0 0 0.5" euler="0 30 0"'


@pytest.mark.parametrize(
    ("geom", "gap"),
    [
        ('type="sphere" size="0.1" pos="0.2 0 0.4"', 0.3),
        ('type="capsule" size="0.05" fromto="0 0 0.3 0.4 0 0.6"', 0.25),
        ('type="capsule" size="0.05 0.2" pos="0 0 0.5"', 0.25),
        (f'type="capsule" size="0.05 0.2" {TURNED}', 0.5 - 0.2 * np.cos(np.pi / 6) - 0.05),
        (f'type="box" size="0.1 0.2 0.3" {TURNED}', 0.5 - 0.1 * 0.5 - 0.3 * np.cos(np.pi / 6)),
        (f'type="cylinder" size="0.1 0.3" {TURNED}', 0.5 - 0.1 * 0.5 - 0.3 * np.cos(np.pi / 6)),
        (f'type="ellipsoid" size="0.1 0.2 0.3" {TURNED}', 0.5 - np.hypot(0.1 * 0.5, 0.3 * np.cos(np.pi / 6))),
        ('type="mesh" mesh="corner" pos="0 0 0.5"', 0.4),
    ],
)
@pytest.mark.parametrize("down", ["", "quat='0 1 0 0'"])
def test_shapes_stand_where_the_file_has_them(tmp_path, geom, gap, down):
    """Over a floor, and under a ceiling with a body that is turned with it."""
    (tmp_path / "corner.stl").write_bytes(_stl(FACES))
    floor = FLOOR.replace("/>", f" {down}/>")
    body = f'<body name="b" {down}><freejoint/>{WEIGHS}<geom name="it" {geom}/></body>'
    asset = '<asset><mesh name="corner" file="corner.stl"/></asset>'
    text = deck(tmp_path, f"<mujoco>{asset}<worldbody>{floor}{body}</worldbody></mujoco>")
    r = run(text, "1m 1m", "gap(floor_it)")
    assert r["gap(floor_it)"][0] == pytest.approx(gap, abs=1e-9)


CORNERS = [(0.0, 0.0, -0.1), (0.3, 0.0, 0.1), (-0.1, 0.2, 0.1), (-0.1, -0.2, 0.1)]
FACES = [[CORNERS[k] for k in face] for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))]


def _stl(faces) -> bytes:
    lines = ["solid s"]
    for face in faces:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x} {y} {z}" for x, y, z in face]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid s"]).encode()


def test_balls_that_meet_go_on_together(tmp_path):
    """Without bounce and without friction: half the speed each."""
    bodies = (ball("a", "0 0 0.5", 'condim="1"') + ball("b", "0.5 0 0.5", 'condim="1"')).replace(
        'mass="1"', 'mass="2"', 1
    )
    start = 'qpos="0 0 0.5 1 0 0 0 0.5 0 0.5 1 0 0 0" qvel="1 0 0 0 0 0 0 0 0 0 0 0"'
    key = f'<option gravity="0 0 0"/><keyframe><key name="k" {start}/></keyframe>'
    path = tmp_path / "model.xml"
    path.write_text(model(bodies, key), encoding="utf-8")
    text = robots.imported(str(path), robots.Options(contacts=True, key="k"), Sink())
    r = run(text, "10m 1", "vx(a) vx(b) gap(a_skin_b_skin)", reltol=1e-8)
    assert r["vx(a)"][-1] == pytest.approx(2 / 3, abs=1e-8) and r["vx(b)"][-1] == pytest.approx(
        2 / 3, abs=1e-8
    )
    assert np.min(r["gap(a_skin_b_skin)"]) > -1e-9


@pytest.mark.parametrize(
    ("bodies", "more", "code", "words"),
    [
        (TWO, '<contact><pair geom1="a_skin" geom2="none"/></contact>', "E534", "'none'"),
        (
            TWO,
            '<contact><pair geom1="a_skin" geom2="b_skin" friction="1 0.5 0 0 0"/></contact>',
            "E532",
            "direction",
        ),
        (TWO, '<contact><pair geom1="a_skin" geom2="b_skin" firction="1"/></contact>', "E532", "firction"),
        (TWO, '<contact><exclude body1="a" body3="b"/></contact>', "E532", "body3"),
        (TWO + '<geom type="hfield" hfield="h"/>', "", "E532", "hfield"),
    ],
)
def test_what_cannot_be_said_is_an_error(tmp_path, bodies, more, code, words):
    with pytest.raises(DeckError) as caught:
        deck(tmp_path, model(bodies, more))
    first = next(d for d in caught.value.diagnostics if d.severity == "error")
    assert first.code == code and words in first.message and first.span is not None


MESH = '<asset><mesh name="m" file="corner.stl" {}/></asset>'


@pytest.mark.parametrize(
    ("asset", "code", "words"),
    [('refpos="0 0 1"', "E532", "refpos"), ('refquat="0 1 0 0"', "E532", "refquat"), ("", "E534", "'other'")],
)
def test_a_mesh_that_is_not_known_or_stands_elsewhere_is_an_error(tmp_path, asset, code, words):
    """Of a body that says what it weighs too."""
    (tmp_path / "corner.stl").write_bytes(_stl(FACES))
    name = "m" if asset else "other"
    body = f'<body name="b" pos="0 0 3"><freejoint/>{WEIGHS}<geom type="mesh" mesh="{name}"/></body>'
    with pytest.raises(DeckError) as caught:
        deck(tmp_path, f"<mujoco>{MESH.format(asset)}<worldbody>{FLOOR}{body}</worldbody></mujoco>")
    first = caught.value.diagnostics[0]
    assert first.code == code and words in first.message and first.span is not None


def test_a_mesh_may_weigh_as_a_shell_what_the_body_says_otherwise(tmp_path):
    (tmp_path / "corner.stl").write_bytes(_stl(FACES))
    shell = MESH.format('inertia="shell"')
    body = f'<body name="b" pos="0 0 3"><freejoint/>{WEIGHS}<geom name="it" type="mesh" mesh="m"/></body>'
    text = deck(tmp_path, f"<mujoco>{shell}<worldbody>{FLOOR}{body}</worldbody></mujoco>")
    assert contacts(text) == ["floor it e=0 mu=1"]


def test_a_mesh_of_many_corners_is_told(tmp_path):
    rng = np.random.default_rng(0)
    around = rng.normal(size=(200, 3))
    around /= np.linalg.norm(around, axis=1)[:, None]
    from scipy.spatial import ConvexHull

    (tmp_path / "round.stl").write_bytes(_stl(around[ConvexHull(around).simplices].tolist()))
    body = f'<body name="b" pos="0 0 3"><freejoint/>{WEIGHS}<geom type="mesh" mesh="m"/></body>'
    with pytest.raises(DeckError) as caught:
        deck(
            tmp_path,
            f'<mujoco><asset><mesh name="m" file="round.stl"/></asset><worldbody>{FLOOR}{body}</worldbody></mujoco>',
        )
    first = caught.value.diagnostics[0]
    assert first.code == "E532" and "200 corners" in first.message


def test_urdf_has_no_such_pairs(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text('<robot name="r"><link name="a"/></robot>')
    with pytest.raises(DeckError) as caught:
        robots.imported(str(path), robots.Options(contacts=True), Sink())
    assert "--contacts" in caught.value.diagnostics[0].message
