"""A deck that an agent leads, as gymnasium has it: `emsim.Session` between `reset` and `step`.

What an agent may do and sees, what it is paid for and when it is over is a `Task`; the physics is the deck's.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite

import numpy as np

from ..diagnostics import ConvergenceError
from ..fmus.session import Session

try:
    import gymnasium
    from gymnasium import spaces
except ImportError:
    raise ImportError("environments need gymnasium: pip install 'emsim[gym]'") from None

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from numpy.typing import NDArray

    from ..source import Source

    Range = tuple[float, float]


class Task:
    """What is asked of a deck.

    deck          a path, the text itself, or a PySpice Circuit
    actions       what an agent sets, held over a step: name of an input (as `Session` takes it) -> its least and largest value,
                  to which -1 and 1 of the action lead
    observations  what it sees: expressions as .print takes them, or expression -> its least and largest value
    reward        an expression, its value at the end of each step
    ends          expressions: where one is above 0 the episode is over (terminated)
    start         coordinate (`angle(hinge)`) -> the range from which its value at the start is drawn, evenly; else the deck's
    dt            length of a step, 0.02 [s]
    duration      of an episode, 10 [s], after which it is cut off (truncated)
    defines, options   as `Session` takes them
    """

    def __init__(
        self,
        deck: Source,
        actions: Mapping[str, Range],
        observations: Sequence[str] | Mapping[str, Range],
        reward: str = "0",
        ends: Sequence[str] = (),
        start: Mapping[str, Range] | None = None,
        **more: Any,
    ) -> None:
        dt, duration = more.pop("dt", 0.02), more.pop("duration", 10.0)
        self.defines, self.options = more.pop("defines", None), more.pop("options", None)
        if more:
            raise TypeError(f"a task has no {', '.join(more)}")
        if not 0.0 < dt <= duration or not isfinite(duration):
            raise ValueError(
                f"steps of {dt} s in episodes of {duration} s: the first is above 0, and no longer than the second"
            )
        if not actions or not observations:
            raise ValueError("an environment has an action and an observation, at least")
        everywhere = (-np.inf, np.inf)
        bounds = dict.fromkeys(observations, everywhere)
        if isinstance(observations, Mapping):
            bounds |= observations
        self.deck, self.actions, self.dt, self.start = deck, dict(actions), dt, dict(start or {})
        for what, ranges in (("action", self.actions), ("observation", bounds), ("start", self.start)):
            wrong = next((name for name, (low, high) in ranges.items() if not low <= high), None)
            if wrong is not None:
                raise ValueError(f"{what} `{wrong}`: its least value is above its largest")
        finite = {**self.actions, **self.start}
        unbounded = next((name for name, ends_ in finite.items() if not all(map(isfinite, ends_))), None)
        if unbounded is not None:
            raise ValueError(f"`{unbounded}` has no finite range")
        self.bounds = bounds
        self.steps = max(1, round(duration / dt))
        self.ends = (ends.strip(),) if isinstance(ends, str) else tuple(text.strip() for text in ends)
        self.reward = _expression(reward)

    def session(self) -> Session:
        """The deck, ready. Raises as `Session` does."""
        more = dict.fromkeys(text for text in (self.reward, *self.ends) if text not in self.bounds)
        texts = [*self.bounds, *(f"{{{text}}}" for text in more)]
        return Session(self.deck, list(self.actions), texts, defines=self.defines, options=self.options)

    def places(self, session: Session) -> tuple[list[int], list[int]]:
        """Value references of the actions, and of observations, reward and ends."""
        shown = [*self.bounds, self.reward, *self.ends]
        return [session.reference(n) for n in self.actions], [session.reference(n) for n in shown]

    def spaces(self) -> tuple[spaces.Box, spaces.Box]:
        """Of observations and actions."""
        low, high = np.array(list(self.bounds.values()), np.float32).T
        return spaces.Box(low, high, dtype=np.float32), spaces.Box(
            -1.0, 1.0, (len(self.actions),), np.float32
        )

    def values(self, action: Any) -> NDArray[np.float64]:
        """What actions between -1 and 1 (the last axis) set; beyond, they are at their ends."""
        low, high = np.array(list(self.actions.values())).T
        share = np.clip(np.asarray(action, float), -1.0, 1.0)
        return low + 0.5 * (share + 1.0) * (high - low)

    def split(self, found: NDArray[np.float64]) -> tuple[Any, Any, Any]:
        """Observations, reward, whether it is over, of rows (the last axis) of what `places` names."""
        count = len(self.bounds)
        low, high = np.array(list(self.bounds.values())).T
        seen = np.clip(found[..., :count], low, high).astype(np.float32)
        return seen, found[..., count], (found[..., count + 1 :] > 0.0).any(axis=-1)

    def begin(
        self, session: Session, random: np.random.Generator, at: Mapping[str, float] | None = None
    ) -> None:
        """A start of an episode; `at`: coordinate -> where it is, in place of what is drawn."""
        for name, (low, high) in self.start.items():
            session.place(name, random.uniform(low, high))
        for name, value in (at or {}).items():
            session.place(name, value)
        session.reset()


def _expression(reward: str) -> str:
    """A number stands for itself, though a node may have it as its name."""
    try:
        return f"{float(reward)!r}+0*time"
    except ValueError:
        return reward.strip()


class Environment(gymnasium.Env):
    """One deck in the hands of an agent. `step` gives observation, reward, terminated, truncated and info, whose `time` is
    the deck's [s] and whose `failed` says why a run could not go on: such an episode is over (terminated), with reward 0."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 (gymnasium has it so)

    def __init__(self, task: Task, render_mode: str | None = None) -> None:
        if render_mode is not None:
            raise ValueError("there is nothing to render: `emsim view` shows a deck")
        self.task, self.session, self.render_mode = task, task.session(), None
        self.observation_space, self.action_space = task.spaces()
        self._actions = list(task.actions)
        _, self._shown = task.places(self.session)
        self._count = 0
        self._last = np.zeros(len(task.bounds), np.float32)
        self._over = True

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begins an episode; `options`: coordinate -> where it is at the start, in place of what is drawn."""
        super().reset(seed=seed)
        task = self.task
        task.begin(self.session, self.np_random, options)
        self._count, self._over = 0, False
        self._last, _, _ = task.split(self._read())
        return self._last.copy(), {"time": 0.0}

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        if self._over:
            raise gymnasium.error.ResetNeeded("the episode is over: reset begins another one")
        for name, value in zip(self._actions, self.task.values(action).tolist(), strict=True):
            self.session[name] = value
        self._count += 1
        info: dict[str, Any] = {}
        try:
            self.session.step(self.task.dt)
            self._last, reward, terminated = self.task.split(self._read())
        except ConvergenceError as error:
            reward, terminated = 0.0, True
            info["failed"] = str(error)
        truncated = self._count >= self.task.steps
        self._over = bool(terminated) or truncated
        return (
            self._last.copy(),
            float(reward),
            bool(terminated),
            truncated,
            {"time": self.session.time, **info},
        )

    def _read(self) -> NDArray[np.float64]:
        return np.array([self.session.at(place) for place in self._shown])


def env(
    deck: Source,
    actions: Mapping[str, Range],
    observations: Sequence[str] | Mapping[str, Range],
    reward: str = "0",
    *,
    num_envs: int | None = None,
    threads: int | None = None,
    **more: Any,
) -> Any:
    """A deck as an environment of gymnasium (`Task` says what the arguments are); with num_envs, as many in one `Vector`, which
    run in `threads` of the engine (one for each processor).

    Raises DeckError, OutsideError, ConvergenceError; ValueError for ranges that are none; ImportError without gymnasium.
    """
    task = Task(deck, actions, observations, reward, **more)
    if num_envs is None:
        return Environment(task)
    from .vector import Vector

    return Vector(task, num_envs, threads)
