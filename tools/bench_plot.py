# SPDX-License-Identifier: BSD-3-Clause
"""The bench's pictures, docs/pictures/bench_*.svg, out of docs/bench.json."""
import math

from measure_plot import FAINT, INK, element, words

PANEL_W, PANEL_H = 280, 200
LEFT, GAP = 50, 62
WIDTH = LEFT + 2 * (PANEL_W + GAP) - GAP + 16
OURS, THESIS = "#e0701f", "#8a63d2"
VARIANCE_COLOURS = {0: "#35a06b", 100: "#3f8fd6", 400: "#e0701f", 1000: "#c43d5b"}
DETECTOR_COLOURS = {"ours+corners": "#e8a87c", "ours": OURS, "harris": "#3f8fd6", "gftt": "#35a06b", "fast": "#b8a11e",
                    "orb": "#c43d5b", "sift": "#4aa9a9", "thesis": THESIS}


def path(points, colour, **more):
    line = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    return element("path", d="M" + line, stroke=colour, fill="none", stroke_width=1.6, **more)


def document(title, width, height, parts):
    body = element("title", title) + "\n" + "\n".join(parts) + "\n"
    return element("svg", body, xmlns="http://www.w3.org/2000/svg", viewBox=f"0 0 {width} {height}", width=width,
                   height=height, font_family="sans-serif", font_size="11.5") + "\n"


class Axes:
    """A panel with its place, its ranges and, if asked for, a logarithmic upright axis."""

    def __init__(self, left, top, x_range, y_range, is_log=False):
        self.left, self.top, self.x_range, self.is_log = left, top, x_range, is_log
        self.y_range = tuple(map(math.log, y_range)) if is_log else y_range

    def x(self, value):
        return self.left + PANEL_W * (value - self.x_range[0]) / (self.x_range[1] - self.x_range[0])

    def y(self, value):
        level = math.log(value) if self.is_log else value
        return self.top + PANEL_H * (1 - (level - self.y_range[0]) / (self.y_range[1] - self.y_range[0]))

    def frame(self, title, x_ticks, y_ticks, x_label):
        parts = [words(self.left + PANEL_W / 2, self.top - 10, title, text_anchor="middle", font_weight="bold"),
                 words(self.left + PANEL_W / 2, self.top + PANEL_H + 34, x_label, text_anchor="middle")]
        for tick in y_ticks:
            y = self.y(tick)
            parts.append(element("path", d=f"M{self.left:.1f} {y:.1f}h{PANEL_W}", stroke=FAINT, fill="none"))
            parts.append(words(self.left - 6, y + 4, f"{tick:g}", text_anchor="end"))
        for tick in x_ticks:
            x = self.x(tick)
            parts.append(element("path", d=f"M{x:.1f} {self.top}v{PANEL_H}", stroke=FAINT, fill="none"))
            parts.append(words(x, self.top + PANEL_H + 16, f"{tick:g}", text_anchor="middle"))
        return parts

    def dots(self, points, colour):
        return [element("circle", cx=f"{self.x(x):.1f}", cy=f"{self.y(y):.1f}", r=3, fill=colour) for x, y in points]

    def curve(self, points, colour, **more):
        return path([(self.x(x), self.y(y)) for x, y in points], colour, **more)


def legend(entries, x, y):
    """(colour, text, dash or None) from left to right."""
    parts = []
    for colour, content, dash in entries:
        more = {"stroke_dasharray": dash} if dash else {}
        parts += [path([(x, y - 4), (x + 18, y - 4)], colour, **more), words(x + 23, y, content)]
        x += 36 + 6.1 * len(content)
    return parts


# ---- accuracy over lambda

def accuracy_svg(bench):
    rows = [row for row in bench["accuracy"] if row["set"] == "cells" and row["method"] in ("fixed", "bound")]
    panels = [("rmse_px", "RMSE of the apex, px", (0.02, 1.6), (0.02, 0.05, 0.1, 0.2, 0.5, 1)),
              ("angle_rmse_deg", "RMSE of the branch angle, deg", (0.05, 10), (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10))]
    lambdas = sorted({row["lambda_px"] for row in rows})
    variances = sorted({row["variance"] for row in rows})
    parts = legend([(VARIANCE_COLOURS.get(v, INK), f"variance {v}", None) for v in variances] +
                   [(INK, "bound by noise", "4 3")], LEFT, 16)
    for i, (figure, title, y_range, ticks) in enumerate(panels):
        axes = Axes(LEFT + i * (PANEL_W + GAP), 50, (lambdas[0] - 1, lambdas[-1] + 1), y_range, is_log=True)
        parts += axes.frame(title, lambdas, ticks, "lambda, px")
        for variance in variances:
            colour = VARIANCE_COLOURS.get(variance, INK)
            for method, more in (("fixed", {}), ("bound", {"stroke_dasharray": "4 3"})):
                points = [(row["lambda_px"], row["figures"][figure]) for row in rows
                          if row["variance"] == variance and row["method"] == method and figure in row["figures"]]
                if points:
                    parts.append(axes.curve(points, colour, **more))
                    parts += axes.dots(points, colour) if method == "fixed" else []
    return document("Accuracy of junctions over branch length and noise", WIDTH, 296, parts)


# ---- figure 3.5

def triangle_svg(bench):
    rows = bench["thesis"]["triangle"]["rows"]
    panels = [("mean_deg", "mean of the sum, deg", (176, 200), range(176, 201, 4)),
              ("sd_deg", "standard deviation, deg", (0, 10), range(0, 11, 2))]
    parts = legend([(THESIS, "thesis as printed", None), (OURS, "ours", None), (INK, "180 degrees", "4 3")], LEFT, 16)
    for i, (figure, title, y_range, ticks) in enumerate(panels):
        axes = Axes(LEFT + i * (PANEL_W + GAP), 50, (7, 25), y_range)
        parts += axes.frame(title, range(8, 25, 2), ticks, "lambda, px")
        if figure == "mean_deg":
            parts.append(axes.curve([(7, 180), (25, 180)], INK, stroke_dasharray="4 3"))
        for method, colour in (("thesis", THESIS), ("ours", OURS)):
            points = [(row["lambda_px"], min(max(row[figure], y_range[0]), y_range[1])) for row in rows
                      if row["method"] == method]
            parts += [axes.curve(points, colour)] + axes.dots(points, colour)
    return document("Sum of a triangle's angles in 28 views", WIDTH, 296, parts)


# ---- figure 3.6

def chess_svg(bench):
    chess, side = bench["thesis"]["chess"], 13
    parts = []
    for i, method in enumerate(("thesis", "ours")):
        count = chess[method]["count"]
        n, left, top = len(count), LEFT + i * (PANEL_W + GAP), 34
        most = max(max(row) for row in count) or 1
        parts.append(words(left + n * side / 2, top - 12, "thesis as printed" if method == "thesis" else "ours",
                           text_anchor="middle", font_weight="bold"))
        parts.append(element("path", d=f"M{left} {top}h{n * side}v{n * side}h{-n * side}z", stroke=FAINT, fill="none"))
        for up, row in enumerate(count):
            for across, value in enumerate(row):
                if value:
                    y = top + (n - 1 - up) * side
                    parts.append(element("path", d=f"M{left + across * side} {y}h{side}v{side}h{-side}z",
                                         fill=OURS, fill_opacity=f"{0.12 + 0.88 * value / most:.2f}"))
                    if value >= 0.2 * most:
                        parts.append(words(left + (across + 0.5) * side, y + side - 3.5, str(value), font_size=8,
                                           text_anchor="middle", **({"fill": "#fff"} if value > most / 2 else {})))
        for k in range(0, n, 3):
            parts.append(words(left + (k + 0.5) * side, top + n * side + 14, f"{-45 + 5 * k}", text_anchor="middle"))
            parts.append(words(left - 5, top + (n - 1 - k + 0.5) * side + 4, f"{45 + 5 * k}", text_anchor="end"))
        parts.append(words(left + n * side / 2, top + n * side + 31, "near level, deg", text_anchor="middle"))
    parts.append(words(0, 0, "near upright, deg", text_anchor="middle",
                       transform=f"translate(14 {34 + 19 * side / 2:.0f}) rotate(-90)"))
    return document("Directions of a chessboard's branches", WIDTH, 320, parts)


# ---- repeatability

def repeatability_svg(bench):
    rows = [row for row in bench["repeatability"]["rows"] if row["variance"] == 0]
    groups = list(dict.fromkeys((row["set"], row["warp"]) for row in rows))
    names = [name for name in DETECTOR_COLOURS if any(row["detector"] == name for row in rows)]
    bar, gap, top, height = 8, 18, 40, 180
    pitch = bar * len(names) + gap
    width = LEFT + pitch * len(groups) + 10
    parts, x = [], LEFT
    for name in names:
        parts += [element("path", d=f"M{x} 8h10v10h-10z", fill=DETECTOR_COLOURS[name]), words(x + 14, 17, name)]
        x += 28 + 7 * len(name)
    for tick in range(0, 11, 2):
        y = top + height * (1 - tick / 10)
        parts.append(element("path", d=f"M{LEFT} {y:.1f}H{width - 10}", stroke=FAINT, fill="none"))
        parts.append(words(LEFT - 6, y + 4, f"{tick / 10:.1f}", text_anchor="end"))
    for i, group in enumerate(groups):
        left = LEFT + gap / 2 + i * pitch
        for row in rows:
            if (row["set"], row["warp"]) == group:
                at, share = left + bar * names.index(row["detector"]), row["figures"]["repeatability"]
                parts.append(element("path", d=f"M{at:.1f} {top + height * (1 - share):.1f}V{top + height}h{bar - 1}"
                                     f"V{top + height * (1 - share):.1f}z", fill=DETECTOR_COLOURS[row["detector"]]))
        middle = left + bar * len(names) / 2
        parts.append(words(middle, top + height + 15, group[1], text_anchor="middle"))
        parts.append(words(middle, top + height + 29, group[0], text_anchor="middle", font_size=9))
    return document("Share of points found again", width, top + height + 40, parts)


def pictures(bench):
    """{file name: text} of what can be drawn."""
    drawn = {}
    if "accuracy" in bench:
        drawn["bench_accuracy.svg"] = accuracy_svg(bench)
    if "triangle" in bench.get("thesis", {}):
        drawn["bench_triangle.svg"] = triangle_svg(bench)
    if "chess" in bench.get("thesis", {}):
        drawn["bench_chess.svg"] = chess_svg(bench)
    if bench.get("repeatability", {}).get("rows"):
        drawn["bench_repeatability.svg"] = repeatability_svg(bench)
    return drawn
