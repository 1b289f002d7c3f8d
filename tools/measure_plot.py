# SPDX-License-Identifier: BSD-3-Clause
"""docs/pictures/bytes_vs_iou.svg out of measure.py's records: a panel per site, bytes (log) against mean box IoU."""
import math
from html import escape

import measure_document

PANEL_W, PANEL_H = 250, 220
LEFT, TOP, GAP, BOTTOM = 46, 66, 22, 46
# Greys and hues that hold on white and on black alike; the ground stays transparent.
INK, FAINT = "#808891", "#80889155"
COLOURS = {"ours": "#e0701f", "jpeg": "#3f8fd6", "webp": "#35a06b"}
TICKS = [10e3, 20e3, 50e3, 100e3, 200e3, 500e3, 1e6, 2e6, 5e6]


def element(name, content=None, **attributes):
    given = "".join(f' {key.replace("_", "-")}="{value}"' for key, value in attributes.items())
    return f"<{name}{given}/>" if content is None else f"<{name}{given}>{content}</{name}>"


def words(x, y, content, **attributes):
    return element("text", escape(content), x=f"{x:.1f}", y=f"{y:.1f}", **{"fill": INK, **attributes})


class Panel:
    """Where bytes and IoU fall in one site's panel."""

    def __init__(self, left, low, high, least_iou):
        self.left, self.low, self.high, self.least_iou = left, math.log(low), math.log(high), least_iou

    def x(self, n_bytes):
        return self.left + PANEL_W * (math.log(n_bytes) - self.low) / (self.high - self.low)

    def y(self, iou):
        return TOP + PANEL_H * (1 - iou) / (1 - self.least_iou)


def frame(panel, site, ticks, is_first):
    parts = [words(panel.left + PANEL_W / 2, TOP - 10, site, text_anchor="middle", font_weight="bold")]
    for i in range(round(10 * panel.least_iou), 11):
        y = panel.y(i / 10)
        parts.append(element("path", d=f"M{panel.left:.1f} {y:.1f}h{PANEL_W}", stroke=FAINT, fill="none"))
        if is_first:
            parts.append(words(panel.left - 6, y + 4, f"{i / 10:.1f}", text_anchor="end"))
    for tick in ticks:
        parts.append(element("path", d=f"M{panel.x(tick):.1f} {TOP}v{PANEL_H}", stroke=FAINT, fill="none"))
        parts.append(words(panel.x(tick), TOP + PANEL_H + 16, f"{tick / 1000:g} kB", text_anchor="middle"))
    return parts


def label_place(x, y, taken):
    """Of a few places round a point the one farthest from points and earlier labels."""
    places = [(x, y - 13), (x, y + 13), (x + 21, y), (x - 21, y), (x - 16, y - 13), (x + 16, y + 13)]
    others = [other for other in taken if other != (x, y)]

    def clearance(place):
        return min((max(abs(place[0] - a) / 30, abs(place[1] - b) / 13) for a, b in others), default=9)
    place = next((place for place in places if clearance(place) >= 1), max(places, key=clearance))
    taken.append(place)
    return place


def curve(panel, runs, colour, taken):
    points = [(panel.x(run["bytes"]["total"]), panel.y(measure_document.mean_iou(run))) for run in runs]
    line = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    parts = [element("path", d="M" + line, stroke=colour, fill="none", stroke_dasharray="3 3")]
    for run, (x, y) in zip(runs, points):
        is_whole = run["missed"] == 0
        label_x, label_y = label_place(x, y, taken)
        parts.append(element("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=4.5, stroke=colour, stroke_width=1.8,
                             fill=colour if is_whole else "none"))
        parts.append(words(label_x, label_y + 4, run["label"].split()[-1], fill=colour, text_anchor="middle"))
    return parts


def site_panel(panel, result, site):
    runs = [run for run in measure_document.of_kind(result, "ours", "rival", site=site)
            if not run["failed"] and run.get("boxes")]
    ours = [run for run in runs if run["kind"] == "ours"]
    parts = []
    taken = [(panel.x(run["bytes"]["total"]), panel.y(measure_document.mean_iou(run))) for run in runs]
    for run in ours:
        level = panel.y(measure_document.mean_iou(run) - measure_document.SAME_BOXES_SLACK)
        parts.append(element("path", d=f"M{panel.left:.1f} {level:.1f}h{PANEL_W}", stroke=COLOURS["ours"],
                             stroke_opacity=0.6, fill="none"))
    for codec in ("jpeg", "webp"):
        family = [run for run in runs if run["label"].startswith(codec)]
        parts += curve(panel, family, COLOURS[codec], taken) if family else []
    return parts + (curve(panel, ours, COLOURS["ours"], taken) if ours else [])


def legend(width):
    entries = [("ours", "ours"), ("jpeg", "null rival, JPEG quality q"), ("webp", "null rival, WebP quality q")]
    parts, x = [], LEFT
    for key, content in entries:
        parts.append(element("circle", cx=x + 5, cy=12, r=4.5, fill=COLOURS[key]))
        parts.append(words(x + 15, 16, content))
        x += 34 + 5.8 * len(content)
    parts.append(words(LEFT, 34, "hollow: an obstacle is missed; line: our mean IoU less "
                       f"{measure_document.SAME_BOXES_SLACK:g}"))
    parts.append(words(width / 2, TOP + PANEL_H + 36, "bytes on the link, in all", text_anchor="middle"))
    parts.append(words(0, 0, "mean box IoU", text_anchor="middle",
                       transform=f"translate(13 {TOP + PANEL_H / 2:.0f}) rotate(-90)"))
    return parts


def svg(result):
    runs = [run for run in measure_document.of_kind(result, "ours", "rival") if not run["failed"] and run.get("boxes")]
    sites = list(dict.fromkeys(run["site"] for run in runs))
    sizes = [run["bytes"]["total"] for run in runs] or [TICKS[0]]
    low, high = min(sizes) / 1.3, max(sizes) * 1.3
    least_iou = math.floor(10 * min((measure_document.mean_iou(run) for run in runs), default=0)) / 10
    ticks = [tick for tick in TICKS if low <= tick <= high]
    width = LEFT + len(sites) * (PANEL_W + GAP)
    height = TOP + PANEL_H + BOTTOM
    parts = legend(width)
    for i, site in enumerate(sites):
        panel = Panel(LEFT + i * (PANEL_W + GAP), low, high, min(least_iou, 0.9))
        parts += frame(panel, site, ticks, i == 0) + site_panel(panel, result, site)
    body = element("title", "Bytes on the link against mean box IoU") + "\n" + "\n".join(parts) + "\n"
    return element("svg", body, xmlns="http://www.w3.org/2000/svg", viewBox=f"0 0 {width} {height}", width=width,
                   height=height, font_family="sans-serif", font_size="11.5") + "\n"
