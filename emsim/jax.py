"""A deck as a function that JAX differentiates: `pip install emsim[jax]`.

    f = emsim.jax.function("servo.cir", of=["miss", "energy"], by=["u1", "u2"])
    jax.grad(lambda u: f(u) @ weights)(u)

Runs go through `pure_callback`, so that jit and vmap (one after the other) take it; the rule is a custom_jvp whose tangent is the
matrix of derivatives times that of the numbers: JAX turns it round, and grad, vjp, jacrev and jacfwd all have it. Second
derivatives are refused by JAX. Numbers are float32 unless jax_enable_x64 is set, as everywhere in JAX.
"""

from __future__ import annotations

from .differentiable import Function

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any


def function(*args: Any, **given: Any) -> Callable[[Any], Any]:
    """A function of an array (quantities,) that gives an array (measures,); arguments as `emsim.differentiable.Function` has
    them. Its attribute `deck` is that Function. Raises ImportError without JAX, and what Function raises."""
    import jax
    import jax.numpy as jnp
    import numpy as np

    deck = Function(*args, **given)
    shape, slopes = (len(deck.names),), (len(deck.names), len(deck.by))

    def dtype() -> Any:
        return jnp.result_type(float)

    def call(find: Callable[[Any], Any], shapes: Any, x: Any) -> Any:
        return jax.pure_callback(find, shapes, x, vmap_method="sequential")

    def values(x: Any) -> Any:
        return deck.values(np.asarray(x, float)).astype(dtype())

    def both(x: Any) -> Any:
        y, matrix = deck.both(np.asarray(x, float))
        return y.astype(dtype()), matrix.astype(dtype())

    @jax.custom_jvp
    def run(x: Any) -> Any:
        return call(values, jax.ShapeDtypeStruct(shape, dtype()), x)

    @run.defjvp
    def along(primals: Any, tangents: Any) -> Any:
        (x,), (moved,) = primals, tangents
        shapes = (jax.ShapeDtypeStruct(shape, dtype()), jax.ShapeDtypeStruct(slopes, dtype()))
        y, matrix = call(both, shapes, x)
        return y, matrix @ moved

    def of(x: Any) -> Any:
        return run(jnp.asarray(x, dtype()))

    of.deck = deck  # type: ignore[attr-defined]
    return of
