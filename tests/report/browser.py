"""Headless Chromium over its DevTools protocol: opens files, moves the pointer, presses keys, and keeps what goes wrong."""

from __future__ import annotations

import asyncio
import base64
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

from tornado.websocket import WebSocketClientConnection, websocket_connect

CHROMIUM = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), ""
)
START_S = 60.0
ANSWER_S = 60.0


class Page:
    """A tab; `faults` are errors and warnings on its console, exceptions, and files that could not be loaded."""

    def __init__(self, loop: asyncio.AbstractEventLoop, connection: WebSocketClientConnection) -> None:
        self._loop, self._connection, self._number = loop, connection, 0
        self.faults: list[str] = []
        self._events: list[str] = []

    def send(self, method: str, **given: Any) -> dict[str, Any]:
        """Send a command and return its result; events that come before it are kept."""
        return self._loop.run_until_complete(asyncio.wait_for(self._send(method, given), ANSWER_S))

    async def _send(self, method: str, given: dict[str, Any]) -> dict[str, Any]:
        self._number += 1
        number = self._number
        await self._connection.write_message(json.dumps({"id": number, "method": method, "params": given}))
        while True:
            message = await self._next()
            if message.get("id") == number:
                assert "error" not in message, message
                return dict(message["result"])

    async def _next(self) -> dict[str, Any]:
        text = await self._connection.read_message()
        assert text is not None, "the browser went away"
        message: dict[str, Any] = json.loads(text)
        method, given = message.get("method", ""), message.get("params", {})
        self._events.append(method)
        if method == "Runtime.exceptionThrown":
            self.faults.append(str(given["exceptionDetails"]))
        if method == "Runtime.consoleAPICalled" and given["type"] in ("error", "warning", "assert"):
            self.faults.append(str(given["args"]))
        if method == "Log.entryAdded" and given["entry"]["level"] in ("error", "warning"):
            self.faults.append(str(given["entry"]))
        return message

    def open(self, path: Path, width: int = 1400, height: int = 900, *, dark: bool = False) -> float:
        """Open a file and return the seconds until it is loaded and drawn."""
        self.send(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600
        )
        self.theme("dark" if dark else "light")
        self._events.clear()
        begin = time.perf_counter()
        self.send("Page.navigate", url=path.resolve().as_uri())

        async def loaded() -> None:
            while "Page.loadEventFired" not in self._events:
                await self._next()

        self._loop.run_until_complete(asyncio.wait_for(loaded(), ANSWER_S))
        self.do("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 0))))")
        return time.perf_counter() - begin

    def theme(self, name: str) -> None:
        """Let the system prefer light or dark."""
        self.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": name}])

    def do(self, script: str) -> Any:
        """Return the value of an expression, awaited."""
        made = self.send("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in made, made
        return made["result"].get("value")

    def settle(self) -> None:
        """Wait until what a control changed is drawn."""
        self.do("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 30))))")

    def click(self, selector: str, place: int = 0) -> None:
        """Click on an element with the pointer."""
        x, y = self.middle(selector, place)
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self.mouse(kind, x, y, clickCount=1)
        self.settle()

    def middle(self, selector: str, place: int = 0) -> tuple[float, float]:
        """Return the middle of an element that is scrolled into view."""
        box = self.do(
            f"(() => {{ const one = document.querySelectorAll({selector!r})[{place}];"
            "one.scrollIntoView({block: 'center', behavior: 'instant'});"
            "const box = one.getBoundingClientRect(); return [box.x, box.y, box.width, box.height]; })()"
        )
        return box[0] + 0.5 * box[2], box[1] + 0.5 * box[3]

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        """Send an event of the mouse."""
        more = {"button": "none" if kind == "mouseMoved" and not more.get("buttons") else "left", **more}
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def drag(self, x: float, y: float, to_x: float, to_y: float, modifiers: int = 0) -> None:
        """Drag with the left button."""
        self.mouse("mouseMoved", x, y, modifiers=modifiers)
        self.mouse("mousePressed", x, y, clickCount=1, buttons=1, modifiers=modifiers)
        for share in (0.3, 0.6, 1.0):
            self.mouse("mouseMoved", x + share * (to_x - x), y + share * (to_y - y), buttons=1, modifiers=modifiers)
        self.mouse("mouseReleased", to_x, to_y, clickCount=1, modifiers=modifiers)
        self.settle()

    def key(self, name: str, modifiers: int = 0) -> None:
        """Press a key."""
        text = {"text": name} if len(name) == 1 else {}
        self.send("Input.dispatchKeyEvent", type="keyDown", key=name, modifiers=modifiers, **text)
        self.send("Input.dispatchKeyEvent", type="keyUp", key=name, modifiers=modifiers)
        self.settle()

    def picture(self, path: Path, *, whole: bool = True) -> None:
        """Write a picture of the page, of all of it or what is in view."""
        made = self.send("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(made["data"]))

    def printed(self) -> bytes:
        """Return the page as PDF."""
        return base64.b64decode(self.send("Page.printToPDF")["data"])


@contextmanager
def browser(profile: Path) -> Iterator[Page]:
    """Start Chromium with a profile folder of its own and give one tab; end it afterwards."""
    process = subprocess.Popen(
        [
            CHROMIUM,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
            f"--user-data-dir={profile}",
            "--remote-debugging-port=0",
            "about:blank",
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    loop = asyncio.new_event_loop()
    try:
        port = _port(profile / "DevToolsActivePort", process)
        with urlopen(
            Request(f"http://127.0.0.1:{port}/json/new?about:blank", method="PUT"), timeout=ANSWER_S
        ) as answer:
            address = json.load(answer)["webSocketDebuggerUrl"]
        connection = loop.run_until_complete(_connected(address))
        page = Page(loop, connection)
        for domain in ("Page", "Runtime", "Log"):
            page.send(f"{domain}.enable")
        yield page
        connection.close()
        loop.run_until_complete(asyncio.sleep(0))
    finally:
        process.terminate()
        process.wait(timeout=30)
        loop.run_until_complete(loop.shutdown_asyncgens())
        loop.close()


async def _connected(address: str) -> WebSocketClientConnection:
    return await websocket_connect(address, max_message_size=1 << 28)


def _port(file: Path, process: subprocess.Popen[bytes]) -> int:
    end = time.monotonic() + START_S
    while time.monotonic() < end and process.poll() is None:
        if file.exists() and (lines := file.read_text().split()):
            return int(lines[0])
        time.sleep(0.05)
    raise RuntimeError("Chromium did not start")
