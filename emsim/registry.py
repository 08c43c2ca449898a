"""Lists of what there is, by name, whose files are imported when one of their names is asked for: a deck of resistors loads no
transistor, no machine, and no analysis but its own."""

from __future__ import annotations

from _collections_abc import Mapping  # collections.abc, without all else that is in `collections`

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    Names = Mapping[str, Any]
else:
    Names = Mapping


class Registry(Names):
    """name -> what is registered, in the order of the index. `package`: where the files are. `index`: name -> "module Attribute".
    `made`: what has been asked for so far."""

    __slots__ = ("index", "made", "package")

    def __init__(self, package: str, index: dict[str, str]) -> None:
        self.package, self.index = package, index
        self.made: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        found = self.made.get(name)
        if found is None:
            module, attribute = self.index[name].split()
            found = getattr(__import__(f"{self.package}.{module}", fromlist=[attribute]), attribute)
            self.made[name] = found
        return found

    def __contains__(self, name: object) -> bool:
        return name in self.index

    def __iter__(self) -> Iterator[str]:
        return iter(self.index)

    def __len__(self) -> int:
        return len(self.index)
