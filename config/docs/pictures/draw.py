#!/usr/bin/env python3
"""Draws pictures for the README as SVG from output of crepesctl. Standard library only.

    draw.py paths RESULTS SWARM_DIR OUT.svg     the robots' true paths, and where each saw the other
    draw.py screen TEXT_FILE OUT.svg            a terminal's text
    draw.py formation KEPT OUT.svg              a triangle of robots, from `crepesctl demo --keep KEPT`
"""
import bisect
import csv
import html
import math
import pathlib
import re
import sys
import textwrap

TRUE = ["#8a94a3", "#b9a88f"]
ESTIMATE = ["#1f4e9c", "#c0392b"]


def rotate(q, v):
    """v turned by the quaternion q (w x y z)."""
    w, x, y, z = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return (
        v[0] + w * tx + y * tz - z * ty,
        v[1] + w * ty + z * tx - x * tz,
        v[2] + w * tz + x * ty - y * tx,
    )


class Truth:
    """t, p_W (3), q_WB (4) of one robot."""

    def __init__(self, file):
        with open(file, encoding="utf-8") as text:
            rows = [[float(cell) for cell in row[:8]] for row in csv.reader(text) if row[0][0] != "#"]
        self.rows, self.times = rows, [row[0] for row in rows]

    def at(self, t):
        i = min(max(bisect.bisect_right(self.times, t), 1), len(self.rows) - 1)
        a, b = self.rows[i - 1], self.rows[i]
        share = (t - a[0]) / (b[0] - a[0])
        sign = 1 if sum(x * y for x, y in zip(a[4:], b[4:])) > 0 else -1
        p = [x + share * (y - x) for x, y in zip(a[1:4], b[1:4])]
        q = [x + share * (sign * y - x) for x, y in zip(a[4:], b[4:])]
        norm = math.sqrt(sum(x * x for x in q))
        return p, [x / norm for x in q]


def robots_of(swarm):
    """Name, clock offset and skew of each robot in swarm.yaml."""
    text = (swarm / "swarm.yaml").read_text(encoding="utf-8")
    names = re.findall(r"name: (\w+)", text)
    offsets = re.findall(r"offset_s: ([-\d.e+]+)", text)
    skews = re.findall(r"skew_ppm: ([-\d.e+]+)", text)
    return [(n, float(o), float(s)) for n, o, s in zip(names, offsets, skews)]


def polyline(points, color, width, dashes=""):
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="{width}"{dashes}/>'


def text(x, y, words, color="#222", anchor="start", size=13):
    return (
        f'<text x="{x}" y="{y}" fill="{color}" font-size="{size}" text-anchor="{anchor}">'
        f"{html.escape(words)}</text>"
    )


def paths(results, swarm, out):
    results, swarm = pathlib.Path(results), pathlib.Path(swarm)
    robots = robots_of(swarm)
    truth = {name: Truth(swarm / "truth" / f"{name}.csv") for name, _, _ in robots}
    seen = {}
    for name, offset, skew in robots:
        for other in truth:
            if other == name:
                continue
            points = seen.setdefault(other, [])
            with open(results / name / f"{other}.csv", encoding="utf-8") as rows:
                for row in list(csv.DictReader(rows))[::5]:
                    t = (float(row["t_ns"]) * 1e-9 - offset) / (1 + skew * 1e-6)
                    p, q = truth[name].at(t)
                    d = rotate(q, [float(row[axis]) for axis in ("px", "py", "pz")])
                    points.append((p[0] + d[0], p[1] + d[1]))
    every = [(row[1], row[2]) for path in truth.values() for row in path.rows]
    every += [point for points in seen.values() for point in points]
    left, right = min(x for x, _ in every) - 0.3, max(x for x, _ in every) + 0.3
    low, high = min(y for _, y in every) - 0.3, max(y for _, y in every) + 0.3
    scale = min(760 / (right - left), 420 / (high - low))
    width, height = (right - left) * scale + 20, (high - low) * scale + 60

    def place(x, y):
        return 10 + (x - left) * scale, 10 + (high - y) * scale

    parts = []
    for x in range(math.ceil(left), math.floor(right) + 1):
        parts.append(polyline([place(x, low), place(x, high)], "#eceef1", 1))
    for y in range(math.ceil(low), math.floor(high) + 1):
        parts.append(polyline([place(left, y), place(right, y)], "#eceef1", 1))
    for i, (name, path) in enumerate(truth.items()):
        parts.append(polyline([place(row[1], row[2]) for row in path.rows[::4]], TRUE[i % 2], 3))
        for point in seen[name]:
            x, y = place(*point)
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="1.7" fill="{ESTIMATE[i % 2]}"/>')
        x, y = min((place(row[1], row[2]) for row in path.rows), key=lambda point: point[1])
        parts.append(text(round(x) + 40, round(y) + 4, name, ESTIMATE[i % 2], size=15))
    parts.append(text(10, round(height) - 28, "lines: true paths from above; dots: where the other robot saw it"))
    parts.append(text(10, round(height) - 10, "grid: 1 m; simulated recording", "#666"))
    write(out, round(width), round(height), parts, "system-ui, sans-serif")


def formation(kept, out, from_s=10.0, to_s=70.0):
    """The paths from above; every ten seconds the triangle."""
    truth = {robot: Truth(pathlib.Path(kept) / "truth" / f"r{robot}.csv") for robot in (1, 2, 3)}
    scale, width, height = 58, 760, 560

    def at(robot, t):
        p, _ = truth[robot].at(t)
        return width / 2 + scale * p[0], height / 2 - scale * p[1]

    steps = [from_s + 0.1 * i for i in range(int(10 * (to_s - from_s)))]
    parts = [f'<circle cx="{width / 2}" cy="{height / 2}" r="{0.25 * scale}" fill="#666"/>']
    for t in range(int(from_s) + 10, int(to_s), 10):
        corners = [at(robot, t) for robot in (1, 2, 3)]
        parts.append(polyline([*corners, corners[0]], "#b8c2cf", 1))
    for robot, color in zip(truth, ["#c0392b", "#1f4e9c", "#2c8a57"]):
        parts.append(polyline([at(robot, t) for t in steps], color, 2))
        x, y = at(robot, to_s)
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{color}"/>')
        parts.append(text(x, y - 14, "r1 leads" if robot == 1 else f"r{robot} follows", color, "middle"))
    parts.append(text(width / 2, height / 2 + 4, "pillar", "#fff", "middle", 10))
    parts.append(polyline([(20, height - 20), (20 + scale, height - 20)], "#222", 2))
    parts.append(text(20, height - 28, "1 m"))
    parts.append(text(width - 20, height - 20, "true paths over 60 s, simulated; thin: the triangle every 10 s", "#222", "end"))
    write(out, width, height, parts, "sans-serif")


def screen(source, out):
    lines = []
    for line in pathlib.Path(source).read_text(encoding="utf-8").rstrip("\n").split("\n"):
        lines += textwrap.wrap(line.rstrip(), 100, subsequent_indent="  ", drop_whitespace=False) or [""]
    width, height = 24 + max(len(line) for line in lines) * 7.9, 24 + 18 * len(lines)
    parts = [f'<rect width="{width:.0f}" height="{height}" rx="6" fill="#14181f"/>']
    for i, line in enumerate(lines):
        parts.append(
            f'<text x="12" y="{26 + 18 * i}" fill="#d7dce2" font-size="13" xml:space="preserve" '
            f'textLength="{len(line) * 7.9:.0f}">{html.escape(line)}</text>'
            if line
            else ""
        )
    write(out, round(width), height, parts, "ui-monospace, DejaVu Sans Mono, monospace")


def write(out, width, height, parts, font):
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="{font}">\n'
    svg += f'<rect width="{width}" height="{height}" fill="#fff"/>\n' + "\n".join(filter(None, parts)) + "\n</svg>\n"
    pathlib.Path(out).write_text(svg, encoding="utf-8")


{"paths": paths, "screen": screen, "formation": formation}[sys.argv[1]](*sys.argv[2:])
