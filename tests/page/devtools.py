"""A headless Chromium, driven over its DevTools protocol through a pipe: no library, no port."""
import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

PATIENCE_S = 60  # what is awaited comes within a second; this is for machines that do much else


class CannotStart(Exception):
    """There is no browser here, or it does not run."""


class Browser:
    def __init__(self):
        program = shutil.which("chromium") or shutil.which("chromium-browser")
        if program is None:
            raise CannotStart("chromium is not installed")
        self.profile = tempfile.mkdtemp(prefix="crepes-page-")
        requests, self.to_browser = os.pipe()
        self.from_browser, answers = os.pipe()
        # The browser reads from descriptor 3 and writes to 4.
        command = ["bash", "-c", 'exec "$@" 3<&"$CREPES_REQUESTS" 4>&"$CREPES_ANSWERS"', "bash", program, "--headless=new",
                   "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--disable-extensions",
                   "--disable-background-networking", "--disable-component-update", "--disable-sync", "--mute-audio",
                   "--force-color-profile=srgb", "--hide-scrollbars",
                   "--remote-debugging-pipe", f"--user-data-dir={self.profile}", "about:blank"]
        self.log = open(os.path.join(self.profile, "log"), "w+")
        environment = {**os.environ, "CREPES_REQUESTS": str(requests), "CREPES_ANSWERS": str(answers)}
        self.process = subprocess.Popen(command, pass_fds=(requests, answers), env=environment, stderr=self.log, stdout=self.log)
        os.close(requests)
        os.close(answers)
        self.buffer, self.number, self.events = b"", 0, []
        try:
            self.call("Browser.getVersion")
        except (OSError, TimeoutError) as error:
            self.log.seek(0)
            last = self.log.read().strip().splitlines()[-3:]
            self.close()
            raise CannotStart(f"chromium does not start: {error}; {last}") from error

    def close(self):
        try:
            self.call("Browser.close")
            self.process.wait(10)
        except (OSError, TimeoutError, subprocess.TimeoutExpired):
            self.process.kill()
            self.process.wait()
        os.close(self.to_browser)
        os.close(self.from_browser)
        self.log.close()
        shutil.rmtree(self.profile, ignore_errors=True)

    def _receive(self, deadline):
        """The next message, or None at the deadline."""
        while b"\0" not in self.buffer:
            left = max(0.0, deadline - time.monotonic())
            if not select.select([self.from_browser], [], [], left)[0]:
                return None
            chunk = os.read(self.from_browser, 1 << 16)
            if not chunk:
                raise OSError("the browser has ended")
            self.buffer += chunk
        message, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(message)

    def call(self, method, session=None, **params):
        """The result of a method; events that come meanwhile are kept."""
        self.number += 1
        request = {"id": self.number, "method": method, "params": params}
        if session:
            request["sessionId"] = session
        os.write(self.to_browser, json.dumps(request).encode() + b"\0")
        deadline = time.monotonic() + PATIENCE_S
        while True:
            message = self._receive(deadline)
            if message is None:
                raise TimeoutError(f"{method}: no answer")
            if message.get("id") == self.number:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                return message["result"]
            self.events.append(message)

    def page(self, url, width=1280, height=800, dark=False):
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        return Page(self, target, session, url, width, height, dark)


class Page:
    def __init__(self, browser, target, session, url, width, height, dark):
        self.browser, self.target, self.session = browser, target, session
        for domain in ("Page", "Runtime", "Network", "Log", "Accessibility"):
            self.call(f"{domain}.enable")
        self.size(width, height)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        self.call("Page.navigate", url=url)

    def call(self, method, **params):
        return self.browser.call(method, session=self.session, **params)

    def size(self, width, height):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def value(self, expression):
        """The value of an expression in the page; promises are awaited."""
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{expression}: {result['exceptionDetails'].get('exception', {}).get('description')}")
        return result["result"].get("value")

    def wait(self, expression, what=None, patience=PATIENCE_S):
        """Waits until an expression is true; how long it took [s]."""
        start = time.monotonic()
        while time.monotonic() - start < patience:
            try:
                if self.value(expression):
                    return time.monotonic() - start
            except RuntimeError:
                pass  # the page is not there yet
            time.sleep(0.05)
        raise AssertionError(f"waited in vain for: {what or expression}")

    def key(self, key):
        text = "\r" if key == "Enter" else key if len(key) == 1 else ""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, text=text if kind == "keyDown" else "", **({"windowsVirtualKeyCode": 13} if key == "Enter" else {}))

    def click(self, x, y):
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def picture(self, file):
        with open(file, "wb") as out:
            out.write(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def _events(self, method):
        self.value("0")  # what is on its way arrives before this answer
        return [e["params"] for e in self.browser.events if e.get("sessionId") == self.session and e["method"] == method]

    def requests(self):
        """The addresses of all requests so far."""
        return [e["request"]["url"] for e in self._events("Network.requestWillBeSent")]

    def complaints(self):
        """Errors and warnings of the console, uncaught exceptions, refused content."""
        log = [e["entry"] for e in self._events("Log.entryAdded") if e["entry"]["level"] in ("error", "warning")]
        console = [e for e in self._events("Runtime.consoleAPICalled") if e["type"] in ("error", "warning", "assert")]
        thrown = [e["exceptionDetails"] for e in self._events("Runtime.exceptionThrown")]
        return [f"{e.get('text')} {e.get('url', '')}" for e in log] + [str(e) for e in console] + [str(e) for e in thrown]

    def accessible(self):
        """(role, name) of all that a screen reader finds."""
        nodes = self.call("Accessibility.getFullAXTree")["nodes"]
        return [(n.get("role", {}).get("value"), n.get("name", {}).get("value", "")) for n in nodes if not n.get("ignored")]

    def busy_s(self):
        """What the page's thread has worked since Performance.enable."""
        metrics = {each["name"]: each["value"] for each in self.call("Performance.getMetrics")["metrics"]}
        return metrics["TaskDuration"]

    def close(self):
        self.browser.call("Target.closeTarget", targetId=self.target)
