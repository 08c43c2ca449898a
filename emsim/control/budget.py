"""What a section may use up: one budget of work, bytes and depth, whatever commands spend them; and what files it may write."""

from __future__ import annotations

from .errors import CommandError

WORK = 1_000_000  # commands, calls of its own functions; an analysis counts as RUN of them
RUN = 20
BYTES = (
    1_000_000_000  # that are printed, put in for variables, written to files, or held in vectors of its own
)
TEXT = 10_000_000  # characters that variables put into one command
DEPTH = 60  # blocks, files of commands, and functions within each other

# files that commands may write, by the end of their names: what results are stored in, and nothing that another program obeys
RESULTS = {
    "raw": "vectors, by write",
    **dict.fromkeys(("txt", "dat", "data", "csv", "tsv", "prn", "out", "log"), "text and columns"),
    "s2p": "S parameters",
    "vcd": "digital nodes",
    **dict.fromkeys(("png", "svg", "pdf", "ps", "eps"), "pictures"),
}


class Spent(Exception):
    """The budget is used up: the section ends."""


class Budget:
    """What is left of each; `Spent` where it is used up, E165 where one command alone asks for too much."""

    __slots__ = ("depth", "left", "most", "work")

    def __init__(self, work: int = WORK) -> None:
        self.most = self.work = work
        self.left, self.depth = BYTES, 0

    def do(self, worth: int = 1) -> None:
        self.work -= worth
        if self.work < 0:
            raise Spent(f"the section has carried out {self.most:,} commands and is stopped here")

    def make(self, size: int) -> None:
        """So many bytes more."""
        self.left -= size
        if self.left < 0:
            raise Spent(f"the section has made {BYTES:,} bytes of text and numbers and is stopped here")

    def put_in(self, length: int) -> None:
        """Text of a variable or of vectors, into a command."""
        if length > TEXT:
            raise CommandError("E165", f"variables put in {length:,} characters here: {TEXT:,} are the most")
        self.make(length)

    def within(self, what: str) -> Budget:
        """`with budget.within(..)`: one more level."""
        if self.depth >= DEPTH:
            said = f"{what}: {DEPTH} blocks, files and functions within each other are the most"
            raise CommandError("E165", said)
        return self

    def __enter__(self) -> None:
        self.depth += 1

    def __exit__(self, *_: object) -> None:
        self.depth -= 1
