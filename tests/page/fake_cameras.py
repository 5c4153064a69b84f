"""The socket of a daemon's pictures, as recorder_stage.hpp says: a thread of this process."""
import contextlib
import json
import pathlib
import random
import socket
import threading

WIDTH, HEIGHT = 320, 256
# The camera looks ahead; its lens is a pinhole. The boards of tests are where FakeDaemon has the robots.
CONFIG = """
robot: {id: 1}
swarm:
  members:
    - {id: 1, name: r1, pattern: "011111111111111111"}
    - {id: 2, name: r2, pattern: "000000000111111111"}
cameras:
  - {name: cam0, camera_model: ds, intrinsics: [0, 0, 320, 320, 320, 256], resolution: [640, 512], exposure_us: 500,
     T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]}
imu: {update_rate: 100.0, accelerometer_noise_density: 0.002, gyroscope_noise_density: 0.0004}
"""


def picture():
    """Dark grey with a saturated square of 10 pixels around the camera's pixel (400, 200), a dim one at (100, 100)."""
    rows = [bytearray([20]) * WIDTH for _ in range(HEIGHT)]
    for (u, v), level in (((200, 100), 255), ((50, 50), 120)):
        for row in rows[v - 5:v + 5]:
            row[u - 5:u + 5] = bytes([level]) * 10
    return b"".join(map(bytes, rows))


def noisy_picture():
    """Dark grey with noise of some levels, in the size of a camera of 1280 x 1024."""
    noise = random.Random(1)
    return bytes(max(0, round(noise.gauss(14, 2))) for _ in range(4 * WIDTH * HEIGHT))


class FakeCameras:
    def __init__(self, path, daemon, config=CONFIG, noise=False):
        self.path, self.daemon, self.config = str(path), daemon, config
        self.pixels, self.size = (noisy_picture(), (2 * WIDTH, 2 * HEIGHT)) if noise else (picture(), (WIDTH, HEIGHT))
        self.asked = 0
        self.is_over = False
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(self.path)
        self.listener.listen(4)
        self.listener.settimeout(0.1)
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def stop(self):
        self.is_over = True
        self.thread.join()
        self.listener.close()
        pathlib.Path(self.path).unlink(missing_ok=True)

    def run(self):
        while not self.is_over:
            try:
                client, _ = self.listener.accept()
            except TimeoutError:
                continue
            with client, contextlib.suppress(ConnectionError):
                self.serve(client)

    def serve(self, client):
        client.settimeout(0.1)
        self.send(client, "config", self.config.encode())
        reported = self.config
        while not self.is_over:
            try:
                request = client.recv(100)
            except TimeoutError:
                continue
            if not request:
                return
            if reported != self.config:
                reported = self.config
                self.send(client, "config", reported.encode())
            self.asked += 1
            self.send(client, "look", self.look())

    def look(self):
        head = {"camera": 0, "t_ns": str(self.daemon.newest_ns), "width": self.size[0], "height": self.size[1], "scale": 2, "background": 20, "threshold": 60,
                "saturated": 0.0012, "hot_pixels": 1, "hot": [[600, 30]], "spots": [[400, 200, 400, 255], [100, 100, 400, 120]],
                "robots": [[2, 1.0, -0.25, 0.175]]}
        return json.dumps(head).encode() + b"\n" + self.pixels

    @staticmethod
    def send(client, kind, content):
        client.sendall(f"{kind} {len(content)}\n".encode() + content)
