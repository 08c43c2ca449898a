"""A deck as a function that PyTorch differentiates: `pip install emsim[torch]`.

    f = emsim.torch.function("servo.cir", of=["miss", "energy"], by=["u1", "u2"])
    f(u).sum().backward()

An autograd.Function whose backward pass multiplies by the matrix of derivatives that the run has found. Numbers are float64
inside; what comes out has the type and place of what went in. Second derivatives are refused by PyTorch.
"""

from __future__ import annotations

from .differentiable import Function

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any


def function(*args: Any, **given: Any) -> Callable[[Any], Any]:
    """A function of a tensor (quantities,) that gives a tensor (measures,); arguments as `emsim.differentiable.Function` has
    them. Its attribute `deck` is that Function. Raises ImportError without PyTorch, and what Function raises."""
    import torch

    deck = Function(*args, **given)

    class Run(torch.autograd.Function):
        @staticmethod
        def forward(ctx: Any, x: Any) -> Any:
            numbers = x.detach().cpu().double().numpy()
            if not ctx.needs_input_grad[0]:
                return torch.as_tensor(deck.values(numbers)).to(x)
            y, matrix = deck.both(numbers)
            ctx.save_for_backward(torch.as_tensor(matrix).to(x))
            return torch.as_tensor(y).to(x)

        @staticmethod
        @torch.autograd.function.once_differentiable
        def backward(ctx: Any, moved: Any) -> Any:
            (matrix,) = ctx.saved_tensors
            return moved @ matrix

    def of(x: Any) -> Any:
        return Run.apply(x)

    of.deck = deck  # type: ignore[attr-defined]
    return of
