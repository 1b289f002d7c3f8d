/* SPDX-License-Identifier: BSD-3-Clause
 * How near the written frames come to what the virtual camera really sees. */
#ifndef OUTCROP_EVAL_METRICS_SEQUENCE_H
#define OUTCROP_EVAL_METRICS_SEQUENCE_H

#include "metrics_box.h"
#include "run.h"
#include "truth.h"

#include <map>
#include <optional>
#include <string>

namespace outcrop::eval {

/* PSNR is over the pixels of all frames together, SSIM the frames' mean. */
struct SequenceMetrics {
    int frames = 0;
    double psnr_db = 0, ssim = 0;
    std::optional<double> psnr_obstacle_db;     /* where the true mask is an obstacle */
    std::optional<double> psnr_ground_db;       /* true ground pixels, against the true overhead warped */
    std::optional<double> psnr_ground_limit_db; /* the same for the true frames: nothing can do better */
    std::optional<double> mask_iou;             /* any obstacle against the rest */
    std::optional<double> mask_iou_obstacle;    /* mean over true obstacles, through the boxes' assignment */
    std::optional<double> flicker;              /* mean |I_t - I_t-1 moved over the ground|, grey levels */
    std::optional<double> flicker_truth;        /* the same of the true frames */
};

/* One entry per folder of DIR/sequence; an entry is empty (and noted) when its
 * frames are not those of the site's path: another count or another size. */
using Sequences = std::map<std::string, std::optional<SequenceMetrics>>;

std::optional<Sequences> evaluate_sequences(const Truth &truth, const Run &run, const std::optional<BoxMetrics> &boxes,
                                            Notes &notes);

} // namespace outcrop::eval
#endif
