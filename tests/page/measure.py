#!/usr/bin/python3
"""What the page costs: its size, the server's bytes and CPU with robots at 50 Hz and open pages, latency and rate of the pictures.
The median of RUNS (3) of SECONDS (10) each, and the least and the greatest of what varies most.
    tests/page/measure.py [SECONDS [RUNS]]"""
import gzip
import json
import pathlib
import select
import socket
import statistics
import subprocess
import sys
import tempfile
import time

from devtools import Browser, CannotStart
from fake_cameras import FakeCameras
from fake_daemon import FakeDaemon
from viewer import SOURCE, TOOL, Viewer, cpu_s

PORT = 47583


def medians(runs, measure, *arguments):
    """Of each column of what `measure` returns, and the least and greatest of the first."""
    rows = [measure(*arguments) for _ in range(runs)]
    first = [row[0] for row in rows]
    return [statistics.median(column) for column in zip(*rows)], (min(first), max(first))


def size_of_the_page():
    texts = [file.read_bytes() for file in (SOURCE / "daemon/ctl/view/page").iterdir() if file.suffix != ".md"]
    return sum(map(len, texts)), sum(len(gzip.compress(text)) for text in texts)


def reader(viewer, path="/events?robot=0"):
    connection = socket.create_connection(("127.0.0.1", viewer.port), 10)
    connection.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{viewer.port}\r\n\r\n".encode())
    return connection


def cost(robots, pages, seconds):
    """CPU of the server [share of a core] and bytes a second to one page."""
    daemon = FakeDaemon(neighbors=robots - 1)
    viewer = Viewer("--port", daemon.port)
    readers = [reader(viewer) for _ in range(pages)]
    time.sleep(1)
    start, before, received = time.monotonic(), viewer.cpu_s(), 0
    while time.monotonic() < start + seconds:
        for connection in select.select(readers, [], [], 0.2)[0]:
            received += len(connection.recv(1 << 20))
    share = (viewer.cpu_s() - before) / (time.monotonic() - start)
    for connection in readers:
        connection.close()
    viewer.stop()
    daemon.stop()
    return share, received / pages / seconds if pages else 0


def cost_of_pictures(pages, seconds):
    """CPU of the server with open camera panels, bytes and pictures a second to each. 640 x 512 pixels, simulated noise."""
    with tempfile.TemporaryDirectory() as folder:
        daemon = FakeDaemon(neighbors=4)
        cameras = FakeCameras(f"{folder}/socket", daemon, noise=True)
        viewer = Viewer("--port", daemon.port, "--socket", f"{folder}/socket")
        readers = [reader(viewer, path) for _ in range(pages) for path in ("/events?robot=0", "/camera?robot=0&camera=0")]
        time.sleep(1)
        start, before, received, asked = time.monotonic(), viewer.cpu_s(), 0, cameras.asked
        while time.monotonic() < start + seconds:
            for connection in select.select(readers, [], [], 0.2)[0]:
                received += len(connection.recv(1 << 20))
        took = time.monotonic() - start
        share, rate = (viewer.cpu_s() - before) / took, (cameras.asked - asked) / took
        for connection in readers:
            connection.close()
        viewer.stop()
        cameras.stop()
        daemon.stop()
    return share, received / pages / took, rate


class Daemon:
    """A simulated robot's daemon, alone in its world: 200 pictures of 1280 x 1024 a second."""

    def __init__(self, folder):
        self.socket = f"{folder}/socket"
        config = pathlib.Path(folder) / "r1.yaml"
        text = (SOURCE / "config/examples/four-simulated/r1.yaml").read_text()
        config.write_text(text.replace('socket: ""', f'socket: "{self.socket}"').replace("port: 47475", f"port: {PORT}, listen: [127.0.0.1]"))
        self.process = subprocess.Popen([TOOL.replace("crepesctl", "crepesd"), "--config", str(config)], stderr=subprocess.DEVNULL)

    def cpu_s(self):
        return cpu_s(self.process.pid)

    def delays(self):
        """From a picture's arrival to its spots, in the last second: median and 99 % [us]."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.settimeout(2)
            client.sendto(b'{"class":"POLL","about":"sensors"}', ("127.0.0.1", PORT))
            status = json.loads(client.recv(2000))
        counts = next(sensor["counts"] for sensor in status["sensors"] if sensor["name"].endswith("spots"))
        return counts["delay_p50_us"], counts["delay_p99_us"]


def look(connection):
    """Asks for a picture and reads it: its bytes."""
    connection.sendall(b"LOOK 1 0\n")
    while True:
        head = b""
        while not head.endswith(b"\n"):
            head += connection.recv(1)
        kind, size = head.split()
        left = int(size)
        while left > 0:
            left -= len(connection.recv(left))
        if kind == b"look":
            return int(size)


def cost_to_the_daemon(seconds):
    """(share of a core, median and 99 % of the delay to the spots, pictures a second) without and with who looks, in turns."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        daemon = Daemon(folder)
        time.sleep(6)  # hot pixels are learned
        for is_looking in (False, True, False, True):
            with socket.socket(socket.AF_UNIX) as connection:
                connection.connect(daemon.socket)
                start, before, pictures, delays = time.monotonic(), daemon.cpu_s(), 0, []
                while time.monotonic() < start + seconds:
                    due = time.monotonic() + 0.2
                    if is_looking:
                        look(connection)
                        pictures += 1
                    time.sleep(max(0, due - time.monotonic()))
                    delays.append(daemon.delays())
                took = time.monotonic() - start
            median, worst = (sorted(column)[len(delays) // 2] for column in zip(*delays))
            rows.append(((daemon.cpu_s() - before) / took, median, worst, pictures / took))
        daemon.process.terminate()
        daemon.process.wait()
    return rows


def first_picture():
    """Seconds from the navigation to the first robot in the scene, the second time: the browser is warm."""
    daemon = FakeDaemon(neighbors=4)
    viewer = Viewer("--port", daemon.port)
    browser = Browser()
    took = []
    for _ in range(3):
        start = time.monotonic()
        page = browser.page(viewer.url)
        page.wait("globalThis.crepes && crepes.scene.robots.length > 0")
        took.append(time.monotonic() - start)
        latency = page.value("""new Promise((done) => { const seen = []; const look = () => {
            if (crepes.store.newest && seen.at(-1) !== crepes.store.newest.wall) seen.push(crepes.store.newest.wall);
            seen.length < 100 ? requestAnimationFrame(look) : done((seen.at(-1) - seen[0]) / (seen.length - 1)); }; look(); })""")
        page.close()
    browser.close()
    viewer.stop()
    daemon.stop()
    return took, latency


def live_pictures(robots, seconds):
    """Milliseconds from the time of a POSE (sent at once) to the frame that shows it, the pictures drawn in a second, and the share
    of a core that the page's own thread takes."""
    daemon = FakeDaemon(neighbors=robots - 1)
    viewer = Viewer("--port", daemon.port)
    browser = Browser()
    page = browser.page(viewer.url)
    page.wait(f"globalThis.crepes && crepes.scene.robots.length === {robots - 1}")
    time.sleep(1)
    offset = time.time() - time.monotonic()  # the daemon's stamps are monotonic, the page's time is that of the wall
    page.call("Performance.enable")
    start, busy = time.monotonic(), page.busy_s()
    latencies, rate = page.value(f"""new Promise((done) => {{ const late = []; let last, drawn = 0; const {{ scene }} = crepes; const draw = scene.draw;
        scene.draw = function (t) {{ ++drawn; return draw.call(this, t); }}; const start = performance.now();
        const look = () => {{ const {{ newest }} = crepes.store;
          if (newest.t !== last) {{ last = newest.t; late.push(performance.timeOrigin + performance.now() - 1000 * ({offset!r} + last)); }}
          const took = performance.now() - start; took < {1000 * seconds} ? requestAnimationFrame(look) : done([late, 1000 * drawn / took]); }}; look(); }})""")
    share = (page.busy_s() - busy) / (time.monotonic() - start)
    browser.close()
    viewer.stop()
    daemon.stop()
    latencies.sort()
    return latencies[len(latencies) // 2], latencies[len(latencies) * 95 // 100], rate, share


if __name__ == "__main__":
    duration = float(sys.argv[1]) if len(sys.argv) > 1 else 10
    runs = int(sys.argv[2]) if len(sys.argv) > 2 else 3
    print("page: {} bytes, {} compressed".format(*size_of_the_page()))
    for robots, pages in ((2, 1), (2, 10), (5, 0), (5, 1), (5, 10), (20, 1), (20, 10)):
        (share, rate), (least, most) = medians(runs, cost, robots, pages, duration)
        print(f"{robots} robots, {pages} pages: {100 * share:.1f} % of a core ({100 * least:.1f} to {100 * most:.1f}), {rate / 1000:.1f} kB/s to each page")
    for pages in (1, 10):
        (share, rate, pictures), _ = medians(runs, cost_of_pictures, pages, duration)
        print(f"5 robots, {pages} pages with the camera: {100 * share:.1f} % of a core, {rate / 1000:.1f} kB/s to each page, {pictures:.1f} pictures a second")
    for share, median, worst, pictures in cost_to_the_daemon(duration):
        print(f"daemon with {pictures:.1f} looks a second: {100 * share:.1f} % of a core; a picture's delay to its spots {median} us median, {worst} us 99 %")
    try:
        times, period = first_picture()
        for robots in (2, 5, 20):
            (middle, late, pictures, share), (least, most) = medians(runs, live_pictures, robots, duration)
            print(f"{robots} robots: POSE to picture {middle:.0f} ms median ({least:.0f} to {most:.0f}), {late:.0f} ms 95 %; {pictures:.1f} pictures a second; "
                  f"{100 * share:.0f} % of a core in the page")
        print(f"first robot in the scene after {', '.join(f'{t:.2f}' for t in times)} s; frames every {1000 * period:.0f} ms")
    except CannotStart as why:
        print(why)
