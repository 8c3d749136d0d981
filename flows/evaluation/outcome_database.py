"""Outcomes of candidates by content key, in a database that several machines share."""

from __future__ import annotations

import os
import socket
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from aesi.errors import InputError, first_line
from aesi.logins import login_left_out, without_login
from flows.base.databases import limits, with_driver


class DatabaseOutcomes:
    """A table in any database SQLAlchemy speaks to; a claim lives as long as its owner's heartbeat."""

    BEAT_S = 2.0
    STALE_S = 20.0

    def __init__(self, url: str) -> None:
        import sqlalchemy as sa
        from sqlalchemy.dialects.mysql import LONGBLOB

        self._sa = sa
        self._engine = engine_of(url)
        self._table = sa.Table(
            "aesi_outcomes",
            sa.MetaData(),
            sa.Column("key", sa.String(64), primary_key=True),
            sa.Column("owner", sa.String(100)),
            # MySQL's FLOAT tells seconds of now apart by 128.
            sa.Column("beat_s", sa.Double),
            # MySQL's BLOB ends at 64 kB.
            sa.Column("data", sa.LargeBinary().with_variant(LONGBLOB(), "mysql", "mariadb")),
        )
        self._owner = f"{socket.gethostname()}:{os.getpid()}:{uuid.uuid4().hex[:8]}"
        self._mine: set[str] = set()
        self._stop = threading.Event()
        self._create()
        self._thread = threading.Thread(target=self._keep_beating, name="aesi-claims", daemon=True)
        self._thread.start()

    def get(self, key: str) -> bytes | None:
        with self._reached() as connection:
            row = connection.execute(
                self._sa.select(self._table.c.data).where(self._table.c.key == key)
            ).first()
        return None if row is None or row[0] is None else bytes(row[0])

    def put(self, key: str, data: bytes) -> None:
        values = {"owner": None, "beat_s": None, "data": data}
        with suppress(self._sa.exc.IntegrityError), self._reached() as connection:
            done = connection.execute(self._table.update().where(self._table.c.key == key).values(**values))
            if done.rowcount == 0:  # who puts the same at the same moment is as good
                connection.execute(self._table.insert().values(key=key, **values))
        self._mine.discard(key)

    def discard(self, key: str) -> None:
        with self._reached() as connection:
            connection.execute(self._table.delete().where(self._table.c.key == key))

    def claim(self, key: str) -> bool:
        if key in self._mine:
            return True
        try:
            with self._reached() as connection:
                connection.execute(
                    self._table.insert().values(key=key, owner=self._owner, beat_s=self._now(connection))
                )
            won = True
        except self._sa.exc.IntegrityError:
            won = self._take_over(key)
        if won:
            self._mine.add(key)
        return won

    def release(self, key: str) -> None:
        if key in self._mine:
            self._mine.discard(key)
            table = self._table
            ours = (table.c.key == key, table.c.owner == self._owner)
            with self._reached() as connection:
                connection.execute(table.delete().where(*ours, table.c.data.is_(None)))
                connection.execute(table.update().where(*ours).values(owner=None, beat_s=None))

    def close(self) -> None:
        self._stop.set()
        for key in list(self._mine):
            with suppress(OSError):  # what cannot be given back goes stale
                self.release(key)
        self._engine.dispose()

    def _take_over(self, key: str) -> bool:
        """Win what nobody computes now: a result, to be made anew, or the claim of a heart that no longer beats."""
        table = self._table
        with self._reached() as connection:
            now = self._now(connection)
            free = self._sa.or_(table.c.owner.is_(None), table.c.beat_s < now - self.STALE_S)
            done = connection.execute(
                table.update().where(table.c.key == key, free).values(owner=self._owner, beat_s=now)
            )
        return done.rowcount == 1

    def beat(self) -> None:
        """Renew the claims of this process; those that could not be given back are not among them, and go stale."""
        if not (mine := list(self._mine)):
            return
        ours = (self._table.c.owner == self._owner, self._table.c.key.in_(mine))
        with self._reached() as connection:
            connection.execute(self._table.update().where(*ours).values(beat_s=self._now(connection)))

    def _keep_beating(self) -> None:
        while not self._stop.wait(self.BEAT_S):
            with suppress(OSError):  # a missed beat is made up by the next; STALE_S is ten of them
                self.beat()

    @contextmanager
    def _reached(self) -> Iterator[Any]:
        """A transaction.  Raises OSError where the database is lost, IntegrityError for a key that is there already."""
        try:
            with self._engine.begin() as connection:
                yield connection
        except self._sa.exc.IntegrityError:
            raise
        except self._sa.exc.SQLAlchemyError as error:
            raise OSError(_reason(error)) from error

    def _now(self, connection: Any) -> float:
        """The database's clock where it has one, because the workers' clocks may differ."""
        if self._engine.dialect.name == "postgresql":
            return float(
                connection.execute(self._sa.text("select extract(epoch from clock_timestamp())")).scalar()
            )
        return time.time()

    def _create(self) -> None:
        try:
            self._engine.connect().close()  # by itself: one that does not answer need not be waited for twice
        except self._sa.exc.SQLAlchemyError as error:
            raise self._unusable(error) from None
        try:
            self._table.create(self._engine, checkfirst=True)
        except self._sa.exc.SQLAlchemyError as error:
            # Two workers may both have found no table; the second to create it is not wrong.
            try:
                exists = self._sa.inspect(self._engine).has_table(self._table.name)
            except self._sa.exc.SQLAlchemyError:
                exists = False
            if not exists:
                raise self._unusable(error) from None

    def _unusable(self, error: Exception) -> InputError:
        url = self._engine.url.render_as_string(hide_password=False)
        reason = login_left_out(_reason(error), url)
        return InputError(f"runner.storage {without_login(url)} cannot be used: {reason}.")


def _reason(error: Exception) -> str:
    """What the driver said, without the statement."""
    return first_line(error.__cause__ or error)


def engine_of(url: str) -> Any:
    """SQLAlchemy's engine for a database; nothing is connected to yet.

    Raises InputError for what is no address, or one whose driver is not installed.
    """
    import sqlalchemy as sa

    try:
        return sa.create_engine(with_driver(url), pool_pre_ping=True, **limits(url))
    except (ImportError, ValueError, sa.exc.ArgumentError) as error:
        advice = "; pip install psycopg2-binary" if isinstance(error, ImportError) else ""
        raise InputError(
            f"runner.storage is no database that can be used: {login_left_out(first_line(error), url)}{advice}."
        ) from None
