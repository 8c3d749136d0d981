"""A headless Chromium, spoken to over its debugging protocol; tests skip where there is none."""

import base64
import json
import shutil
import subprocess
import time
import urllib.request
from pathlib import Path

import pytest
import synthetic_views

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--remote-debugging-port=0",
    "--remote-allow-origins=*",
)
START_S = 30.0


class Page:
    """One tab: opens files, evaluates expressions, collects what the console and the network said."""

    def __init__(self, socket):
        self._socket = socket
        self._next = 0
        self.errors = []
        self.requests = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method, **params):
        self._next += 1
        self._socket.send(json.dumps({"id": self._next, "method": method, "params": params}))
        while True:
            message = json.loads(self._socket.recv(timeout=60))
            if message.get("id") == self._next:
                assert "error" not in message, message["error"]
                return message["result"]
            self._note(message)

    def _note(self, message):
        method, params = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.errors.append(params["exceptionDetails"]["text"])
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.errors.append(" ".join(str(a.get("value")) for a in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.errors.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])

    def evaluate(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait_for(self, condition, timeout_s=30.0):
        end = time.monotonic() + timeout_s
        while not self.evaluate(condition):
            assert time.monotonic() < end, f"{condition} did not come true in {timeout_s:g} s"
            time.sleep(0.05)

    def open(
        self,
        path,
        width=1280,
        height=900,
        dark=False,
        shown="document.documentElement?.dataset.plots === 'drawn'",
    ):
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **metrics)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
        self.errors.clear()
        self.requests.clear()
        self.call("Page.navigate", url=Path(path).resolve().as_uri())
        self.wait_for(shown)

    def drag(self, element, start, stop):
        """Press, move and release the mouse over an element, at shares of its width."""
        self.evaluate(f"{element}.scrollIntoView({{block: 'center'}})")
        box = self.evaluate(f"(r => [r.x, r.y, r.width, r.height])({element}.getBoundingClientRect())")
        y = box[1] + box[3] / 2
        for kind, share in (
            ("Pressed", start),
            ("Moved", (start + stop) / 2),
            ("Moved", stop),
            ("Released", stop),
        ):
            position = {"x": box[0] + share * box[2], "y": y}
            self.call(
                "Input.dispatchMouseEvent", type=f"mouse{kind}", button="left", clickCount=1, **position
            )

    def pdf(self):
        return base64.b64decode(self.call("Page.printToPDF", printBackground=False)["data"])


@pytest.fixture(scope="session")
def page(tmp_path_factory):
    from websockets.sync.client import connect

    binary = next((path for path in map(shutil.which, NAMES) if path), None)
    if binary is None:
        pytest.skip("no Chromium here")
    profile = tmp_path_factory.mktemp("chromium")
    command = [binary, *FLAGS, f"--user-data-dir={profile}", "about:blank"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        port = _port(profile / "DevToolsActivePort", process)
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list", timeout=10) as answer:
            tab = next(t for t in json.load(answer) if t["type"] == "page")
        with connect(tab["webSocketDebuggerUrl"], max_size=None) as socket:
            yield Page(socket)
    finally:
        process.terminate()
        process.wait(timeout=10)


def _port(file, process):
    end = time.monotonic() + START_S
    while not (file.exists() and file.read_text().strip()):
        if process.poll() is not None or time.monotonic() > end:
            pytest.skip("Chromium does not start here")
        time.sleep(0.05)
    return int(file.read_text().split()[0])


@pytest.fixture(scope="session")
def views():
    """The synthetic views of tests/unit/pipeline."""
    return synthetic_views
