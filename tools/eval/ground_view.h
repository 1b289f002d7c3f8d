/* SPDX-License-Identifier: BSD-3-Clause
 * The true ground as a virtual camera sees it, and as it moves between frames. */
#ifndef OUTCROP_EVAL_GROUND_VIEW_H
#define OUTCROP_EVAL_GROUND_VIEW_H

#include "truth.h"

#include <opencv2/core.hpp>

namespace outcrop::eval {

struct GroundView {
    cv::Mat image; /* CV_8UC3 */
    cv::Mat known; /* CV_8U, 255 where the pixel sees ground that the overhead shows */
};

/* The overhead warped into a camera: each pixel the mean of 3x3 rays, so that
 * far ground does not alias. */
GroundView warp_overhead(const TrueOverhead &overhead, const Camera &camera);

/* For each pixel of `to`, where its ground point lies in `from` (CV_32FC2;
 * negative: not there), for cv::remap. */
cv::Mat ground_flow(const Camera &to, const Camera &from);

/* 255 where the mask says ground or litter and the pixel is below the horizon. */
cv::Mat ground_pixels(const cv::Mat &mask, const Camera &camera);

} // namespace outcrop::eval
#endif
