#!/usr/bin/python3
"""Makes config/docs/pictures/view-*.png: the page in Chromium, of the demo's robots and of the recording.
    tests/page/make_pictures.py [DIRECTORY]"""
import pathlib
import re
import subprocess
import sys
import tempfile
import time

from devtools import Browser
from viewer import RECORDING, SOURCE, TOOL, Viewer, replayed

PORT = 47581
DEMO_SECONDS = 60


def demo_page(log):
    """The address of the page of a running demo, once it is printed."""
    while not (found := re.search(r"page: (http\S+)", pathlib.Path(log).read_text())):
        time.sleep(0.2)
    return found.group(1)


def picture_live(browser, out):
    with tempfile.NamedTemporaryFile("w+") as log:
        demo = subprocess.Popen([TOOL, "demo", "--scenario", "four", "--for", str(DEMO_SECONDS), "--view", "--listen", "127.0.0.1:0",
                                 "--port", str(PORT)], stdout=log)
        try:
            page = browser.page(demo_page(log.name), width=1440, height=900)
            page.wait("globalThis.crepes && crepes.scene.robots.length === 3", "three neighbors")
            page.key("m")  # with the measurements
            time.sleep(20)  # trails and charts fill
            page.picture(out / "view-live.png")
            page.key("4")
            page.wait("crepes.camera.picture?.robots.length === 3 && crepes.camera.times.length > 5", "three robots in the camera's picture")
            page.picture(out / "view-camera.png")
            page.close()
        finally:
            demo.terminate()
            demo.wait()


def picture_replay(browser, out):
    with tempfile.TemporaryDirectory() as directory:
        viewer = Viewer(replayed(directory), "--truth", RECORDING)
        page = browser.page(viewer.url, width=1440, height=900, dark=True)
        page.wait("globalThis.crepes && crepes.scene.robots.length > 0")
        page.value("crepes.charts.setFocus('r2'); document.getElementById('sigma').value = '30'; crepes.scene.settings.sigma = 30; crepes.seek(14.5)")
        page.wait("crepes.scene.time === 14.5")
        time.sleep(1)
        page.picture(out / "view-replay.png")
        viewer.stop()


if __name__ == "__main__":
    directory = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else SOURCE / "config/docs/pictures")
    chromium = Browser()
    picture_replay(chromium, directory)
    picture_live(chromium, directory)
    chromium.close()
