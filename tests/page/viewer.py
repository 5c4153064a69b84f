"""crepesctl view, as a process of a test."""
import os
import pathlib
import select
import subprocess
import time
import urllib.request

SOURCE = pathlib.Path(__file__).resolve().parents[2]
TOOL = os.environ.get("CREPES_TOOL", str(SOURCE / "build/release/daemon/crepesctl"))
RECORDING = SOURCE / "config/examples/recordings/two-robots"


def replayed(out):
    """The directory of a replay of the recording of two robots."""
    results = pathlib.Path(out) / "results"
    subprocess.run([TOOL, "replay", str(RECORDING), "--out", str(results), "--debug-innovations"], check=True, capture_output=True)
    return results


class Viewer:
    def __init__(self, *arguments, listen="127.0.0.1:0", **environment):
        self.process = subprocess.Popen([TOOL, "view", "--listen", listen, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                        env={**os.environ, **environment})
        if not select.select([self.process.stdout], [], [], 30)[0]:
            raise TimeoutError("crepesctl view prints no address")
        line = self.process.stdout.readline().strip()
        if not line:
            raise RuntimeError(self.process.stderr.read())
        self.url, _, self.fragment = line.partition("#")
        self.host, _, port = self.url.removeprefix("http://").strip("/").rpartition(":")
        self.port = int(port)

    def stop(self):
        """Its exit code."""
        self.process.terminate()
        code = self.process.wait(30)
        self.process.stdout.close()
        self.process.stderr.close()
        return code

    def get(self, path, **headers):
        with urllib.request.urlopen(urllib.request.Request(self.url + path, headers=headers), timeout=30) as reply:
            return reply.read().decode()

    def cpu_s(self):
        return cpu_s(self.process.pid)


def cpu_s(pid):
    """What a process has used of the processor."""
    with open(f"/proc/{pid}/stat") as stat:
        fields = stat.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def wait(condition, what, patience_s=60):
    end = time.monotonic() + patience_s
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"waited in vain for: {what}")
        time.sleep(0.05)
