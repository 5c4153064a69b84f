"""The Python client library, without a daemon: its values and its conversation by themselves, then over
loopback with a stand-in that answers as the protocol says. Run by ctest as `python3 -m unittest`."""
import asyncio
import json
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import unittest

PYTHON = pathlib.Path(__file__).resolve().parents[2] / "config" / "examples" / "clients" / "python"
sys.path.insert(0, str(PYTHON))
import crepes_client  # noqa: E402
from crepes_client.conversation import Conversation  # noqa: E402
from crepes_client.messages import Cookie, parse  # noqa: E402

POSE = {
    "class": "POSE", "seq": 7, "timestamp": 12.5, "t_ns": "12500000001", "t_pub_ns": "12510000001", "self": 1,
    "peer": 2, "name": "r2", "mode": "direct", "position": {"x": 1.0, "y": -2.0, "z": 0.5},
    "orientation": {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0}, "velocity": {"x": 0.1, "y": 0.2, "z": 0.3},
    "covariance": list(range(21)), "age_s": 0.01, "reset_counter": 3, "sources": ["bearing", "imu"]}
STATUS = {
    "class": "STATUS", "self": 1, "name": "r1", "uptime_s": 9.0, "queues": {"events": 2},
    "sensors": [{"name": "uwb", "rate_hz": 49.9, "ok": False, "message": "silent", "faults": {"dropped": 4}}],
    "neighbors": [{"peer": 2, "name": "r2", "state": "none", "reason": "no range"}, {"peer": 3, "state": "direct"}],
    "clocks": [{"peer": 2, "offset_s": -3.5}], "truncated": True, "more": [4, 5]}
VERSION = {"class": "VERSION", "release": "9.8.7", "proto_major": 1, "proto_minor": 0, "lease_s": 10.0}


def bytes_of(content):
    return json.dumps(content).encode()


def without(content, key):
    return {name: value for name, value in content.items() if name != key}


class Values(unittest.TestCase):
    def test_of_a_pose_are_typed_and_its_time_is_exact(self):
        pose = parse(bytes_of(POSE))

        self.assertEqual((pose.t_ns, pose.t_pub_ns, pose.timestamp), (12_500_000_001, 12_510_000_001, 12.500000001))
        self.assertEqual((pose.self_id, pose.peer, pose.name, pose.mode), (1, 2, "r2", "direct"))
        self.assertEqual(pose.position, crepes_client.Vector(1.0, -2.0, 0.5))
        self.assertEqual(pose.orientation, crepes_client.Quaternion(1.0, 0.0, 0.0, 0.0))
        self.assertEqual(pose.velocity.z, 0.3)
        self.assertEqual((pose.seq, pose.age_s, pose.reset_counter, pose.sources), (7, 0.01, 3, ("bearing", "imu")))

    def test_of_a_covariance_stand_symmetrically_row_by_row(self):
        matrix = parse(bytes_of(POSE)).covariance_matrix()

        self.assertEqual(matrix[0], [0, 1, 2, 3, 4, 5])
        self.assertEqual(matrix[1], [1, 6, 7, 8, 9, 10])
        self.assertEqual(matrix[5], [5, 10, 14, 17, 19, 20])

    def test_that_are_unknown_are_none(self):
        for key in ("velocity", "covariance", "age_s"):
            self.assertIsNone(getattr(parse(bytes_of(without(POSE, key))), key))
        self.assertIsNone(parse(bytes_of(without(POSE, "covariance"))).covariance_matrix())

    def test_of_a_status_name_sensors_neighbors_and_clocks(self):
        status = parse(bytes_of(STATUS))

        self.assertEqual((status.sensors[0].name, status.sensors[0].ok), ("uwb", False))
        self.assertEqual(status.sensors[0].faults, {"dropped": 4})
        self.assertEqual((status.neighbors[0].state, status.neighbors[0].reason), ("none", "no range"))
        self.assertEqual(status.clocks[0].offset_s, -3.5)
        self.assertEqual((status.truncated, status.more, status.raw["queues"]), (True, (4, 5), {"events": 2}))

    def test_are_read_from_messages_with_keys_of_a_later_release(self):
        self.assertEqual(parse(bytes_of({**POSE, "new": [1]})), parse(bytes_of(POSE)))

    def test_are_none_of_what_is_no_message(self):
        wrong = [b"", b"\xff", b"[]", b"7", b"null", b'{"class":"NEW"}', b'{"class":["POSE"]}', b'{"class":"ERROR"}',
                 bytes_of(without(POSE, "position")), bytes_of({**POSE, "t_ns": "now"}),
                 bytes_of({**POSE, "covariance": [1.0]}), bytes_of({**POSE, "orientation": 5}),
                 bytes_of({**STATUS, "neighbors": [{}]})]
        for datagram in wrong:
            self.assertIsNone(parse(datagram), datagram)


class TheConversation(unittest.TestCase):
    def classes_due(self, conversation, now):
        return [json.loads(datagram)["class"] for datagram in conversation.due(now)]

    def test_renews_its_lease_every_second_though_nothing_is_heard(self):
        conversation = Conversation(0.0)

        due = [now / 10 for now in range(0, 310) if self.classes_due(conversation, now / 10)]

        self.assertEqual(len(due), 31)
        self.assertLessEqual(max(b - a for a, b in zip(due, due[1:])), 1.05)

    def test_renews_a_short_lease_in_time(self):
        conversation = Conversation(0.0)
        conversation.due(0.0)
        conversation.take(bytes_of({**VERSION, "lease_s": 1.0}), 0.01)

        self.assertLessEqual(conversation.wait_s(0.01), 0.25)
        self.assertEqual(conversation.version.lease_s, 1.0)

    def test_begins_with_a_request_no_shorter_than_a_cookie_and_echoes_the_cookie_at_once(self):
        conversation = Conversation(0.0, poll_s=5.0)
        first = conversation.due(0.0)
        self.assertTrue(all(len(datagram) >= 64 for datagram in first))
        cookie = bytes_of({"class": "COOKIE", "cookie": "0123"})

        self.assertIsNone(conversation.take(cookie, 0.1))

        echoed = [json.loads(datagram) for datagram in conversation.due(0.1)]
        self.assertEqual([(request["class"], request["cookie"]) for request in echoed],
                         [("WATCH", "0123"), ("POLL", "0123")])

    def test_is_no_ping_pong_of_one_cookie(self):
        conversation = Conversation(0.0)
        cookie = bytes_of({"class": "COOKIE", "cookie": "0123"})
        sent = 0
        for step in range(100):  # a daemon to which our address looks different each time
            sent += len(conversation.due(step / 1000))
            conversation.take(cookie, step / 1000)

        self.assertEqual(sent, 2)

    def test_ends_with_a_request_that_ends_the_subscription(self):
        self.assertEqual([json.loads(datagram)["enable"] for datagram in Conversation(0.0).farewell()], [False])
        self.assertEqual(Conversation(0.0, watch=False, poll_s=1.0).farewell(), [])

    def test_asks_for_the_rate_and_peers_that_are_wanted(self):
        request = json.loads(Conversation(0.0, rate_hz=20, peers=[3, 4]).due(0.0)[0])

        self.assertEqual((request["enable"], request["rate_hz"], request["peers"]), (True, 20, [3, 4]))

    def test_reads_a_cookie_as_what_it_is(self):
        self.assertEqual(parse(bytes_of({"class": "COOKIE", "cookie": "a"})), Cookie("a"))


class StandIn:
    """A daemon that wants a cookie and answers each WATCH with `answers`; `requests` is what it got."""

    def __init__(self, *answers, cookie="42", port=0):
        self.answers, self.cookie, self.requests = answers, cookie, []
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        self.port = self.socket.getsockname()[1]
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self.serve, daemon=True)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stop:
            stop.sendto(b"{}", ("127.0.0.1", self.port))
        self.thread.join()
        self.socket.close()

    def serve(self):
        while (request := json.loads((got := self.socket.recvfrom(2048))[0])):
            self.requests.append(request)
            if request.get("enable") is False:
                self.ended.set()
            elif self.cookie and request.get("cookie") != self.cookie:
                self.socket.sendto(bytes_of({"class": "COOKIE", "cookie": self.cookie}), got[1])
            elif request["class"] == "POLL":
                self.socket.sendto(bytes_of(STATUS), got[1])
            else:
                for answer in self.answers:
                    self.socket.sendto(bytes_of(answer), got[1])


class OverLoopback(unittest.TestCase):
    def test_poses_come_typed_and_their_end_ends_the_subscription(self):
        with StandIn(VERSION, POSE, {**POSE, "seq": 8}) as daemon:
            stream = crepes_client.poses(port=daemon.port)
            got = [next(stream).seq, next(stream).seq]
            stream.close()
            self.assertTrue(daemon.ended.wait(10.0))

        self.assertEqual(got, [7, 8])

    def test_poses_and_status_come_on_one_connection(self):
        with StandIn(VERSION, POSE) as daemon, crepes_client.Connection(port=daemon.port, poll_s=10.0) as connection:
            kinds = {type(connection.receive(10.0)) for _ in range(3)}

            self.assertEqual(kinds, {crepes_client.Version, crepes_client.Pose, crepes_client.Status})
            self.assertEqual(connection.version.release, "9.8.7")

    def test_status_is_asked_of_one_neighbor(self):
        with StandIn() as daemon:
            status = crepes_client.status(port=daemon.port, peer=3)

        self.assertEqual(status.self_id, 1)
        self.assertEqual(daemon.requests[-1]["peer"], 3)

    def test_an_error_is_raised_with_its_text(self):
        with StandIn({"class": "ERROR", "message": "32 subscribers are enough"}) as daemon:
            with self.assertRaisesRegex(crepes_client.RefusedError, "32 subscribers"):
                next(crepes_client.poses(port=daemon.port))

    def test_silence_is_a_timeout_that_names_the_daemon(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as mute:
            mute.bind(("127.0.0.1", 0))
            port = mute.getsockname()[1]
            with self.assertRaisesRegex(TimeoutError, f"127.0.0.1 port {port}"):
                next(crepes_client.poses(port=port, patience_s=0.05))
            with self.assertRaises(TimeoutError):
                crepes_client.status(port=port, patience_s=0.05)

    def test_a_daemon_that_starts_later_is_found(self):
        with StandIn() as gone:
            port = gone.port  # free again below
        with crepes_client.Connection(port=port) as connection:
            self.assertIsNone(connection.receive(0.01))
            with StandIn(VERSION, POSE, port=port):
                self.assertIsInstance(connection.receive(10.0), crepes_client.Version)

    def test_the_same_with_asyncio(self):
        async def first_of(port):
            async for pose in crepes_client.aio.poses(port=port):
                return pose.seq, (await crepes_client.aio.status(port=port)).name

        with StandIn(VERSION, POSE) as daemon:
            self.assertEqual(asyncio.run(first_of(daemon.port)), (7, "r1"))

    def test_faults_with_asyncio_are_the_same(self):
        async def first_of(port, **options):
            async for _ in crepes_client.aio.poses(port=port, **options):
                return

        with StandIn({"class": "ERROR", "message": "no"}) as daemon:
            with self.assertRaises(crepes_client.RefusedError):
                asyncio.run(first_of(daemon.port))
        with self.assertRaises(TimeoutError):
            asyncio.run(first_of(daemon.port, patience_s=0.0))


class TheProgram(unittest.TestCase):
    def run_until_a_pose(self, daemon):
        words = [sys.executable, "-B", "-m", "crepes_client", "--port", str(daemon.port)]
        running = subprocess.Popen(words, env={"PYTHONPATH": str(PYTHON)}, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True,
                                   preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
        self.addCleanup(running.stderr.close)
        self.assertIn("direct", running.stdout.readline())
        return running

    def test_ends_its_subscription_when_it_is_stopped(self):
        for stop in (signal.SIGTERM, signal.SIGINT):
            with StandIn(VERSION, POSE) as daemon, self.run_until_a_pose(daemon) as running:
                running.send_signal(stop)

                self.assertTrue(daemon.ended.wait(10.0))
                self.assertEqual((running.wait(10.0), running.stderr.read()), (0, ""))

    def test_ends_its_subscription_when_nobody_reads_its_poses(self):
        with StandIn(VERSION, POSE) as daemon, self.run_until_a_pose(daemon) as running:
            running.stdout.close()

            self.assertTrue(daemon.ended.wait(10.0))
            self.assertEqual((running.wait(10.0), running.stderr.read()), (0, ""))


class TheExamples(unittest.TestCase):
    def lines_of(self, program, *arguments, enough):
        words = [sys.executable, "-B", PYTHON / "examples" / program, *arguments]
        with subprocess.Popen(words, env={"PYTHONPATH": str(PYTHON)}, stdout=subprocess.PIPE, text=True) as running:
            lines = [running.stdout.readline().strip() for _ in range(enough)]
            running.terminate()
        return lines

    def test_name_the_nearest_neighbor_and_why_there_is_no_pose(self):
        with StandIn(VERSION, POSE) as daemon:
            lines = self.lines_of("nearest.py", "127.0.0.1", str(daemon.port), enough=3)

        self.assertIn("nearest: r2", lines)
        self.assertIn("r2: no pose: no range", lines)

    def test_print_poses_of_two_daemons(self):
        with StandIn(VERSION, POSE) as one, StandIn(VERSION, {**POSE, "self": 9}) as two:
            places = [f"127.0.0.1:{daemon.port}" for daemon in (one, two)]
            lines = self.lines_of("two_robots.py", *places, enough=2)

        self.assertEqual(sorted(lines), ["1 2 direct 1.0 -2.0 0.5", "9 2 direct 1.0 -2.0 0.5"])


class ThePackage(unittest.TestCase):
    def test_installs_with_pip_and_runs_as_a_program(self):
        with tempfile.TemporaryDirectory() as place:
            copy = shutil.copytree(PYTHON, pathlib.Path(place) / "source",
                                   ignore=shutil.ignore_patterns("__pycache__"))  # pip builds in the folder
            installed = pathlib.Path(place) / "installed"
            subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-build-isolation",
                            "--root-user-action=ignore", "--target", installed, copy], check=True)
            with StandIn(VERSION, POSE) as daemon:
                done = subprocess.run([installed / "bin" / "crepes-poses", "--port", str(daemon.port), "--count", "1"],
                                      env={"PYTHONPATH": str(installed)}, capture_output=True, text=True, check=True)

            self.assertEqual(done.stdout, "12500000001 2 direct 1.0 -2.0 0.5\n")
            self.assertTrue((installed / "crepes_client" / "py.typed").exists())

    def test_names_the_argument_that_is_wrong(self):
        for arguments, complaint in ((["--port", "99999"], "--port: 99999 is no port, 1 to 65535"),
                                     (["--count", "-1"], "--count: -1 is not above 0")):
            done = subprocess.run([sys.executable, "-m", "crepes_client", *arguments], env={"PYTHONPATH": str(PYTHON)},
                                  capture_output=True, text=True)

            self.assertEqual(done.returncode, 2)
            self.assertIn(complaint, done.stderr)
            self.assertNotIn("Traceback", done.stderr)

    @unittest.skipUnless(shutil.which("mypy", path="/usr/bin"), "mypy is not installed")
    def test_has_types_that_hold(self):
        with tempfile.TemporaryDirectory() as cache:
            done = subprocess.run(["/usr/bin/mypy", "--strict", "--cache-dir", cache, PYTHON / "crepes_client"],
                                  capture_output=True, text=True)

        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
