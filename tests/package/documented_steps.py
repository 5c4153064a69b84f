#!/usr/bin/python3
"""Runs the installation steps of the documents as they stand, on a tree that `cmake --install` made.
    documented_steps.py SOURCE BUILD

/etc and /usr/share in a step become those of the tree. Programs that need a robot (`STANDS_IN`) are
replaced: they write down how they were called and check the files they were given. `systemctl start`
and `reload` check the configuration, as the service's unit does.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

SOURCE, BUILD = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
EXAMPLES = SOURCE / "config/examples"
IMAGE = BUILD / "led_board/led_board.bin"

STANDS_IN = {
    "sudo": 'exec "$@"',
    "apt": "",
    "journalctl": "",
    "systemctl": 'case "$1 $2" in "start crepesd" | "reload crepesd") exec crepesd --check-config "$ROOT/etc/crepes/crepesd.yaml";; esac',
    # There is no group crepes here.
    "install": 'words=(); while [ $# -gt 0 ]; do case "$1" in -g) shift;; *) words+=("$1");; esac; shift; done; exec /usr/bin/install "${words[@]}"',
    "st-flash": 'for word in "$@"; do case "$word" in *.bin) test -s "$word" || exit 1;; esac; done',
    "stm32flash": 'for word in "$@"; do case "$word" in *.bin) test -s "$word" || exit 1;; esac; done',
}

faults = []


def expect(claim, holds):
    if not holds:
        faults.append(claim)


def blocks_of(page):
    """(line number, text) of every fenced block of commands."""
    text = page.read_text(encoding="utf-8")
    for match in re.finditer(r"^```(?:sh)?\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        yield text.count("\n", 0, match.start()) + 2, match[1]


class Robot:
    """A robot's file system, with the package installed."""

    def __init__(self, place):
        self.root, self.stands_in, self.calls = place / "root", place / "bin", place / "calls"
        subprocess.run(["cmake", "--install", BUILD], env={**os.environ, "DESTDIR": str(self.root)}, check=True, capture_output=True)
        self.stands_in.mkdir()
        self.calls.touch()
        for name, script in STANDS_IN.items():
            file = self.stands_in / name
            file.write_text(f'#!/bin/bash\necho {name} "$@" >>"$CALLS"\n{script}\n')
            file.chmod(0o755)
        for folder in ("etc/systemd/network", "etc/wpa_supplicant"):  # Debian's
            (self.root / folder).mkdir(parents=True)

    def follow(self, page, only="", replaced=()):
        """Runs the blocks of a page, those with `only` in them."""
        ran = 0
        for number, text in blocks_of(SOURCE / page):
            if only not in text:
                continue
            for old, new in replaced:
                expect(f"{page}:{number}: nothing of {old}", old in text)
                text = text.replace(old, new)
            text = re.sub(r"(?<![\w.])/(etc|usr/share)/", rf"{self.root}/\1/", text)
            path = f"{self.stands_in}:{self.root}/usr/bin:{os.environ['PATH']}"
            with tempfile.TemporaryDirectory() as folder:
                done = subprocess.run(["bash", "-euo", "pipefail", "-c", text], cwd=folder, text=True, capture_output=True,
                                      env={**os.environ, "PATH": path, "ROOT": str(self.root), "CALLS": str(self.calls)})
            expect(f"{page}:{number}: exit code {done.returncode}\n{done.stdout}{done.stderr}", done.returncode == 0)
            ran += 1
        expect(f"{page}: no steps", ran > 0)

    def was_called(self, words):
        expect(f"no step calls: {words}", words in self.calls.read_text().splitlines())

    def has(self, file, mode, like=None):
        path = self.root / file
        expect(f"{file} is not there", path.exists())
        if path.exists():
            expect(f"{file}: mode {path.stat().st_mode & 0o777:o}", path.stat().st_mode & 0o777 == mode)
            expect(f"{file}: not as {like}", like is None or path.read_bytes() == like.read_bytes())

    def configuration(self):
        done = subprocess.run([self.root / "usr/bin/crepesd", "--dump-config", self.root / "etc/crepes/crepesd.yaml"], text=True, capture_output=True)
        expect(f"the configuration is faulty\n{done.stderr}", done.returncode == 0)
        return done.stdout


def first_robot(robot):
    expect("/etc/crepes/crepesd.d is not there after installation", (robot.root / "etc/crepes/crepesd.d").is_dir())
    robot.follow("systemd/README.md")
    robot.has("etc/crepes/crepesd.yaml", 0o644, EXAMPLES / "two-robots/r1.yaml")
    for words in ("start", "reload", "status"):
        robot.was_called(f"systemctl {words} crepesd")
    robot.follow("systemd/MESH.md")
    for file in ("50-bat0.netdev", "50-bat0.network", "50-mesh-wlan0.network"):
        robot.has(f"etc/systemd/network/{file}", 0o644, SOURCE / "systemd/mesh" / file)
    robot.has("etc/wpa_supplicant/wpa_supplicant-wlan0.conf", 0o600)
    robot.was_called("systemctl enable --now systemd-networkd wpa_supplicant@wlan0")
    robot.has("etc/crepes/mesh.key", 0o640)
    expect("the key is not in the configuration", "etc/crepes/mesh.key" in robot.configuration())


def second_robot(robot):
    robot.follow("config/examples/two-robots/README.md", replaced=[(" r1.yaml", " r2.yaml")])
    expect("the second robot is not robot 2", re.search(r"^robot:\n(?: *#.*\n)*  id: 2$", robot.configuration(), re.MULTILINE) is not None)


def board(robot):
    if not IMAGE.exists():
        print("the LED board's image was not built: its steps are not tested")
        return
    robot.has("usr/share/crepes/led_board.bin", 0o644, IMAGE)
    robot.follow("firmware/HARDWARE.md", only="flash ")
    for program in ("st-flash", "stm32flash"):
        expect(f"no step calls {program}", program in robot.calls.read_text())


def cameras(robot):
    """Each camera's files are laid over the two robots' configuration, and all that they say is in force."""
    folders = sorted(file.parent for file in (robot.root / "usr/share/doc/crepes/examples/cameras").glob("*/10-camera.yaml"))
    expect("no cameras", len(folders) >= 4)
    (robot.root / "etc/crepes/crepesd.d").mkdir(exist_ok=True)
    for folder in folders:
        texts = {place: (folder / pathlib.Path(place).name).read_text() for place in ("crepesd.d/10-camera.yaml", "camchain-imucam.yaml")}
        for place, text in texts.items():
            (robot.root / "etc/crepes" / place).write_text(text)
        dump = robot.configuration()
        settings = re.findall(r"^ +((?:driver|rate_hz|exposure_us|intrinsics|resolution): .*)$", "\n".join(texts.values()), re.MULTILINE)
        expect(f"{folder.name}: says too little", len(settings) >= 4)
        for setting in settings:
            expect(f"{folder.name}: not in force: {setting}", f"    {setting}\n" in dump)
        expect(f"{folder.name}: more than one camera", dump.count("    camera_model: ") == 1)


def main():
    for what in ((first_robot, board), (second_robot, cameras)):
        with tempfile.TemporaryDirectory(prefix="crepes-steps.") as place:
            robot = Robot(pathlib.Path(place))
            for steps in what:
                steps(robot)
    print("\n".join(faults) or "every step leads where it should")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
