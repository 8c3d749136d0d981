"""The commit that a run is tracked with is that of the code."""

import subprocess

import pytest

from flows.tracking.provenance import commit_tags


@pytest.fixture
def repository(tmp_path):
    """A repository with a file in it, and one that it does not keep."""
    (tmp_path / "kept.py").write_text("")
    (tmp_path / "site-packages").mkdir()
    (tmp_path / "site-packages" / "installed.py").write_text("")

    def git(*arguments):
        who = ("-c", "user.name=somebody", "-c", "user.email=somebody@example.org")
        done = subprocess.run(
            ["git", "-C", tmp_path, *who, *arguments], check=True, capture_output=True, text=True
        )
        return done.stdout.strip()

    git("init", "-q")
    git("add", "kept.py")
    git("commit", "-q", "-m", "first")
    return tmp_path, git("rev-parse", "HEAD")


def test_the_commit_of_code_that_a_repository_keeps(repository):
    folder, commit = repository
    clean = {"mlflow.source.git.commit": commit, "aesi.dirty": "false"}
    assert commit_tags(folder / "kept.py") == clean
    (folder / "kept.py").write_text("changed = True")
    assert commit_tags(folder / "kept.py") == clean | {"aesi.dirty": "true"}


def test_a_package_in_a_folder_of_another_project_was_tracked_with_that_one_s_commit(repository):
    folder, _ = repository
    assert commit_tags(folder / "site-packages" / "installed.py") == {"aesi.dirty": "unknown"}
