"""A headless Chromium for the system tests, driven over WebDriver: Debian's chromium, chromium-driver, python3-selenium."""
import base64
import json
import os
import pathlib
import select
import shutil
import tempfile
import time
import urllib.request

import bed as beds
import view_client as client

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
except ImportError:
    webdriver = None


class Browser:
    """One Chromium with windows; ends with close()."""

    def __init__(self, width=1000, height=640, scale=1):
        if webdriver is None or not shutil.which("chromium") or not shutil.which("chromedriver"):
            raise beds.Skip("no headless browser: apt-get install chromium chromium-driver python3-selenium")
        self.profile = tempfile.mkdtemp(prefix="tubed-chromium-")
        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        # A sandbox of its own needs user namespaces, which root in a namespace of the test has not.
        for word in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", f"--user-data-dir={self.profile}", "--no-proxy-server",
                     f"--window-size={width},{height}", f"--force-device-scale-factor={scale}", "--hide-scrollbars",
                     # WebGL without a graphics card.
                     "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing", "--disable-gpu-rasterization", "--disable-accelerated-2d-canvas",
                     "--disable-background-networking",
                     # Twenty tabs are twenty pages that somebody may look at: none is slowed down for being behind another.
                     "--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding",
                     "--disable-background-timer-throttling"):
            options.add_argument(word)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        environment = dict(os.environ, HOME=self.profile)
        self.driver = webdriver.Chrome(service=Service(shutil.which("chromedriver"), env=environment), options=options)
        self.driver.set_script_timeout(30)
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                    {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": False})

    def open(self, address):
        self.driver.get(address)

    def run(self, script, *arguments):
        """The value of a JavaScript function's body."""
        return self.driver.execute_script(script, *arguments)

    def wait(self, condition, what, timeout_s=10):
        """Until a JavaScript expression is true; its value."""
        until = time.monotonic() + timeout_s * beds.TIME_FACTOR
        while time.monotonic() < until:
            value = self.run(f"return {condition};")
            if value:
                return value
            time.sleep(0.03)
        raise beds.Failure(f"{what}: not within {timeout_s * beds.TIME_FACTOR:.0f} s; the page says {self.said()}")

    def said(self):
        return self.run("return window.tubedView ? [document.body.className, document.querySelector('#word').textContent, "
                        "document.querySelector('#why').textContent] : document.documentElement.outerHTML.slice(0, 200);")

    def errors(self):
        """What the console has of errors, without those of a connection that was cut."""
        return [line["message"] for line in self.driver.get_log("browser")
                if line["level"] == "SEVERE" and "WebSocket" not in line["message"]]

    def picture(self, path):
        """The window as PNG."""
        data = self.driver.execute_cdp_cmd("Page.captureScreenshot", {"format": "png"})["data"]
        pathlib.Path(path).write_bytes(base64.b64decode(data))

    def frames(self, seconds):
        """(time.time(), PNG) of what the browser's compositor puts together within that time, whether or not the script works.

        The times are those of arrival here.
        """
        address = self.driver.capabilities["goog:chromeOptions"]["debuggerAddress"]
        port = int(address.rpartition(":")[2])
        with urllib.request.urlopen(f"http://{address}/json", timeout=10) as answer:
            path = next(page["webSocketDebuggerUrl"] for page in json.load(answer) if page["type"] == "page").partition(str(port))[2]
        status, connection = client.upgrade(origin=None, host=address, path=path, port=port)
        beds.check(status == 101, f"the browser's debugger answers with {status}")
        tools, pictures, until = client.Frames(connection), [], time.monotonic() + seconds
        tools.send(client.masked(b'{"id": 1, "method": "Page.startScreencast", "params": {"format": "png"}}'))
        while (left := until - time.monotonic()) > 0:
            select.select([tools], [], [], left)
            for _, payload in tools.take():
                message = json.loads(payload)
                if message.get("method") == "Page.screencastFrame":
                    pictures.append((time.time(), message["params"]["data"]))
                    session = message["params"]["sessionId"]
                    tools.send(client.masked(json.dumps({"id": 2, "method": "Page.screencastFrameAck", "params": {"sessionId": session}}).encode()))
        connection.close()
        return pictures

    def close(self):
        self.driver.quit()
        shutil.rmtree(self.profile, ignore_errors=True)
