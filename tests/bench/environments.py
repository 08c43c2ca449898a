"""Steps a second of the environments: `python tests/bench/environments.py [seconds]`.

emsim's cart-pole for 1, 16 and 256 at once, in one thread and in as many as there are processors, and gymnasium's
InvertedPendulum-v5 (MuJoCo, two steps of 20 ms of RK4, where `gymnasium[mujoco]` is installed) stepped the same way. Actions
are random; episodes that end begin anew.
"""

from __future__ import annotations

import sys
from time import perf_counter

import gymnasium
import numpy as np

from emsim.environments import cart_pole, leg


def rate(many, seconds: float) -> float:
    """Steps of all environments a second of wall time."""
    many.reset(seed=0)
    random = np.random.default_rng(0)
    shape = many.action_space.shape
    actions = [random.uniform(-1.0, 1.0, shape).astype(np.float32) for _ in range(64)]
    many.step(actions[0])
    count, begin = 0, perf_counter()
    while perf_counter() - begin < seconds:
        many.step(actions[count % 64])
        count += 1
    return count * many.num_envs / (perf_counter() - begin)


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 2.0
    print("environment            at once  threads  steps a second")
    for name, make in (("emsim/CartPole-v0", cart_pole.make_vec), ("emsim/Leg-v0", leg.make_vec)):
        for count in (1, 16, 256):
            for threads in (1, None):
                many = make(count, threads=threads)
                print(f"{name:22} {count:7}  {many.threads:7}  {rate(many, seconds):14.0f}", flush=True)
    try:
        import imageio  # noqa: F401
        import mujoco  # noqa: F401
    except ImportError:
        return
    for count in (1, 16, 256):
        many = gymnasium.make_vec("InvertedPendulum-v5", num_envs=count, vectorization_mode="sync")
        print(f"{'InvertedPendulum-v5':22} {count:7}  {1:7}  {rate(many, seconds):14.0f}", flush=True)


if __name__ == "__main__":
    main()
