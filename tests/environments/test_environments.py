"""Environments of Gymnasium: its own checks, runs beside those of the decks, many beside one."""

from __future__ import annotations

import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from support import values_at

import emsim
from emsim.environments import cart_pole, leg, register
from emsim.fmus.session import Session

FALL = """a ball that falls, pushed from below
.gravity 10
BODY ball m=2
JOINT up 0 ball slide axis=(0,1) ic=5
FORCE push ball dir=(0,1) 0
.options reltol=1e-9
.tran 10m 2
.end
"""
register()


def falling(**more: object):
    given = {
        "actions": {"push": (-20.0, 20.0)}, "observations": ["pos(up)", "vel(up)"], "reward": "-pos(up)",
        "dt": 0.1, "duration": 2.0,
    }  # fmt: skip
    return emsim.env(FALL, **(given | more))


@pytest.mark.parametrize("name", ["emsim/CartPole-v0", "emsim/Leg-v0"])
def test_gymnasium_finds_nothing_wrong(name: str) -> None:
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        check_env(gymnasium.make(name).unwrapped, skip_render_check=True)
    # (spaces without bounds are what unbounded speeds ask for)
    left = [
        str(w.message)
        for w in said
        if "infinity" not in str(w.message) and issubclass(w.category, UserWarning)
    ]
    assert left == []


def test_a_fall_in_closed_form() -> None:
    """Weight 20 N; a push of 10 N over 0.1 s, then none."""
    env = falling(ends=["1-pos(up)"])
    seen, info = env.reset(seed=1)
    assert seen == pytest.approx([5.0, 0.0]) and info == {"time": 0.0}
    seen, reward, terminated, truncated, info = env.step(np.array([0.5]))
    # -1..1 is -20..20 N, so a = (10 - 20) / 2
    assert seen == pytest.approx([5.0 - 0.5 * 5.0 * 0.01, -0.5], rel=1e-6)
    assert (
        reward == pytest.approx(-4.975)
        and not terminated
        and not truncated
        and info["time"] == pytest.approx(0.1)
    )
    while not terminated:
        seen, _, terminated, truncated, info = env.step(np.array([0.0]))
        assert not truncated
    t = info["time"] - 0.1
    assert seen == pytest.approx([4.975 - 0.5 * t - 5.0 * t * t, -0.5 - 10.0 * t], rel=1e-5)
    assert seen[0] < 1.0
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.array([0.0]))


def test_time_that_is_up_truncates() -> None:
    env = falling(duration=0.3)
    env.reset(seed=0)
    assert [env.step(np.array([1.0]))[2:4] for _ in range(3)] == [
        (False, False),
        (False, False),
        (False, True),
    ]


def test_starts_are_drawn_by_the_seed_within_their_range() -> None:
    env = falling(start={"pos(up)": (2.0, 4.0)})
    starts = [env.reset(seed=k)[0][0] for k in range(20)]
    assert all(2.0 <= x <= 4.0 for x in starts) and np.ptp(starts) > 1.0
    assert env.reset(seed=3)[0][0] == starts[3] != env.reset()[0][0]
    assert env.reset(seed=3, options={"pos(up)": 2.5})[0][0] == 2.5


def test_the_cart_is_its_deck() -> None:
    """Voltages that an agent gives, as a source of the deck; from another start, too."""
    env = cart_pole.make()
    given = np.random.default_rng(5).uniform(-0.2, 0.2, 25)
    seen = [env.reset(seed=5, options={"pos(rail)": 0.0, "angle(hinge)": 0.0})[0]]
    seen += [env.step([a])[0] for a in given]
    points = " ".join(
        f"{t!r} {12.0 * a!r}" for k, a in enumerate(given.tolist()) for t in (0.02 * k, 0.02 * (k + 1))
    )
    text = Path(cart_pole.DECK).read_text().replace("drive  0 0", f"drive 0 PWL(0 0 1n {points[4:]})")
    result = emsim.run(text, reltol=1e-9)
    times = 0.02 * np.arange(len(seen))
    for k, name in enumerate(cart_pole.task().bounds):
        expected = values_at(result, name, times)
        off = np.abs(np.array(seen)[1:, k] - expected[1:]).max()
        # (a current at the very edge of a step is that before it)
        assert off < 1e-3 * max(np.ptp(expected), 1e-3), name


def test_the_pole_can_be_balanced() -> None:
    """State feedback, as netlists/coupled/cart_pole.cir has it: the whole episode, nearly the whole reward."""
    env = cart_pole.make()
    seen, _ = env.reset(seed=2)
    total, truncated, terminated = 0.0, False, False
    while not (truncated or terminated):
        x, v, angle, omega, _ = seen
        volts = 17 * x + 16 * v - 52 * angle - 10 * omega
        seen, reward, terminated, truncated, _ = env.step([np.clip(volts / 12.0, -1, 1)])
        total += reward
    assert truncated and not terminated and total > 490


def test_the_leg_stands_on_its_foot_and_falls_without_motors() -> None:
    """Without a voltage the motors brake: it falls freely until the foot is on the ground, and goes down slower than that."""
    env = leg.make()
    seen, over = [env.reset(seed=0)[0]], False
    while not over:
        row, _, terminated, truncated, info = env.step([0.0, 0.0])
        seen.append(row)
        over = terminated or truncated
    assert terminated and seen[-1][0] < 0.15
    height, speed, *_, force = np.array(seen).T
    t = 0.02 * np.arange(len(seen))
    free = force == 0
    assert height[free] == pytest.approx(height[0] - 0.5 * 9.81 * t[free] ** 2, abs=1e-5)
    assert force.max() > 9.81 * 2.5 and 0.25 < info["time"] < 1.0
    assert speed[-1] > -9.81 * t[-1] / 2


def test_many_are_as_many_single_ones_whatever_the_threads() -> None:
    count, steps = 5, 30
    actions = np.random.default_rng(0).uniform(-1, 1, (steps, count, 1))
    single = []
    for k in range(count):
        env = cart_pole.make(duration=0.4)
        rows = [env.reset(seed=7 + k)[0]]
        over = False
        for a in actions[:, k]:
            seen, reward, terminated, truncated, _ = (
                (env.reset()[0], 0.0, False, False, {}) if over else env.step(a)
            )
            over = terminated or truncated
            rows.append([*seen, reward, terminated, truncated])
        single.append(rows)
    for threads in (1, 2):
        many = cart_pole.make_vec(count, threads=threads, duration=0.4)
        first, _ = many.reset(seed=7)
        assert (first == [rows[0] for rows in single]).all()
        for j in range(steps):
            seen, reward, terminated, truncated, _ = many.step(actions[j])
            row = np.column_stack([seen, reward, terminated, truncated])
            assert (row == [rows[j + 1] for rows in single]).all()


def test_gymnasium_makes_many() -> None:
    many = gymnasium.make_vec("emsim/CartPole-v0", num_envs=3)
    seen, _ = many.reset(seed=1)
    assert seen.shape == (3, 5) and many.step(many.action_space.sample())[1].shape == (3,)


def test_a_run_that_fails_ends_its_episode_alone() -> None:
    """1/(pos-4.9) is no number where the ball falls through it."""
    text = FALL.replace("dir=(0,1) 0", "dir=(0,1) 0\nB1 a 0 V={sqrt(pos(up)-4.9)}\nR1 a 0 1")
    text = text.replace("V={sqrt", "V={1e-3/(max(pos(up)-4.9,0))+0*sqrt")
    env = emsim.env(text, {"push": (-20.0, 20.0)}, ["pos(up)"], dt=0.1, duration=2.0)
    env.reset(seed=0)
    for _ in range(4):
        _, reward, terminated, _, info = env.step([0.0])
        if terminated:
            break
    assert terminated and reward == 0.0 and info["failed"]
    env.reset(seed=0)
    assert not env.step([1.0])[2]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"dt": 30.0}, "steps of 30.0 s"),
        ({"actions": {}}, "an action"),
        ({"actions": {"push": (1.0, -1.0)}}, "least value"),
        ({"actions": {"push": (0.0, np.inf)}}, "no finite range"),
    ],
)
def test_what_is_no_task_is_told(more: dict, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        emsim.env(FALL, **({"actions": {"push": (-1.0, 1.0)}, "observations": ["pos(up)"]} | more))


def test_a_session_begins_elsewhere_and_has_twins() -> None:
    s = Session(FALL, "push", "pos(up)")
    s.place("pos(up)", 3.0)
    s.reset()
    t = s.twin()
    assert s["pos(up)"] == 3.0 and t["pos(up)"] == 5.0
    s.step(0.1)
    assert s["pos(up)"] == pytest.approx(2.95) and t.time == 0.0
    s.place("pos(up)")
    s.reset()
    assert s["pos(up)"] == 5.0
    with pytest.raises(KeyError, match="did you mean 'pos\\(up\\)'"):
        s.place("pos(upp)", 1.0)
    with pytest.raises(ValueError, match="finite"):
        s.place("pos(up)", float("nan"))
