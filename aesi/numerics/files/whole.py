"""Files that are there whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from uuid import uuid4

READ_BY_ALL = 0o666
"""Less what the process's umask takes off."""
NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL


def write_whole(path: Path, content: bytes | str) -> None:
    """Write beside the target, then rename: whoever reads sees the old file or the whole new one.

    content : text is written as UTF-8.  The folder is made where it is missing; a link keeps pointing where it does.
    What is there and is no file (a pipe, a terminal) is written to as it is.
    Raises OSError where the system refuses.
    """
    data = content.encode() if isinstance(content, str) else content
    if _is_open_end(path):
        path.write_bytes(data)
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    target = path.resolve()
    draft = _draft(target.parent)
    try:
        with os.fdopen(os.open(draft, NEW, READ_BY_ALL), "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(draft, target)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise


def check_writable(path: Path) -> None:
    """Raises OSError, with the folder that refuses, where `write_whole` would fail as things are now; leaves nothing.

    A folder on the way that is missing is taken for one that can be made where a file can be.
    """
    if _is_open_end(path):
        return
    linked = path.is_symlink()
    folder = path.resolve().parent if linked else path.absolute().parent
    while not (linked or os.path.lexists(folder)):
        folder = folder.parent
    draft = _draft(folder)
    try:
        os.close(os.open(draft, NEW))
    except OSError as error:
        error.filename = str(folder)  # what the draft is called tells nobody anything
        raise
    draft.unlink()


def _draft(folder: Path) -> Path:
    return folder / f".{uuid4().hex}.tmp"


def _is_open_end(path: Path) -> bool:
    """Is it there and no file: a pipe, a terminal?  Asked of the path itself: what /dev/stdout leads to has no name."""
    return path.exists() and not path.is_file()
