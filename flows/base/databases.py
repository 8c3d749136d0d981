"""How a database is spoken to: by which driver, and for how long it may leave a question without an answer."""

from __future__ import annotations

from typing import Any

LIBPQ = ("postgresql+psycopg2", "postgresql+psycopg")
"""Drivers that take libpq's names for what limits a connection; how long one may take to be made is
`PGCONNECT_TIMEOUT`, which `flows.base.environment` sets."""
STATEMENT_S = 30
"""What is asked of a database takes milliseconds; more only where another holds a lock, and nobody here holds one for
seconds. Below it a claim would go stale while its owner only waits."""
LOST = {
    "keepalives_idle": 10,
    "keepalives_interval": 5,
    "keepalives_count": 4,
    "tcp_user_timeout": 1000 * STATEMENT_S,
}
"""Time-outs after which a connection is lost whose other end is gone without a word: 10 + 4 * 5 s, the time that a
statement has."""


def with_driver(url: str) -> str:
    """The address of a database as SQLAlchemy takes it, PostgreSQL's with the driver that the `cluster` extra installs.

    SQLAlchemy knows no `postgres://`, and takes `postgresql://` for another driver since its version 2.1.
    """
    for scheme in ("postgresql://", "postgres://"):
        if url.startswith(scheme):
            return f"postgresql+psycopg2://{url.removeprefix(scheme)}"
    return url


def limits(url: str) -> dict[str, Any]:
    """Keywords of SQLAlchemy's `create_engine` with which no statement waits for ever; what the address says wins.

    Raises sqlalchemy.exc.ArgumentError for what is no address.
    """
    from sqlalchemy import make_url

    address = make_url(with_driver(url))
    if address.get_backend_name() == "sqlite":
        return {"connect_args": {"timeout": 60}}
    if address.drivername not in LIBPQ:
        return {}
    ours = {name: value for name, value in LOST.items() if name not in address.query}
    if "statement_timeout" in str(address.query.get("options", "")):
        return {"connect_args": ours}
    return {"connect_args": ours, "pool_events": [(_limit_statements, "connect")]}


def _limit_statements(connection: Any, _: Any) -> None:
    """Asked once it is connected: a pooler in between refuses connections that ask for it in libpq's `options`."""
    with connection.cursor() as cursor:
        cursor.execute(f"SET statement_timeout = '{STATEMENT_S}s'")
    connection.commit()
