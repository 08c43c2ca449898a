"""Many runs of one deck side by side: one call of the engine steps them all, in threads, without Python's lock."""

from __future__ import annotations

import os
import sys

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from .._engine import lead

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from numpy.typing import NDArray

    from .environment import Task


class Vector(VectorEnv):
    """`num_envs` environments of one task. An episode that is over begins anew with the next step, whose action it does not see
    and whose reward is 0 (gymnasium's AutoresetMode.NEXT_STEP). The runs are those of as many single environments, to the bit."""

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 (gymnasium has it so)

    def __init__(self, task: Task, num_envs: int, threads: int | None = None) -> None:
        if num_envs < 1 or (threads is not None and threads < 1):
            raise ValueError(f"{num_envs} environments in {threads} threads: there is one, at least")
        self.task, self.num_envs, self.render_mode = task, num_envs, None
        self.threads = threads or _processors()
        first = task.session()
        self.sessions = [first, *(first.twin() for _ in range(num_envs - 1))]
        self._instances = [s.instance for s in self.sessions]
        self._inputs, self._shown = task.places(first)
        self.single_observation_space, self.single_action_space = task.spaces()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._randoms: list[np.random.Generator] = []
        self._counts = np.zeros(num_envs, int)
        self._over = np.ones(num_envs, bool)
        self._last = np.zeros((num_envs, len(task.bounds)), np.float32)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begins all episodes; a number as seed: the k-th environment has seed + k. With options["reset_mask"] some of them."""
        mask = np.asarray((options or {}).get("reset_mask", np.ones(self.num_envs, bool)), bool)
        seeds = (
            [None if seed is None else seed + k for k in range(self.num_envs)]
            if not isinstance(seed, list)
            else seed
        )
        if seed is not None or not self._randoms:
            known: list[np.random.Generator | None] = [*self._randoms] or [None] * self.num_envs
            self._randoms = [
                old if old is not None and (s is None or not m) else gymnasium.utils.seeding.np_random(s)[0]
                for old, s, m in zip(known, seeds, mask, strict=True)
            ]
        for k in np.flatnonzero(mask):
            self._begin(int(k))
        return self._last.copy(), {}

    def _begin(self, k: int) -> None:
        session = self.sessions[k]
        self.task.begin(session, self._randoms[k])
        self._last[k] = self.task.split(np.array([session.at(place) for place in self._shown]))[0]
        self._counts[k], self._over[k] = 0, False

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        if not self._randoms:
            raise gymnasium.error.ResetNeeded("reset begins the episodes")
        begins = self._over.copy()
        for k in np.flatnonzero(begins):
            self._begin(int(k))
        going = np.flatnonzero(~begins)
        rewards, terminated = np.zeros(self.num_envs), np.zeros(self.num_envs, bool)
        infos: dict[str, Any] = {}
        if going.size:
            given = self.task.values(actions)[going].ravel().tolist()
            instances = [self._instances[k] for k in going]
            data, said = lead(instances, self._inputs, given, self.task.dt, self._shown, self.threads)
            found = np.frombuffer(data).reshape(going.size, -1)
            good = np.array([text is None for text in said])
            seen, paid, over = self.task.split(found)
            self._last[going[good]] = seen[good]
            rewards[going], terminated[going] = np.where(good, paid, 0.0), over | ~good
            if not good.all():
                infos = self._told(going, said)
            self._counts[going] += 1
        truncated = (self._counts >= self.task.steps) & ~begins
        self._over = terminated | truncated
        return self._last.copy(), rewards, terminated, truncated, infos

    def _told(self, going: Any, said: list[str | None]) -> dict[str, Any]:
        texts, has = np.full(self.num_envs, None, object), np.zeros(self.num_envs, bool)
        for k, text in zip(going, said, strict=True):
            texts[k], has[k] = text, text is not None
        return {"failed": texts, "_failed": has}


def _processors() -> int:
    """That this process may run on."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
