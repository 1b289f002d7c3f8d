// SPDX-License-Identifier: BSD-3-Clause
// Write, flush, rename.
#include "site/atomic_file.h"

#include <cstdio>
#include <fstream>
#include <stdexcept>

#include <opencv2/imgcodecs.hpp>

namespace outcrop {

void write_whole(const std::string &path, const void *bytes, std::size_t n_bytes)
{
    const std::string part = path + ".part";
    bool is_written = false;
    {
        std::ofstream file(part, std::ios::binary);
        file.write(static_cast<const char *>(bytes), static_cast<std::streamsize>(n_bytes));
        is_written = static_cast<bool>(file.flush());
    }
    if (is_written && std::rename(part.c_str(), path.c_str()) == 0) return;
    std::remove(part.c_str());
    throw std::runtime_error(path + ": cannot be written");
}

void write_whole(const std::string &path, const std::string &text)
{
    write_whole(path, text.data(), text.size());
}

void write_png(const std::string &path, const cv::Mat &image)
{
    std::vector<unsigned char> bytes;
    if (!cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 4}))
        throw std::runtime_error(path + ": cannot be encoded");
    write_whole(path, bytes.data(), bytes.size());
}

} // namespace outcrop
