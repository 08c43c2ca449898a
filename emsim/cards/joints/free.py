"""free: coordinates of B against A, and nothing that holds it. In the plane."""

from __future__ import annotations

from .planar import Planar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..._engine import Builder
    from ..kinematics import Frame, Vector
    from .base import Closure


class Free(Planar):
    name = "free"
    in_plane_only = True

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        return []
