"""Content keys: what a result depends on, as a hash."""

from __future__ import annotations

import hashlib


def key(*parts: bytes | str) -> str:
    """Hash of the parts, 32 hexadecimal digits; the boundaries between the parts count."""
    sha = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        sha.update(len(data).to_bytes(8, "big") + data)
    return sha.hexdigest()[:32]
