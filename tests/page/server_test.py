#!/usr/bin/python3
"""Hostile and honest requests to crepesctl view. No browser."""
import gzip
import json
import os
import pathlib
import re
import resource
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.request

from fake_daemon import FakeDaemon
from viewer import RECORDING, SOURCE, TOOL, Viewer, replayed, wait


def raw(viewer, text, patience_s=10):
    """What comes back for these bytes until the server closes, or falls silent for so long."""
    with socket.create_connection((viewer.host.strip("[]"), viewer.port), 10) as connection:
        connection.settimeout(patience_s)
        received = b""
        try:
            connection.sendall(text if isinstance(text, bytes) else text.encode())
            while chunk := connection.recv(65536):
                received += chunk
        except (ConnectionError, socket.timeout):
            pass
        return received.decode(errors="replace")


def status_of(reply):
    match = re.match(r"HTTP/1\.[01] (\d+)", reply)
    return int(match.group(1)) if match else None


def get(viewer, path, headers=""):
    return raw(viewer, f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{viewer.port}\r\nConnection: close\r\n{headers}\r\n")


class Server(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = FakeDaemon()
        cls.viewer = Viewer("--port", cls.daemon.port)

    @classmethod
    def tearDownClass(cls):
        code = cls.viewer.stop()
        cls.daemon.stop()
        assert code == 0, f"the server ended with {code}"

    def tearDown(self):
        self.assertEqual(status_of(get(self.viewer, "/robots")), 200, "the server does not serve any more")

    def stream(self):
        connection = socket.create_connection(("127.0.0.1", self.viewer.port), 10)
        connection.settimeout(20)
        connection.sendall(f"GET /events?robot=0 HTTP/1.1\r\nHost: 127.0.0.1:{self.viewer.port}\r\n\r\n".encode())
        return connection

    def test_every_reply_forbids_foreign_content(self):
        for path in ("/", "/main.js", "/robots", "/nothing"):
            head = get(self.viewer, path).partition("\r\n\r\n")[0].lower()
            for header in ("content-security-policy: default-src 'none'; script-src 'self'", "x-content-type-options: nosniff",
                           "x-frame-options: deny", "referrer-policy: no-referrer", "cross-origin-resource-policy: same-origin"):
                self.assertIn(header, head, path)
            self.assertNotIn("access-control-allow", head)

    def test_paths_lead_to_the_files_of_the_page_only(self):
        for path in ("/../../etc/passwd", "/..%2f..%2fetc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd", "/etc/passwd", "/page/main.js",
                     "/./../main.cpp", "/\\..\\..", "/events?robot=../../etc", "/replay?robot=0", "/main.js%00.html"):
            reply = get(self.viewer, path)
            self.assertNotIn(status_of(reply), (200, 500), path)
            self.assertNotIn("root:", reply, path)

    def test_the_whole_page_is_small(self):
        names = [file.name for file in (SOURCE / "daemon/ctl/view/page").iterdir() if file.suffix != ".md"]
        self.assertIn("main.js", names)
        texts = [self.viewer.get(name).encode() for name in names]
        compressed = sum(len(gzip.compress(text)) for text in texts)
        # A megabyte was asked for. What ARCHITECTURE.md says of it holds.
        self.assertLess(compressed, 50_000)
        said = int(re.search(r"plain files of about (\d+) kB", (SOURCE / "ARCHITECTURE.md").read_text()).group(1))
        self.assertAlmostEqual(sum(map(len, texts)) / 1000, said, delta=5)

    def test_wrong_robots_are_not_found(self):
        for query in ("", "?robot=", "?robot=1", "?robot=-1", "?robot=99999999999999999999", "?robot=0x0", "?robot=0.0", "?x=0", "?robot=nan"):
            self.assertEqual(status_of(get(self.viewer, f"/events{query}")), 404, query)

    def test_only_get_is_answered(self):
        for method in ("POST", "PUT", "DELETE", "OPTIONS", "HEAD", "PATCH"):
            reply = raw(self.viewer, f"{method} / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 3\r\nConnection: close\r\n\r\nabc", 3)
            self.assertIn(status_of(reply), (405, 403, 404, 400, None), method)
            self.assertNotIn("<!DOCTYPE", reply)

    def test_actions_are_refused_but_from_the_page_itself(self):
        def post(headers, body=""):
            return raw(self.viewer, f"POST /light?robot=0&camera=0&exposure_us=9 HTTP/1.1\r\nHost: 127.0.0.1:{self.viewer.port}\r\n"
                                    f"Connection: close\r\n{headers}\r\n{body}", 3)
        own = f"Origin: http://127.0.0.1:{self.viewer.port}\r\n"
        self.assertEqual(status_of(get(self.viewer, "/light?robot=0&camera=0&exposure_us=9", own)), 405)
        self.assertEqual(status_of(post("Content-Length: 0\r\n")), 403)
        self.assertEqual(status_of(post("Content-Length: 0\r\nOrigin: http://evil.example\r\n")), 403)
        self.assertIn("view.control is false", post(f"Content-Length: 0\r\n{own}"))
        self.assertNotIn("200 OK", post(f"Content-Length: 3\r\n{own}", "abc"))
        for query in ("", "?robot=0", "?robot=0&camera=9", "?robot=7&camera=0", "?camera=0"):
            self.assertEqual(status_of(get(self.viewer, f"/camera{query}")), 404, query)

    def test_a_rebound_name_and_a_foreign_page_get_nothing(self):
        reply = raw(self.viewer, "GET /robots HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n")
        self.assertEqual(status_of(reply), 421)
        self.assertNotIn("release", reply)
        reply = get(self.viewer, "/robots", "Origin: http://evil.example\r\n")
        self.assertEqual(status_of(reply), 403)
        reply = raw(self.viewer, "GET /robots HTTP/1.0\r\n\r\n")
        self.assertNotEqual(status_of(reply), 200)

    def test_oversized_requests_are_refused(self):
        for text in (f"GET /{'a' * 100_000} HTTP/1.1\r\n\r\n", f"GET / HTTP/1.1\r\nHost: {'a' * 100_000}\r\n\r\n",
                     "GET / HTTP/1.1\r\n" + "X: y\r\n" * 20_000 + "\r\n", "G" * 1_000_000):
            self.assertNotEqual(status_of(raw(self.viewer, text, 3)), 200)

    def test_noise_is_survived(self):
        for seed in range(40):
            noise = bytes((seed * 7919 + i * i * 31 + i * 17) % 256 for i in range(64 + 40 * seed))
            raw(self.viewer, noise + b"\r\n\r\n", 0.05)
            raw(self.viewer, b"GET /events?robot=0 HTTP/1.1\r\nHost: 127.0.0.1\r\n" + noise, 0.02)

    def test_slow_requests_do_not_keep_others_waiting(self):
        slow = [socket.create_connection(("127.0.0.1", self.viewer.port), 10) for _ in range(100)]
        try:
            for i in range(4):
                for connection in slow:
                    try:
                        connection.sendall(b"GET / HTTP/1.1\r\nX-Slow: "[i:i + 1])
                    except OSError:
                        pass  # closed, as it should be in the end
                self.assertEqual(status_of(get(self.viewer, "/")), 200)
                time.sleep(0.1)
            # Nothing more comes: each is closed within the time of a request.
            for connection in slow:
                connection.settimeout(30)
                try:
                    self.assertEqual(connection.recv(1), b"")
                except ConnectionError:
                    pass
        finally:
            for connection in slow:
                connection.close()

    def test_a_thousand_connections_leave_an_open_page_alone(self):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = 1200
        if hard != resource.RLIM_INFINITY and hard < wanted:
            self.skipTest("too few file descriptors allowed here")
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, wanted), hard))
        flood = []
        try:
            with self.stream() as page:
                self.assertIn(b"200", page.recv(64))
                for _ in range(1000):
                    try:
                        flood.append(socket.create_connection(("127.0.0.1", self.viewer.port), 2))
                    except OSError:
                        pass  # refused, or not accepted yet
                received = b""
                while received.count(b"event: frame") < 20:
                    received += page.recv(65536)
                self.assertEqual(status_of(get(self.viewer, "/robots")), 200, "nobody else is served during the flood")
                held = len(os.listdir(f"/proc/{self.viewer.process.pid}/fd"))
                self.assertLess(held, 90)
        finally:
            for connection in flood:
                connection.close()
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        wait(lambda: status_of(get(self.viewer, "/robots")) == 200, "service after the flood")

    def test_a_burst_that_asks_and_stays_is_forgotten(self):
        burst = []
        try:
            for _ in range(200):
                try:
                    connection = socket.create_connection(("127.0.0.1", self.viewer.port), 2)
                    connection.sendall(f"GET /robots HTTP/1.1\r\nHost: 127.0.0.1:{self.viewer.port}\r\n\r\n".encode())
                    burst.append(connection)
                except OSError:
                    pass
            time.sleep(6)  # longer than the server waits for a request
            for _ in range(5):
                self.assertEqual(status_of(get(self.viewer, "/robots")), 200)
        finally:
            for connection in burst:
                connection.close()

    @unittest.skipIf("CREPES_SANITIZED" in os.environ, "a sanitizer keeps memory that was freed")
    def test_a_reader_that_does_not_read_costs_no_memory(self):
        def memory_kb():
            with open(f"/proc/{self.viewer.process.pid}/status") as status:
                return int(re.search(r"VmRSS:\s+(\d+)", status.read()).group(1))
        with self.stream() as lazy, self.stream() as page:
            lazy.recv(16)
            before, received = memory_kb(), b""
            while received.count(b"event: frame") < 50:
                received += page.recv(65536)
            self.assertLess(memory_kb() - before, 4000)

    def test_nobody_looks_and_nothing_is_asked(self):
        with self.stream() as page:
            received = b""
            while b"event: frame" not in received:
                received += page.recv(65536)
        wait(lambda: not self.daemon.watchers, "the end of the subscription")


class Token(unittest.TestCase):
    def test_beyond_loopback_data_need_the_token_of_the_printed_address(self):
        viewer = Viewer("--port", 1, listen="0.0.0.0:0")
        try:
            self.assertRegex(viewer.fragment, "^token=[0-9a-f]{32}$")
            token = viewer.fragment.removeprefix("token=")
            viewer.host = "127.0.0.1"
            self.assertEqual(status_of(get(viewer, "/")), 200)
            self.assertEqual(status_of(get(viewer, "/robots")), 401)
            self.assertEqual(status_of(get(viewer, "/robots", f"Authorization: Bearer {token[:-1]}\r\n")), 401)
            self.assertEqual(status_of(get(viewer, f"/robots?token={token}")), 401)
            self.assertEqual(status_of(get(viewer, "/robots", f"Authorization: Bearer {token}\r\n")), 200)
        finally:
            viewer.stop()

    def test_a_token_file_holds_the_token(self):
        with tempfile.NamedTemporaryFile("w", suffix=".token") as file:
            file.write("a-token-of-the-robot\n")
            file.flush()
            viewer = Viewer("--port", 1, "--token-file", file.name)
            try:
                self.assertEqual(viewer.fragment, "token=a-token-of-the-robot")
                self.assertEqual(status_of(get(viewer, "/robots")), 401)
            finally:
                viewer.stop()


class Start(unittest.TestCase):
    def refusal(self, *arguments):
        done = subprocess.run([TOOL, "view", *arguments], capture_output=True, text=True, timeout=60)
        self.assertNotEqual(done.returncode, 0)
        self.assertEqual(done.stdout, "")
        return done.stderr

    def test_wrong_starts_say_what_is_wrong(self):
        self.assertIn("--listen", self.refusal("--listen", "localhost"))
        self.assertIn("--also", self.refusal("--listen", "127.0.0.1:0", "--also", "somewhere"))
        self.assertIn("REPLAY_DIR", self.refusal("--listen", "127.0.0.1:0", "--truth", "/tmp"))
        self.assertIn("no <observer>", self.refusal("/nonexistent", "--listen", "127.0.0.1:0"))
        with tempfile.NamedTemporaryFile("w") as file:
            file.write("short")
            file.flush()
            self.assertIn("16 characters", self.refusal("--listen", "127.0.0.1:0", "--token-file", file.name))

    def test_messages_do_not_repeat_their_prefix(self):
        for command in (["view", "/nonexistent"], ["view", "--listen", "localhost"], ["replay", "/nonexistent", "--out", "/tmp/never"],
                        ["evaluate", "/nonexistent"], ["convert", "/nonexistent", "--to", "mcap"], ["plot", "/nonexistent"], ["spots", "/nonexistent"],
                        ["calibrate", "imu", "/nonexistent", "--out", "/tmp/never"], ["status", "--port", "1"]):
            done = subprocess.run([TOOL, *command], capture_output=True, text=True, timeout=60)
            self.assertNotEqual(done.returncode, 0, command)
            for line in done.stderr.splitlines():
                parts = [part.strip() for part in line.split(": ")]
                self.assertEqual(len(parts), len(set(parts)), line)
                self.assertLessEqual(line.count("/nonexistent"), 1, line)

    def test_open_starts_the_desktops_browser_with_the_address(self):
        with tempfile.TemporaryDirectory() as folder:
            browser, told = pathlib.Path(folder, "xdg-open"), pathlib.Path(folder, "told")
            browser.write_text(f'#!/bin/sh\necho "$1" > {told}.part && mv {told}.part {told}\n')
            browser.chmod(0o755)
            viewer = Viewer("--port", 1, "--open", PATH=f"{folder}:{os.environ['PATH']}")
            try:
                wait(told.exists, "the browser")
                self.assertEqual(told.read_text().strip(), viewer.url)
            finally:
                viewer.stop()

    def test_the_demo_has_a_page_until_it_is_interrupted(self):
        with tempfile.NamedTemporaryFile("w+") as log:
            demo = subprocess.Popen([TOOL, "demo", "--scenario", "two", "--view", "--listen", "127.0.0.1:0", "--port", "47591"], stdout=log, stderr=log)
            try:
                said = pathlib.Path(log.name)
                wait(lambda: demo.poll() is not None or "page: " in said.read_text(), "the address of the page")
                url = re.search(r"page: (http\S+)", said.read_text()).group(1)
                wait(lambda: re.search(r"world time [\d.]+ s\n", said.read_text()), "a demo of no end")
                with urllib.request.urlopen(f"{url}robots", timeout=30) as reply:
                    self.assertEqual(len(json.load(reply)["robots"]), 2)
            finally:
                demo.terminate()
                demo.wait(30)

    def test_an_address_in_use_is_an_error(self):
        viewer = Viewer("--port", 1)
        try:
            self.assertIn("in use", self.refusal("--listen", f"127.0.0.1:{viewer.port}"))
        finally:
            viewer.stop()

    def test_a_replay_is_served_with_its_truth(self):
        with tempfile.TemporaryDirectory() as out:
            viewer = Viewer(replayed(out), "--truth", RECORDING)
            try:
                self.assertEqual([robot["name"] for robot in json.loads(viewer.get("robots"))["robots"]], ["r1", "r2"])
                replay = json.loads(viewer.get("replay?robot=1"))
                self.assertTrue(replay["has_truth"])
                self.assertEqual(replay["neighbors"][0]["name"], "r1")
                self.assertGreater(len(replay["neighbors"][0]["rows"]), 400)
                self.assertGreater(len(replay["neighbors"][0]["truth"]), 300)
                self.assertEqual(status_of(get(viewer, "/events?robot=0")), 404)
            finally:
                viewer.stop()


if __name__ == "__main__":
    unittest.main(verbosity=2)
