#!/usr/bin/python3
"""Reads back what `crepesctl convert --to mcap` writes, with a reader of its own: twice, from the beginning to the end and by the
index, and against the recording's rows.
    mcap_files.py SOURCE crepesctl"""
import csv
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

SOURCE, TOOL = pathlib.Path(sys.argv[1]), sys.argv[2]
RECORDING = SOURCE / "config/examples/recordings/two-robots"
MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
STATISTICS, SUMMARY_OFFSET, DATA_END = 0x0B, 0x0E, 0x0F


class Fields:
    """The content of a record, front to back."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        assert self.at + count <= len(self.data), "a record ends too early"
        self.at += count
        return self.data[self.at - count:self.at]

    def number(self, form):
        return struct.unpack("<" + form, self.take(struct.calcsize("<" + form)))[0]

    def block(self, form="I"):
        return self.take(self.number(form))

    def text(self):
        return self.block().decode()

    def rest(self):
        return self.take(len(self.data) - self.at)

    def pairs(self, first, second):
        inner = Fields(self.block())
        found = []
        while inner.at < len(inner.data):
            found.append((inner.number(first), inner.number(second)))
        return found


def records(data, at, end):
    """(opcode, place, content) of each record."""
    while at < end:
        opcode, length = struct.unpack_from("<BQ", data, at)
        assert at + 9 + length <= end, "a record is longer than what holds it"
        yield opcode, at, data[at + 9:at + 9 + length]
        at += 9 + length
    assert at == end


class Mcap:
    def __init__(self, file):
        self.data = pathlib.Path(file).read_bytes()
        assert self.data.startswith(MAGIC) and self.data.endswith(MAGIC)
        self.schemas, self.channels, self.messages = {}, {}, []
        self.read_all()
        self.indexed = self.read_by_index()

    def add_kind(self, opcode, content):
        fields = Fields(content)
        if opcode == SCHEMA:
            number, name, encoding, schema = fields.number("H"), fields.text(), fields.text(), fields.block()
            assert number > 0 and encoding == "jsonschema"
            self.schemas[number] = (name, json.loads(schema))
        elif opcode == CHANNEL:
            number, schema, topic, encoding = fields.number("H"), fields.number("H"), fields.text(), fields.text()
            assert encoding == "json" and schema in self.schemas
            self.channels[number] = (topic, schema)

    @staticmethod
    def message(content):
        fields = Fields(content)
        channel, sequence, logged, published = (fields.number(form) for form in "HIQQ")
        assert logged == published
        return channel, sequence, logged, fields.rest()

    def chunk(self, content):
        """Span and bytes, whose checksum fits."""
        fields = Fields(content)
        start, end, size, crc, compression, data = fields.number("Q"), fields.number("Q"), fields.number("Q"), fields.number("I"), fields.text(), fields.block("Q")
        assert compression == "" and size == len(data) and crc == zlib.crc32(data)
        return start, end, data

    def read_all(self):
        """As a reader that knows no index; every record in turn."""
        opcodes = []
        for opcode, at, content in records(self.data, len(MAGIC), len(self.data) - len(MAGIC)):
            opcodes.append(opcode)
            if opcode == CHUNK:
                start, end, data = self.chunk(content)
                times = []
                for inner, _, part in records(data, 0, len(data)):
                    if inner == MESSAGE:
                        self.messages.append(self.message(part))
                        assert self.messages[-1][0] in self.channels, "a message before its channel"
                        times.append(self.messages[-1][2])
                    else:
                        self.add_kind(inner, part)
                assert not times or (start, end) == (min(times), max(times))
            elif opcode == DATA_END:
                assert Fields(content).number("I") == zlib.crc32(self.data[:at])
                break
        assert opcodes[0] == HEADER and set(opcodes[1:-1]) <= {CHUNK, MESSAGE_INDEX}

    def read_by_index(self):
        """As a reader that seeks: footer, summary, chunk index, message index."""
        footer = len(self.data) - len(MAGIC) - 29
        [(opcode, _, content)] = records(self.data, footer, len(self.data) - len(MAGIC))
        assert opcode == FOOTER
        fields = Fields(content)
        start, offsets, crc = fields.number("Q"), fields.number("Q"), fields.number("I")
        assert crc == zlib.crc32(self.data[start:footer + 9 + 16])
        groups = {}
        for opcode, _, content in records(self.data, offsets, footer):
            assert opcode == SUMMARY_OFFSET
            fields = Fields(content)
            group, at, length = fields.number("B"), fields.number("Q"), fields.number("Q")
            groups[group] = (at, length)
        assert sum(length for _, length in groups.values()) == offsets - start
        found = []
        for opcode, (at, length) in groups.items():
            for inner, _, content in records(self.data, at, at + length):
                assert inner == opcode
                if inner == CHUNK_INDEX:
                    found += self.messages_at(Fields(content))
                elif inner == STATISTICS:
                    self.statistics(Fields(content))
        return found

    def messages_at(self, fields):
        start, end, at, length = (fields.number("Q") for _ in range(4))
        offsets, index_length, compression = fields.pairs("H", "Q"), fields.number("Q"), fields.text()
        [(opcode, _, content)] = records(self.data, at, at + length)
        assert opcode == CHUNK and compression == ""
        chunk_start, chunk_end, data = self.chunk(content)
        assert (chunk_start, chunk_end) == (start, end)
        assert fields.number("Q") == fields.number("Q") == len(data)
        found = []
        for channel, place in offsets:
            assert at + length <= place < at + length + index_length
            opcode, _, content = next(records(self.data, place, at + length + index_length))
            index = Fields(content)
            assert opcode == MESSAGE_INDEX and index.number("H") == channel
            for time, offset in index.pairs("Q", "Q"):
                opcode, _, content = next(records(data, offset, len(data)))
                found.append(self.message(content))
                assert opcode == MESSAGE and found[-1][0] == channel and found[-1][2] == time
        return found

    def statistics(self, fields):
        count, schemas, channels = fields.number("Q"), fields.number("H"), fields.number("I")
        assert (count, schemas, channels) == (len(self.messages), len(self.schemas), len(self.channels))
        for _ in range(3):
            fields.number("I")  # attachments, metadata, chunks
        assert (fields.number("Q"), fields.number("Q")) == (min(m[2] for m in self.messages), max(m[2] for m in self.messages))
        counts = dict(fields.pairs("H", "Q"))
        assert counts == {number: sum(m[0] == number for m in self.messages) for number in self.channels}

    def topics(self):
        return {topic: self.schemas[schema][0] for topic, schema in self.channels.values()}

    def of(self, topic):
        """(time in ns, message) of a topic."""
        return [(time, json.loads(data)) for channel, _, time, data in self.messages if self.channels[channel][0] == topic]


def fits(value, schema):
    """Whether a value is what its JSON Schema says, and says nothing else."""
    kind = schema["type"]
    if kind == "object":
        return isinstance(value, dict) and all(key in schema["properties"] and fits(part, schema["properties"][key]) for key, part in value.items())
    if kind == "array":
        return isinstance(value, list) and all(fits(part, schema["items"]) for part in value)
    if kind == "string":
        return isinstance(value, str)
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    return is_number and (kind == "number" or isinstance(value, int))


def rows(file):
    with open(file) as lines:
        return [row for row in csv.reader(lines) if not row[0].startswith(("#", "t_ns"))]


def run(*words):
    return subprocess.run([TOOL, *map(str, words)], capture_output=True, text=True)


def rotate(q, v):
    """By the Hamilton quaternion."""
    u, w = (q["x"], q["y"], q["z"]), q["w"]
    cross = lambda a, b: (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    t = [2 * c for c in cross(u, v)]
    return [v[i] + w * t[i] + cross(u, t)[i] for i in range(3)]


class Convert(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = tempfile.TemporaryDirectory()
        place = pathlib.Path(cls.directory.name)
        cls.results = place / "results"
        for words in (("replay", RECORDING, "--out", cls.results, "--debug-innovations"),
                      ("convert", RECORDING, "--to", "mcap", "--out", place / "swarm.mcap"),
                      ("convert", cls.results, "--to", "mcap", "--truth", RECORDING)):
            done = run(*words)
            assert done.returncode == 0, done.stderr
        cls.swarm, cls.replay = Mcap(place / "swarm.mcap"), Mcap(cls.results / "swarm.mcap")

    @classmethod
    def tearDownClass(cls):
        cls.directory.cleanup()

    def assert_same(self, found, expected):
        """Equal lists. assertEqual would take minutes to explain how thousands of entries differ."""
        self.assertEqual(len(found), len(expected))
        for one, other in zip(found, expected):
            self.assertEqual(one, other)

    def test_the_index_finds_what_a_scan_finds(self):
        for file in (self.swarm, self.replay):
            self.assertGreater(len(file.messages), 1000)
            self.assert_same(sorted(file.indexed), sorted(file.messages))

    def test_messages_are_in_order_of_time(self):
        for file in (self.swarm, self.replay):
            times = [time for _, _, time, _ in file.messages]
            self.assert_same(times, sorted(times))
            for channel in file.channels:
                sequence = [number for of, number, _, _ in file.messages if of == channel]
                self.assert_same(sequence, list(range(len(sequence))))

    def test_every_message_is_what_its_schema_says(self):
        for file in (self.swarm, self.replay):
            for channel, _, time, data in file.messages:
                topic, schema = file.channels[channel]
                message = json.loads(data)
                self.assertTrue(fits(message, file.schemas[schema][1]), (topic, message))
                if "timestamp" in message:
                    self.assertEqual(message["timestamp"]["sec"] * 10**9 + message["timestamp"]["nsec"], time, topic)

    def test_a_recording_has_all_its_rows(self):
        self.assertEqual(self.swarm.topics(), {
            "/tf": "foxglove.FrameTransform",
            **{topic: kind for a, b in (("r1", "r2"), ("r2", "r1")) for topic, kind in (
                (f"/{a}/imu", "crepes.Imu"), (f"/{a}/range/{b}", "crepes.Range"), (f"/{a}/cam0/spots", "foxglove.ImageAnnotations"))}})
        imu = rows(RECORDING / "r1/imu0/data.csv")
        written = self.swarm.of("/r1/imu")
        self.assertEqual(len(written), len(imu))
        for (_, message), row in zip(written, imu):
            self.assertEqual([message[key][axis] for key in ("gyro_radps", "accel_mps2") for axis in "xyz"], [float(x) for x in row[1:]])
        self.assert_same([message["range_m"] for _, message in self.swarm.of("/r2/range/r1")], [float(row[2]) for row in rows(RECORDING / "r2/uwb0/data.csv")])
        # Foxglove's origin is the corner of the first pixel, a recording's its center.
        spots = sorted((float(row[1]) + 0.5, float(row[2]) + 0.5) for row in rows(RECORDING / "r1/cam0/spots.csv") if row[1])
        circles = sorted((circle["position"]["x"], circle["position"]["y"]) for _, message in self.swarm.of("/r1/cam0/spots") for circle in message["circles"])
        self.assert_same(circles, spots)

    def test_a_replay_has_all_its_poses_with_their_errors(self):
        poses = rows(self.results / "r1/r2.csv")
        estimates = self.replay.of("/r1/r2/estimate")
        self.assertEqual(len(estimates), len(poses))
        for (_, message), row in zip(estimates, poses):
            self.assertEqual(message["mode"], row[2])
            self.assertEqual([message["position"][axis] for axis in "xyz"], [float(x) for x in row[3:6]])
            self.assertEqual(message["covariance"], [float(x) for x in row[10:]])
        errors = sorted(message["error_m"] for _, message in estimates if "error_m" in message)
        self.assertGreater(len(errors), 0.9 * len(poses))
        self.assertLess(errors[len(errors) // 2], 0.05)
        self.assertGreater(len(self.replay.of("/r1/r2/innovation")), 1000)

    def test_transforms_put_the_estimate_where_the_truth_is(self):
        truth, worst, count = {}, 0.0, 0
        for time, message in self.replay.of("/tf"):
            child, p = message["child_frame_id"], message["translation"]
            if message["parent_frame_id"] == "world":
                truth[child] = (time, p, message["rotation"])
            elif child == "r1/r2" and {"r1", "r2"} <= truth.keys() and time > 5e9:
                self.assertEqual(message["parent_frame_id"], "r1")
                (_, origin, q), (_, goal, _) = truth["r1"], truth["r2"]
                turned = rotate(q, [p[axis] for axis in "xyz"])
                worst = max(worst, math.dist([origin[axis] + turned[i] for i, axis in enumerate("xyz")], [goal[axis] for axis in "xyz"]))
                count += 1
        # The estimate's error and what both move within the 20 ms between two rows of truth.
        self.assertGreater(count, 500)
        self.assertLess(worst, 0.3)

    def test_what_cannot_be_converted_is_refused_with_the_reason(self):
        other = pathlib.Path(self.directory.name) / "other"
        other.mkdir()
        manifest = (pathlib.Path(RECORDING) / "swarm.yaml").read_text()
        (other / "swarm.yaml").write_text(manifest.replace("scenario: manual", "scenario: four"))
        for words, code, reason in (((self.results, "--to", "mcap"), 2, "--truth SWARM_DIR"),
                                    ((self.results, "--to", "mcap", "--truth", other), 1, "the truth (scenario four"),
                                    ((RECORDING, "--to", "mcap", "--truth", RECORDING), 2, "a recording has its own"),
                                    ((self.directory.name, "--to", "mcap"), 1, "neither swarm.yaml"),
                                    ((RECORDING, "--to", "rosbag9"), 2, "--to")):
            done = run("convert", *words)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(reason, done.stderr)
            self.assertEqual(done.stdout, "")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
