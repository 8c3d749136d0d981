"""The descriptions of the platform: valid, loopback only, pinned, and true to the flows they name."""

import importlib
import inspect
import re
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[3]
COMPOSE = ROOT / "docker-compose.yml"


@pytest.fixture(scope="module")
def compose():
    return yaml.safe_load(COMPOSE.read_text())


def test_the_compose_file_meets_the_specification(tmp_path):
    plugin = (
        shutil.which("docker")
        and not subprocess.run(["docker", "compose", "version"], capture_output=True, check=False).returncode
    )
    command = ["docker", "compose"] if plugin else ["docker-compose"]
    if not shutil.which(command[0]):
        pytest.skip("neither `docker compose` nor `docker-compose` is here")
    shutil.copy(ROOT / ".env.example", tmp_path / ".env")
    arguments = ["--env-file", str(tmp_path / ".env"), "-f", str(COMPOSE), "config", "-q"]
    done = subprocess.run([*command, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_port_is_bound_to_loopback(compose):
    ports = [port for service in compose["services"].values() for port in service.get("ports", [])]
    assert len(ports) == 5
    assert all(port.startswith("127.0.0.1:") for port in ports)


def test_images_are_pinned_and_built_ones_stand_on_a_pinned_one(compose):
    images = {service["image"] for service in compose["services"].values()}
    base = re.search(r"^FROM (\S+)", (ROOT / "deploy" / "Dockerfile").read_text(), re.MULTILINE).group(1)
    for image in {*images, base}:
        assert re.fullmatch(r"[\w./-]+:\d+\.\d+(\.\d+)?(-\w+)*", image), image


def test_no_secret_is_in_the_file(compose):
    text = COMPOSE.read_text()
    for match in re.finditer(r"(?i)(password|secret|key)\w*:[ ]*(.+)", text):
        assert match.group(2).startswith("${") or "set POSTGRES_PASSWORD" in match.group(2), match.group(0)
    assert re.search(r"^\.env$", (ROOT / ".gitignore").read_text(), re.MULTILINE)


def test_a_store_on_amazon_was_refused_for_the_empty_address_of_another(compose):
    for name, service in compose["services"].items():
        given = service.get("environment", {})
        assert not [key for key, value in given.items() if value == "" or str(value).endswith(":-}")], name
    assert "MLFLOW_S3_ENDPOINT_URL" in compose["services"]["mlflow"]["environment"]


def test_what_is_referred_to_is_there(compose):
    services = compose["services"]
    for name, service in services.items():
        assert set(service.get("depends_on", {})) <= set(services), name
        for mount in service.get("volumes", []):
            source = mount.split(":")[0]
            assert (ROOT / source).exists() if source.startswith(".") else source in compose["volumes"], mount
    assert all("healthcheck" in s for n, s in services.items() if n != "aesi")


def test_the_deployments_name_flows_and_their_parameters():
    deployments = yaml.safe_load((ROOT / "prefect.yaml").read_text())["deployments"]
    assert deployments
    for deployment in deployments:
        module, _, name = deployment["entrypoint"].rpartition(".")
        flow = getattr(importlib.import_module(module), name)
        assert set(deployment["parameters"]) <= set(inspect.signature(flow.fn).parameters)
        assert (ROOT / deployment["parameters"]["path"]).is_file()
