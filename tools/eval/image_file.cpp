// SPDX-License-Identifier: BSD-3-Clause
// Finding and reading the images of a site or a run.
#include "image_file.h"

#include "error.h"

#include <opencv2/imgcodecs.hpp>

namespace outcrop::eval {

std::string numbered(const std::string &stem, std::size_t index)
{
    const std::string digits = std::to_string(index);
    return stem + (digits.size() < 2 ? "0" : "") + digits + ".png";
}

std::optional<std::filesystem::path> find_image(const std::filesystem::path &named)
{
    if (std::filesystem::is_regular_file(named)) return named;
    for (const char *extension : {".png", ".jpg", ".jpeg"}) {
        std::filesystem::path other = named;
        other.replace_extension(extension);
        if (std::filesystem::is_regular_file(other)) return other;
    }
    return std::nullopt;
}

cv::Mat read_image(const std::filesystem::path &file, int flags)
{
    cv::Mat image;
    try {
        image = cv::imread(file.string(), flags);
    } catch (const cv::Exception &) {
        image.release();
    }
    if (image.empty()) throw EvalError(file, "cannot be read as an image");
    return image;
}

cv::Mat read_codes(const std::filesystem::path &file)
{
    cv::Mat image = read_image(file, cv::IMREAD_UNCHANGED);
    if (image.type() != CV_8UC1) throw EvalError(file, "not a single-channel 8-bit image");
    return image;
}

} // namespace outcrop::eval
