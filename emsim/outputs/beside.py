"""A file is written beside the one that it will replace, and takes its place when it is whole: whatever happens on the way,
the old one is there or the new one is."""

from __future__ import annotations

import os


def can_be_replaced(path: str) -> bool:
    """Whether `path` is a file or none; a device or a pipe is written to as it is."""
    return os.path.isfile(path) or not os.path.exists(path)


class replacing:
    """`with replacing(path) as beside`: the name of a new file that becomes `path` at the end of the block, with the permissions
    of what stood there, or goes where the block ends with an exception. `sync`: it is on the disk before the old file goes.
    OSError.

    A link stays a link. Where the folder takes no new file, a file that stands there is written over."""

    __slots__ = ("beside", "real", "sync")

    def __init__(self, path: str, sync: bool = False) -> None:
        self.real, self.sync = os.path.realpath(path), sync
        folder, name = os.path.split(self.real)
        stem, extension = os.path.splitext(name)
        self.beside = os.path.join(folder, f".{stem}.{os.getpid()}{extension}")
        if not can_be_replaced(self.real) or (os.path.exists(self.real) and not takes_files(folder)):
            self.beside = self.real

    def __enter__(self) -> str:
        if self.beside != self.real:
            create(self.beside)
            keep_mode(self.real, self.beside)
        return self.beside

    def __exit__(self, kind: object, *_: object) -> None:
        if self.beside == self.real:
            return
        try:
            if kind is None:
                if self.sync:
                    with open(self.beside, "rb+") as file:
                        os.fsync(file.fileno())
                os.replace(self.beside, self.real)
        finally:
            remove(self.beside)


def write_text(path: str, text: str) -> None:
    """A whole text in the place of a file. OSError."""
    with replacing(path) as beside, open(beside, "w", encoding="utf-8") as file:
        file.write(text)


def create(path: str) -> None:
    """An empty file; nobody else's of that name, nor where a link of that name leads. OSError."""
    remove(path)
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))


def remove(path: str) -> None:
    """Removes a file, if there is one."""
    if os.path.lexists(path):
        os.unlink(path)


def keep_mode(old: str, new: str) -> None:
    """The new file's permissions are the old one's, if there is one."""
    if os.path.exists(old):
        os.chmod(new, os.stat(old).st_mode & 0o7777)


def takes_files(folder: str) -> bool:
    """Whether a file can be made in a folder; where the system has files without a name, by making one."""
    if hasattr(os, "O_TMPFILE"):
        try:
            os.close(os.open(folder, os.O_TMPFILE | os.O_WRONLY, 0o600))
        except OSError as error:
            import errno

            if error.errno not in (errno.EOPNOTSUPP, errno.EISDIR, errno.EINVAL, errno.ENOENT):
                return False
        else:
            return True
    return os.access(folder, os.W_OK | os.X_OK)
