#!/usr/bin/env python3
"""Runs the code blocks of README.md as they stand; fails for a block that it cannot treat.

    readme_blocks.py SOURCE crepesd crepesctl

* sh: a command whose files are in the repository runs. A command that needs a robot, a recording or
  root is compared with the program's help, or is one of `NOT_RUN`.
* python: runs beside a live simulated pair for longer than a lease; poses must still arrive at the end.
  `pip install` is not run (crepes_client_test.py does): the package is imported where it is.
* yaml: must pass `crepesd --check-config` as a fragment of a configuration.
* json: each line must be an object.
* text: a table of a program's output; its head must be what the program prints.

The only change to a block: UDP port 47475 becomes a free one in Python, since a daemon may run here.
"""
import contextlib
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

SOURCE = pathlib.Path(sys.argv[1]).resolve()
CREPESD, CREPESCTL = (pathlib.Path(word).resolve() for word in sys.argv[2:4])
LEASE_S = 10.0
PATIENCE_S = 90.0  # for a busy machine
SERVES = ("view",)  # until interrupted: the options are compared only
NOT_RUN = ("./demo.sh", "./test.sh")  # they build everything; must be there and be good bash


def blocks_of(text):
    """(line number, language, lines) of every fenced block."""
    opened, found = None, []
    for number, line in enumerate(text.splitlines(), 1):
        if opened is None and (match := re.match(r"\s*```(.*)$", line)):
            opened = (number, match[1].strip(), [])
        elif opened is not None and line.strip() == "```":
            found.append(opened)
            opened = None
        elif opened is not None:
            opened[2].append(line)
    assert opened is None, f"README.md:{opened[0]}: block without an end"
    return found


def run(words, place, patience=PATIENCE_S):
    path = f"{CREPESD.parent}:{CREPESCTL.parent}:{os.environ['PATH']}"
    return subprocess.run(words, cwd=place, env={**os.environ, "PATH": path}, capture_output=True, text=True, timeout=patience, check=False)


class Shell:
    """A place like a clone of the repository, but for what blocks write into build/."""

    def __init__(self, place):
        self.place, self.ran = place, {}
        for name in os.listdir(SOURCE):
            if name != "build" and not name.startswith("."):
                (place / name).symlink_to(SOURCE / name)
        (place / "build/release").mkdir(parents=True)

    def fault_of(self, line):
        words = shlex.split(line, comments=True)
        if not words or words[0] == "export":
            return None if not words or words[1].startswith("PATH=") else f"{words[1]}: unknown variable"
        if words[0] == "eval":
            words = shlex.split(words[1].removeprefix("$(").removesuffix(")"))
        if words[0] in NOT_RUN:
            done = run(["bash", "-n", words[0]], self.place)
            return done.stderr if done.returncode or not os.access(self.place / words[0], os.X_OK) else None
        if words[:2] == ["pip", "install"]:
            return None if (self.place / words[2] / "pyproject.toml").exists() else f"{words[2]}: no Python package"
        if words[0] not in ("crepesctl", "crepesd"):
            return f"{words[0]}: the test does not know this program"
        if self.can_run(words):
            done = run(words, self.place)
            self.ran[" ".join(words[:2])] = done.stdout
            return None if done.returncode == 0 else f"exit code {done.returncode}\n{done.stderr}"
        return self.fault_of_options(words)

    def can_run(self, words):
        """Its files are here, or were made by an earlier command."""
        if words[1] in SERVES:
            return False
        inputs = [word for word in words if word.startswith(("config/", "build/"))]
        return words[:2] == ["crepesctl", "completion"] or any((self.place / word).exists() for word in inputs)

    def fault_of_options(self, words):
        inner = [word for word in words[1:3] if re.fullmatch(r"[a-z][a-z-]+", word)][:1] if words[0] == "crepesctl" else []
        help_of = run([words[0], *inner, "--help"], self.place)
        if help_of.returncode:
            return f"{' '.join(words[:1] + inner)}: no such command"
        # What follows the name of an inner command, as in `led ... set`, is that command's.
        text = help_of.stdout
        for word in words[2:]:
            if re.search(rf"^  {re.escape(word)} ", text, re.MULTILINE):
                text += run([words[0], *inner, word, "--help"], self.place).stdout
        missing = [word for word in words if word.startswith("--") and not re.search(rf"{word}\b", text)]
        return f"no option {', '.join(missing)}" if missing else None


def fault_of_yaml(lines, place):
    folder = pathlib.Path(tempfile.mkdtemp(dir=place))
    shutil.copy(SOURCE / "config/examples/four-simulated/r1.yaml", folder / "crepesd.yaml")
    (folder / "crepesd.d").mkdir()
    (folder / "crepesd.d/50-readme.yaml").write_text("\n".join(lines) + "\n")
    done = run([CREPESD, "--check-config", folder / "crepesd.yaml"], place)
    return None if done.returncode == 0 else done.stdout + done.stderr


def fault_of_json(lines):
    for line in lines:
        try:
            if not isinstance(json.loads(line), dict):
                return f"{line}: no object"
        except json.JSONDecodeError as error:
            return f"{line}: {error}"
    return None


def free_ports(count):
    """The first of `count` UDP ports in a row that are free."""
    for first in range(48000 + os.getpid() % 10000, 64000, count):
        with contextlib.ExitStack() as stack, contextlib.suppress(OSError):
            for port in range(first, first + count):
                stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)).bind(("127.0.0.1", port))
            return first
    raise OSError("no free ports")


@contextlib.contextmanager
def started(words, **options):
    """A process with all its children, until the block is left."""
    process = subprocess.Popen(words, start_new_session=True, text=True, **options)
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@contextlib.contextmanager
def live_pair(place, port):
    """Two daemons in a simulated world, robot 1 with this port; small pictures, for busy machines."""
    with contextlib.ExitStack() as stack:
        robots = []
        for robot in (1, 2):
            file = place / f"live-r{robot}.yaml"
            text = (SOURCE / f"config/examples/four-simulated/r{robot}.yaml").read_text()
            file.write_text(re.sub(r"^ *- \{id: [34],.*\n", "", text, flags=re.MULTILINE))
            (place / f"{file.name[:-5]}.d").mkdir()
            (place / f"{file.name[:-5]}.d/small.yaml").write_text(
                "cameras: [{name: cam0, resolution: [320, 256], intrinsics: [-0.1723, 0.5931, 79.2, 79.2, 159.4, 128.2]}]\n"
                f"net: {{port: {port + 2}}}\nsim: {{scenario: two}}\n"
                f"subscription: {{listen: [127.0.0.1], port: {port + robot - 1}}}\n"
            )
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            robots.append(stack.enter_context(started([str(CREPESD), "--config", str(file)], **quiet)))
        yield robots


def await_daemon(port):
    """Returns when it answers: a program that asks once only must not fail for asking too early."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.settimeout(0.5)
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            client.sendto(b'{"class":"POLL"}', ("127.0.0.1", port))
            with contextlib.suppress(TimeoutError):
                client.recv(2000)
                return
    raise TimeoutError("crepesd does not answer")


def fault_of_python(lines, place):
    """Poses must arrive for two seconds longer than one request's lease."""
    port = free_ports(3)
    program = "\n".join(lines)
    assert "47475" in program, "where does it ask?"
    arrivals = []

    def listen(output):
        for line in output:
            if not re.match(r"\d+ (direct|graph|predicted) Vector\(", line):
                continue
            arrivals.append(time.monotonic())

    with live_pair(place, port) as swarm:
        await_daemon(port)
        words = [sys.executable, "-B", "-c", program.replace("47475", str(port))]
        library = {**os.environ, "PYTHONPATH": str(SOURCE / "config/examples/clients/python")}
        with started(words, env=library, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as client:
            thread = threading.Thread(target=listen, args=(client.stdout,), daemon=True)
            thread.start()
            end = time.monotonic() + PATIENCE_S
            while time.monotonic() < end and client.poll() is None and all(robot.poll() is None for robot in swarm):
                if arrivals and arrivals[-1] - arrivals[0] > LEASE_S + 2.0:
                    return None
                time.sleep(0.1)
            if client.poll() is not None:
                return f"ended\n{client.stderr.read()}"
            if any(robot.poll() is not None for robot in swarm):
                return "crepesd ended"
    if not arrivals:
        return "no pose"
    return f"the last pose came {arrivals[-1] - arrivals[0]:.1f} s after the first: is the lease renewed?"


def fault_of_text(lines, shell):
    head = lines[0].split()
    if head[:3] == ["pair", "first", "pose"]:
        demo = ["crepesctl", "demo", "--scenario", "two", "--for", "2", "--port", str(free_ports(2))]
        printed = run(demo, shell.place).stdout
    elif head[:2] == ["pair", "rows"]:
        printed = shell.ran.get("crepesctl evaluate", "")
    else:
        return "output of what? the test does not know"
    heads = [line.split() for line in printed.splitlines()]
    return None if head in heads else f"its head is not in\n{printed}"


def fault_of(language, lines, shell):
    if language == "python":
        return fault_of_python(lines, shell.place)
    if language == "yaml":
        return fault_of_yaml(lines, shell.place)
    if language == "json":
        return fault_of_json(lines)
    if language == "text":
        return fault_of_text(lines, shell)
    return f"the test does not know blocks of '{language}'"


def main():
    faults, seen = [], []
    with tempfile.TemporaryDirectory(prefix="crepes-readme.") as scratch:
        shell = Shell(pathlib.Path(scratch))
        for number, language, lines in blocks_of((SOURCE / "README.md").read_text(encoding="utf-8")):
            seen.append(language)
            if language == "sh":
                faults += [(number + i, fault) for i, line in enumerate(lines, 1) if (fault := shell.fault_of(line))]
            elif fault := fault_of(language, lines, shell):
                faults.append((number, fault))
        wanted = {"crepesctl replay", "crepesctl evaluate", "crepesctl plot", "crepesctl completion"}
        if not wanted <= shell.ran.keys():
            faults.append((1, f"not run: {wanted - shell.ran.keys()}"))
        elif not (shell.place / "build/two-robots/plot.html").stat().st_size > 10000:
            faults.append((1, "crepesctl plot left no page"))
    assert {"sh", "python", "yaml", "json"} <= set(seen), f"blocks of {set(seen)} only"
    for number, fault in faults:
        print(f"README.md:{number}: {fault}")
    if not faults:
        print(f"{len(seen)} blocks, {len(shell.ran)} commands run: all as they stand")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
