# SPDX-License-Identifier: BSD-3-Clause
"""The soak's part of docs/measurements.md, out of docs/soak.json."""


def milliseconds(latency):
    return f"{latency['p50']:.1f} / {latency['p99']:.1f} / {latency['max']:.1f}"


def text(soak):
    """Empty when nothing was measured."""
    if not soak:
        return ""
    growth, calls = soak["rss_anon_growth_kb"], soak["heap_calls_frame_thread"]
    others = (f"{soak['heap_calls_other_threads']} in {soak['other_threads']} threads (receiving, ground tiles), "
              f"{soak['heap_calls_other_threads'] / soak['frames']:.2f} a frame")
    rows = [
        ("frames, frames/s", "", f"{soak['frames']}, {soak['frames_per_second']:.1f}"),
        ("views, i.e. keyframes", "", f"{soak['views']}"),
        ("RssAnon at the end, and its growth since a fifth of the time", "growth <= 64 kB",
         f"{soak['rss_anon_kb']} kB, {growth:+d} kB"),
        ("heap calls of the thread from capture to packet", "0", f"{calls}"),
        ("heap calls of the other threads", "", others),
        ("CPU a frame, whole process", "", f"{soak['cpu_ms_a_frame']:.2f} ms"),
        ("CPU a frame, thread of the frames", "", f"{soak['frame_thread_cpu_ms_a_frame']:.2f} ms"),
        ("latency of a frame that is no keyframe: median / p99 / longest", "",
         milliseconds(soak["frame_latency_ms"]) + " ms"),
        ("latency of a keyframe to the end of its ground filter", "", milliseconds(soak["view_latency_ms"]) + " ms"),
        ("packets: views, patches, tiles", "",
         f"{soak['peer']['view']}, {soak['peer']['patch']}, {soak['peer']['overhead']}"),
    ]
    body = "".join(f"| {what} | {target} | {value} |\n" for what, target, value in rows)
    return (f"## The daemon for {soak['seconds'] / 60 + soak['settling_s'] / 60:.0f} minutes\n\n"
            f"Written by `tools/soak.sh --json docs/soak.json` on {soak['machine']}: the depot's pictures at 640x480 and 30 "
            "frames a second, a second at each place, round and round, while a base asks for pixels, tiles and repeats and a "
            f"service manager wants signs of life. The first {soak['settling_s']:.0f} s are not counted. Latency counts from "
            f"when a frame is due.\n\n| figure | target | measured |\n| --- | --- | --- |\n{body}\n")
