"""Files that are there whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from uuid import uuid4

READ_BY_ALL, READ_BY_OWNER = 0o666, 0o600
"""Less what the process's umask takes off."""


def write_whole(path: Path, content: bytes | str, mode: int = READ_BY_ALL) -> None:
    """Write beside the target, then rename: whoever reads sees the old file or the whole new one.

    content : text is written as UTF-8.  The folder is made where it is missing; a link keeps pointing where it does.
    What is there and is no file (a pipe, a terminal) is written to as it is.
    Raises OSError where the system refuses.
    """
    data = content.encode() if isinstance(content, str) else content
    path.parent.mkdir(parents=True, exist_ok=True)
    target = path.resolve()
    if target.exists() and not target.is_file():
        target.write_bytes(data)
        return
    draft = target.with_name(f".{uuid4().hex}.tmp")
    try:
        with os.fdopen(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(draft, target)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise
