"""Addresses of servers and databases as they may be shown and written: without the user and the password in them."""

from __future__ import annotations

import re

SERVERS = ("http", "https")
HEAD = re.compile(r"[A-Za-z][\w+.-]+:/{1,2}|[\w+.-]*//")
"""The scheme and the slashes behind it; one alone is what paths make of two, and where the letter before it is but one
a drive of Windows."""
ADDRESS = re.compile(rf"(?:{HEAD.pattern})(?:(?![A-Za-z][\w+.-]*://)\S)*")
"""What may be an address within a text, from its scheme to the next white space or to the next scheme."""
SERVER_LOGIN = re.compile(r"^[^/?#]*@|^[^/?#:\[]*:(?!\d*(?:[/?#]|$)).*@")
"""The login at the head of what follows the slashes; it holds `/`, `?` and `#`, which a server takes for the end of the
host, only where no port can be meant."""
DATABASE_LOGIN = re.compile(r"^[^:/]*(:[^@]*)?@([^/?@]*@)*")
"""The same of a database: a password may hold `/`, `?` and `#` where SQLAlchemy reads it."""
BARE_LOGIN = re.compile(r"^[^/@]*:.*@")
"""The login of what is meant as an address and has no scheme."""
LOGIN_OPTION = re.compile(r"[^=]*(user|passw|pwd|odbc_connect)", re.IGNORECASE)
"""An option behind the `?` of a database's address that holds a part of the login."""


def without_login(uri: str) -> str:
    """The address without the user and the password that may be in it, as it may be shown and written."""
    head, login = _head_and_login(uri)
    rest = uri[len(head) + len(login) :]
    if not head or head.startswith(SERVERS):
        return head + rest
    place, _, options = rest.partition("?")
    kept = [option for option in options.split("&") if option and not LOGIN_OPTION.match(option)]
    return f"{head}{place}{'?' if kept else ''}{'&'.join(kept)}"


def login_to_fill_in(uri: str) -> str:
    """The address as a command line to be typed shows it: USER and PASSWORD stand where the login was."""
    shown = without_login(uri)
    if shown == uri:
        return uri
    head, login = _head_and_login(uri)
    blank = "USER@" if login and ":" not in login else "USER:PASSWORD@"
    return f"{head}{blank}{shown.removeprefix(head)}"


def logins_to_fill_in(text: str) -> str:
    """A text with each address in it as `login_to_fill_in` has it."""
    return ADDRESS.sub(lambda found: login_to_fill_in(found[0]), text)


def without_logins(text: str) -> str:
    """A text, such as an error's, with each address in it as `without_login` has it."""
    return ADDRESS.sub(lambda found: without_login(found[0]), text)


def login_left_out(text: str, uri: str) -> str:
    """What is said about an address, without the login of that: one that holds an `@` is told as a part of the host."""
    _, login = _head_and_login(uri)
    for part in filter(None, login.split("@")):
        text = text.replace(f"{part}@", "")
    return text


def _head_and_login(uri: str) -> tuple[str, str]:
    """The scheme with its slashes and the login behind them; '' for what an address lacks."""
    head = found[0] if (found := HEAD.match(uri)) else ""
    login = SERVER_LOGIN if head.startswith(SERVERS) else DATABASE_LOGIN if head else BARE_LOGIN
    there = login.match(uri[len(head) :])
    return head, there[0] if there else ""
