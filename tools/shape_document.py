# SPDX-License-Identifier: BSD-3-Clause
"""The part of docs/measurements.md on final boxes, voxels and what is silently free, out of measure.py's records."""
import measure_document as document

KIND = "shape"
MIN_FINAL_IOU, MIN_SHARE_OF_HULL, MIN_COVERED, MIN_FREE_RECALL, MIN_PRECISION = 0.70, 0.90, 0.98, 0.90, 0.95


def pair(record):
    """Voxel IoU and that of the hull from true masks, by obstacle."""
    hull = {item["truth"]: item["iou"] for item in record.get("hull") or []}
    return [(item["iou"], hull.get(item["truth"])) for item in record.get("voxels") or []]


def free_cells(record):
    foot = record["footprint"]
    return [document.judged(foot["false_free_m2"] == 0, document.number(foot["false_free_m2"], 4)),
            document.judged(foot["covered"] >= MIN_COVERED, document.percent(foot["covered"])),
            document.judged(foot["free_recall"] >= MIN_FREE_RECALL, document.percent(foot["free_recall"])),
            document.judged(document.precision(record) >= MIN_PRECISION, document.percent(document.precision(record))),
            record["missed"], record["false"]]


def shape_cells(record):
    boxes = document.ious(record)
    yaw = [box["yaw_error_deg"] for box in record["boxes"] if box.get("yaw_error_deg") is not None]
    voxels = pair(record)
    shares = [ours / hull for ours, hull in voxels if hull]
    layers = record["bytes"]
    return [" ".join(document.number(iou, 2) for iou in boxes),
            document.judged(min(boxes) >= MIN_FINAL_IOU, document.number(min(boxes), 2)),
            " ".join(document.number(error, 1) for error in yaw) or document.DASH,
            " ".join(f"{ours:.2f}/{hull:.2f}" for ours, hull in voxels if hull) or document.DASH,
            document.judged(min(shares) >= MIN_SHARE_OF_HULL, document.number(min(shares), 2)) if shares
            else document.DASH,
            document.number(layers["silhouette"]), document.number(layers["texture"]),
            document.number(layers["total"]), document.number(record["ms"].get("carve"))]


def text(result):
    records = [dict(run, label=f"{run['site']}, {run['label']}") for run in document.of_kind(result, KIND)]
    if not records:
        return ""
    free = document.rows_of(records, free_cells, 6)
    shapes = document.rows_of(records, shape_cells, 9)
    return ("## Nothing silently free, final boxes, voxels\n\n"
            "Drives with `--as voxels`: after the boxes the base asks for silhouettes and for textures and carves. Poses "
            "exact, moved by seed 1 in each of four ways, under changed light and with noise.\n\n"
            + document.table(["run", "shown free wrongly, m2 (0)", f"footprint covered (>= {MIN_COVERED:.0%})",
                              f"free ground shown free (>= {MIN_FREE_RECALL:.0%})",
                              f"matches correct (>= {MIN_PRECISION:.0%})", "missed (0)", "false (0)"], free)
            + "\nThe final box comes of points and volume; yaw errors only of obstacles whose outline is a box. Voxels: IoU "
            "of ours and of the hull from true masks on the same grid.\n\n"
            + document.table(["run", "final box IoU of each", f"least (>= {MIN_FINAL_IOU})", "yaw off, deg",
                              "voxel IoU, ours/hull", f"least share of the hull's (>= {MIN_SHARE_OF_HULL})",
                              "silhouette bytes", "texture bytes", "bytes in all", "carve, ms"], shapes) + "\n")
