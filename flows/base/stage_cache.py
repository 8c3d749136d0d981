"""Results of stages by content: data, settings and code make the key, so nothing stale is ever found."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from aesi.numerics.files.source_digest import source_digest
from aesi.numerics.files.whole import write_whole
from flows.base import codec, environment, fingerprint

T = TypeVar("T")


class Cache:
    """Stage results below .aesi/cache/stages. `reuse` False computes everything anew, and stores it."""

    def __init__(self, say: Callable[[str], None], reuse: bool = True) -> None:
        self._folder = environment.state() / "cache" / "stages"
        self._say = say
        self._reuse = reuse

    def get(self, stage: str, parts: tuple[str, ...], compute: Callable[[], T]) -> T:
        """What the stage gave for these parts before, or what it gives now.

        A damaged entry is computed again, and said. A result that is no plain data, or that does not fit on
        the disk, is not kept, which is said too.
        """
        path = self._folder / f"{stage}-{fingerprint.key(source_digest(), *parts)}.bin"
        if self._reuse and path.is_file():
            try:
                found: T = codec.loads(path.read_bytes())
            except (codec.Damaged, OSError) as error:
                self._say(
                    f"cache: the stored result of {stage!r} is damaged ({error}); it is computed again."
                )
            else:
                self._say(f"{stage}: from the cache")
                return found
        result = compute()
        try:
            write_whole(path, codec.dumps(result))
        except codec.Uncodable:  # a fitted object of another library would be unsafe to unpickle
            self._say(
                f"{stage}: done (not stored: where this run is stopped and resumed, it is computed again)"
            )
        except OSError as error:
            self._say(f"cache: the result of {stage!r} could not be stored ({error.strerror or error}).")
        return result
