#!/usr/bin/env python3
"""Forged requests to a crepesd in a network namespace of its own, and what comes back, counted on the wire.

    unshare -rn python3 forged_requests.py CREPESD CONFIG_EXAMPLES

Exit codes: 0 nothing was amplified and a good client was served, 1 not so, 77 not permitted here.
"""
import json
import pathlib
import random
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

DAEMON, PORT = "10.9.0.1", 47475
ATTACKER_MAC, DAEMON_MAC = bytes.fromhex("020000000002"), bytes.fromhex("020000000001")


def run(*words):
    return subprocess.run(words, capture_output=True, text=True)


def make_network():
    """A cable: the daemon at one end, frames of our making at the other."""
    text = lambda mac: mac.hex(":")  # noqa: E731
    for words in (
        f"ip link add near address {text(DAEMON_MAC)} type veth peer name far address {text(ATTACKER_MAC)}",
        f"ip addr add {DAEMON}/16 dev near", "ip link set lo up", "ip link set near up", "ip link set far up",
    ):
        done = run(*words.split())
        if done.returncode != 0:
            print(f"not permitted here: {words}: {done.stderr.strip()}")
            sys.exit(77)


def checksum(data):
    data += b"\0" * (len(data) % 2)
    total = sum(struct.unpack(f"!{len(data) // 2}H", data))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


def frame(source, source_port, payload, target=DAEMON):
    """An Ethernet frame with an IPv4 datagram; the UDP checksum is left out, as IPv4 permits."""
    udp = struct.pack("!HHHH", source_port, PORT, 8 + len(payload), 0) + payload
    head = struct.pack("!BBHHHBBH4s4s", 0x45, 0, 20 + len(udp), 1, 0, 64, 17, 0,
                       socket.inet_aton(source), socket.inet_aton(target))
    head = head[:10] + struct.pack("!H", checksum(head)) + head[12:]
    return DAEMON_MAC + ATTACKER_MAC + b"\x08\x00" + head + udp


def start_daemon(crepesd, examples, folder):
    """One of four simulated robots, alone."""
    config = pathlib.Path(folder) / "r1.yaml"
    text = (pathlib.Path(examples) / "four-simulated" / "r1.yaml").read_text()
    subscription = f"subscription: {{listen: [127.0.0.1, {DAEMON}], port: {PORT}}}"
    assert f"subscription: {{port: {PORT}}}" in text
    config.write_text(text.replace(f"subscription: {{port: {PORT}}}", subscription))
    return subprocess.Popen([crepesd, "--config", str(config)])


def ask(request, deadline_s=20.0):
    """One answer of the daemon on loopback, or None."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.settimeout(0.3)
        line.connect(("127.0.0.1", PORT))
        end = time.monotonic() + deadline_s
        while time.monotonic() < end:
            try:
                line.send(json.dumps(request).encode())
                return json.loads(line.recv(2048))
            except (TimeoutError, ConnectionRefusedError):
                time.sleep(0.05)
    return None


class Wire:
    """The far end of the cable: bytes of UDP payload there and back, for each address."""

    def __init__(self):
        self.line = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
        self.line.bind(("far", 0))
        self.sent, self.got, self.answers = {}, {}, []

    def send(self, source, source_port, payload):
        self.sent[source] = self.sent.get(source, 0) + len(payload)
        self.line.send(frame(source, source_port, payload))
        self.listen(0.0)

    def listen(self, patience_s):
        end = time.monotonic() + patience_s
        while select.select([self.line], [], [], max(0.0, end - time.monotonic()))[0]:
            data, where = self.line.recvfrom(4096)
            if where[2] != 4:  # PACKET_OUTGOING: our own
                self.take(data)

    def take(self, data):
        kind = data[12:14]
        if kind == b"\x08\x06" and data[20:22] == b"\x00\x01":  # who has ...? we, whoever is meant
            reply = data[6:12] + ATTACKER_MAC + data[12:20] + b"\x00\x02" + ATTACKER_MAC + data[38:42] + data[22:32]
            self.line.send(reply)
        elif kind == b"\x08\x00" and data[23] == 17:
            target, payload = socket.inet_ntoa(data[30:34]), data[42:14 + struct.unpack("!H", data[16:18])[0]]
            self.got[target] = self.got.get(target, 0) + len(payload)
            self.answers.append((target, struct.unpack("!H", data[36:38])[0], payload))


def forged_requests(source):
    watch = json.dumps({"class": "WATCH", "enable": True}).encode()
    poll = json.dumps({"class": "POLL"}).encode()
    padded = json.dumps({"class": "POLL", "pad": "x" * source.randrange(0, 200)}).encode()
    wrong = json.dumps({"class": "WATCH", "cookie": f"{source.getrandbits(64):016x}"}).encode()
    return [watch, poll, padded, wrong, b"[" * 1200, b"?", b"\xff" * 300, b""]


def main():
    crepesd, examples = sys.argv[1:]
    make_network()
    folder = tempfile.TemporaryDirectory()
    daemon = start_daemon(crepesd, examples, folder.name)
    faults = []

    def expect(what, holds):
        if not holds:
            faults.append(what)

    try:
        expect("the daemon answers on loopback", ask({"class": "POLL"}) is not None)
        wire = Wire()
        dice = random.Random(1)
        hosts = [f"10.9.{dice.randrange(1, 255)}.{dice.randrange(1, 255)}" for _ in range(200)]
        for _ in range(3):
            for host in hosts:
                for payload in forged_requests(dice):
                    wire.send(host, dice.randrange(1024, 65535), payload)
            wire.listen(0.3)
        unverified_out, unverified_in = sum(wire.got.values()), sum(wire.sent.values())
        # A host that has been asked for may be answered by ICMP, never by more than it sent.
        for host, size in wire.got.items():
            expect(f"{host} sent {wire.sent.get(host, 0)} bytes and got {size}", size <= wire.sent.get(host, 0))
        cookies = sum(b"COOKIE" in payload for _, _, payload in wire.answers)
        expect("some were offered a cookie", cookies > 0)

        before = len(wire.answers)
        long_watch = json.dumps({"class": "WATCH", "pad": "x" * 300}).encode()
        nobodies = ((DAEMON, PORT), (DAEMON, 5000), ("10.9.255.255", 5000), ("255.255.255.255", 5000),
                    ("224.0.0.1", 5000), ("239.255.255.250", 1900), ("0.0.0.0", 5000), ("127.0.0.1", 5000),
                    ("10.9.0.7", 0), ("10.9.0.7", PORT))
        for source, port in nobodies:
            wire.send(source, port, long_watch)
        wire.listen(0.7)
        # A busy machine may still be answering the hosts of before.
        to_nobody = [answer for answer in wire.answers[before:] if answer[0] in {source for source, _ in nobodies}]
        expect(f"nobody's addresses were answered: {to_nobody}", not to_nobody)

        # Nothing but an honest echo opens the door; then poses' greeting comes.
        time.sleep(1.0)
        before = len(wire.answers)
        wire.send("10.9.77.1", 7777, long_watch)
        wire.listen(1.0)
        offers = [json.loads(p) for t, port, p in wire.answers[before:] if (t, port) == ("10.9.77.1", 7777)]
        expect(f"an honest client is offered a cookie: {offers}", [o["class"] for o in offers] == ["COOKIE"])
        if offers:
            wire.send("10.9.77.1", 7777, json.dumps({"class": "WATCH", "cookie": offers[0]["cookie"]}).encode())
            wire.listen(1.0)
            expect("who echoes it is served", any(b"VERSION" in p for _, _, p in wire.answers))

        network = (ask({"class": "POLL", "about": "network"}) or {}).get("network", {})
        expect(f"all is counted: {network}", network.get("requests_unverified", 0) > 0
               and network.get("requests_unanswerable", 0) > 0)
        print(f"forged: {unverified_in} bytes in, {unverified_out} bytes out, {cookies} cookies; "
              f"excess {network.get('requests_in_excess', 0)}, unanswerable {network.get('requests_unanswerable', 0)}")
    finally:
        daemon.send_signal(signal.SIGTERM)
        daemon.wait(10)
    expect(f"the daemon ends well: {daemon.returncode}", daemon.returncode == 0)
    for fault in faults:
        print("NOT SO:", fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
