#!/usr/bin/python3
"""The page's colors: legible (WCAG 2.1), and told apart by the color-blind. No browser."""
import itertools
import math
import re
import unittest

from viewer import SOURCE

# Dichromacy, on linear RGB (Machado, Oliveira and Fernandes 2009, severity 1).
SIGHT = {
    "all cones": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "protanopia": ((0.152286, 1.052583, -0.204868), (0.114503, 0.786281, 0.099216), (-0.003882, -0.048116, 1.051998)),
    "deuteranopia": ((0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)),
    "tritanopia": ((1.255528, -0.076749, -0.178779), (-0.078411, 0.930809, 0.147602), (0.004733, 0.691367, 0.303900)),
}
XYZ = ((0.4124564, 0.3575761, 0.1804375), (0.2126729, 0.7151522, 0.0721750), (0.0193339, 0.1191920, 0.9503041))
WHITE = (0.95047, 1.0, 1.08883)
MODES, AXES = ("direct", "graph", "predicted"), ("axis-x", "axis-y", "axis-z")
ROBOTS = tuple(f"robot-{i}" for i in range(8))


def times(matrix, vector):
    return [sum(m * x for m, x in zip(row, vector)) for row in matrix]


def linear(color):
    """Linear RGB of #rrggbb."""
    values = [int(color[i:i + 2], 16) / 255 for i in (1, 3, 5)]
    return [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in values]


def contrast(a, b):
    dark, bright = sorted(times(XYZ, linear(color))[1] for color in (a, b))
    return (bright + 0.05) / (dark + 0.05)


def lab(rgb):
    x, y, z = (t ** (1 / 3) if t > 216 / 24389 else (24389 / 27 * t + 16) / 116 for t in (v / w for v, w in zip(times(XYZ, rgb), WHITE)))
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def distance(a, b, sight):
    """CIE76; 2.3 is just noticeable side by side."""
    return math.dist(*(lab([min(1, max(0, x)) for x in times(SIGHT[sight], linear(color))]) for color in (a, b)))


class Colors(unittest.TestCase):
    def setUp(self):
        css = (SOURCE / "daemon/ctl/view/page/colors.css").read_text()
        self.themes = [dict(re.findall(r"--([\w-]+):\s*(#[0-9a-f]{6})", block)) for block in re.findall(r"\{([^}]*)\}", css)]
        self.assertEqual(len(self.themes), 2)

    def test_text_and_lines_stand_out_from_what_is_behind_them(self):
        for theme in self.themes:
            for behind in ("back", "panel"):
                for name in ("text", "soft", "accent", "good", "bad", *ROBOTS):  # robots' names have their color
                    self.assertGreaterEqual(contrast(theme[name], theme[behind]), 4.5, name)
                for name in (*MODES, *AXES):
                    self.assertGreaterEqual(contrast(theme[name], theme[behind]), 3, name)

    def test_colors_that_mean_something_differ_for_every_eye(self):
        for theme, sight in itertools.product(self.themes, SIGHT):
            for names, least in ((ROBOTS, 12), (MODES, 20), (AXES, 10), (("good", "bad"), 25)):
                for a, b in itertools.combinations(names, 2):
                    self.assertGreaterEqual(distance(theme[a], theme[b], sight), least, f"{a} and {b}, {sight}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
