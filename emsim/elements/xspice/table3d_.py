"""table3d: straight lines between the values of a table of three inputs."""

from __future__ import annotations

from .base import driving, reading
from .table2d_ import Table2d


class Table3d(Table2d):
    name = "table3d"
    what = "table of three inputs"
    law = "out = offset + gain value, straight lines along all inputs; beyond the table constant"
    ports = (reading("inx"), reading("iny"), reading("inz"), driving("out", "i", "id", "v", "vd"))


MODEL = Table3d
