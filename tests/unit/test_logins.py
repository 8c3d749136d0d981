"""No login of an address is shown: not of a whole address, not within a text, not in what a driver says of it."""

import pytest

from aesi.errors import first_line
from aesi.logins import login_left_out, login_to_fill_in, without_login, without_logins


@pytest.mark.parametrize(
    ("uri", "shown"),
    [
        ("https://me:secret@tracking.example:5000/a", "https://tracking.example:5000/a"),
        ("postgresql://me:secret@host/db", "postgresql://host/db"),
        ("postgresql://me:s/e?c#r@t@host/db", "postgresql://host/db"),
        ("postgresql://host/db?user=me&password=secret", "postgresql://host/db"),
        ("postgresql://host/db?sslmode=require&password=secret", "postgresql://host/db?sslmode=require"),
        ("https://tracking.example:5000/me@a", "https://tracking.example:5000/me@a"),
        ("http://[::1]:5000/me@a", "http://[::1]:5000/me@a"),
        ("http://me:se/cret@host:5000/a", "http://host:5000/a"),
        ("http//me:secret@host", "http//host"),
        ("me:secret@host:5000", "host:5000"),
        ("tcp:/me:secret@host:5000", "tcp:/host:5000"),
        ("sqlite:////home/me/a@b.db", "sqlite:////home/me/a@b.db"),
        ("/home/me:x/a@b", "/home/me:x/a@b"),
        ("runs/a@b", "runs/a@b"),
    ],
)
def test_the_password_of_a_server_stood_in_reports(uri, shown):
    assert without_login(uri) == shown


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("{uri: 'http://me:secret@host', log_model: no}", "{uri: 'http://host', log_model: no}"),
        (
            '{"storage":"postgresql://a:secret@h/db","address":"tcp://c:secret@e"}',
            '{"storage":"postgresql://h/db","address":"tcp://e"}',
        ),
        ("There is no file http:/me:secret@host/x.csv.", "There is no file http:/host/x.csv."),
        ("runs/a@b, C:/Users/me:x@y, a // b@c", "runs/a@b, C:/Users/me:x@y, a // b@c"),
    ],
)
def test_the_password_of_an_address_within_a_text_is_left_out(text, shown):
    assert without_logins(text) == shown


def test_the_password_of_a_server_stood_in_what_mlflow_says_of_it():
    error = OSError("API request to http://me:secret@host:5000/api failed with exception ...\nmore")
    assert first_line(error) == "API request to http://host:5000/api failed with exception ..."


def test_a_password_with_an_at_sign_was_told_as_a_part_of_the_host():
    """SQLAlchemy ends a password at the first one, and a driver then looks for the host `cret@127.0.0.1`."""
    said = 'could not translate host name "cret@127.0.0.1" to address'
    told = login_left_out(said, "postgresql://me:se@cret@127.0.0.1:9/none")
    assert told == 'could not translate host name "127.0.0.1" to address'


@pytest.mark.parametrize(
    ("uri", "typed"),
    [
        (
            "postgresql://me:secret@host/db?sslmode=require",
            "postgresql://USER:PASSWORD@host/db?sslmode=require",
        ),
        ("postgresql://me@host/db", "postgresql://USER@host/db"),  # the password is in a file of the driver's
        ("postgresql://host/db?user=me&password=secret", "postgresql://USER:PASSWORD@host/db"),
        ("postgresql://host/db", "postgresql://host/db"),
        ("sqlite:////home/me/a@b.db", "sqlite:////home/me/a@b.db"),
    ],
)
def test_a_command_to_be_typed_had_no_place_for_the_login_that_it_needs(uri, typed):
    assert login_to_fill_in(uri) == typed
