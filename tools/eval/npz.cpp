// SPDX-License-Identifier: BSD-3-Clause
// One array out of a NumPy .npz file.
#include "npz.h"

#include "error.h"

#include <cstdint>
#include <cstring>
#include <memory>
#include <regex>
#include <vector>
#include <zip.h>

namespace outcrop::eval {

namespace {

// An image of 64 Mpixel in float32; anything larger is no depth map of ours.
constexpr std::uint64_t kMaxBytes = 256u << 20;

struct ZipClose {
    void operator()(zip_t *z) const { zip_discard(z); }
};
struct ZipFileClose {
    void operator()(zip_file_t *f) const { zip_fclose(f); }
};

std::vector<char> unzip(const std::filesystem::path &file, const std::string &member)
{
    int code = 0;
    const std::unique_ptr<zip_t, ZipClose> archive(zip_open(file.c_str(), ZIP_RDONLY, &code));
    if (!archive) throw EvalError(file, "cannot be opened as an .npz archive");
    zip_stat_t stat;
    zip_stat_init(&stat);
    if (zip_stat(archive.get(), member.c_str(), 0, &stat) != 0)
        throw EvalError(file, "holds no array \"" + member + "\"");
    if (!(stat.valid & ZIP_STAT_SIZE) || stat.size > kMaxBytes)
        throw EvalError(file, member + ": size unknown or over 256 MiB");
    const std::unique_ptr<zip_file_t, ZipFileClose> in(zip_fopen(archive.get(), member.c_str(), 0));
    std::vector<char> bytes(stat.size);
    if (!in || zip_fread(in.get(), bytes.data(), stat.size) != static_cast<zip_int64_t>(stat.size))
        throw EvalError(file, member + ": cut or damaged");
    return bytes;
}

struct NpyHeader {
    std::string descr;
    int rows = 0, cols = 0;
    std::size_t data_at = 0;
};

std::string header_text(const std::vector<char> &b, std::size_t &data_at)
{
    if (b.size() < 12 || std::memcmp(b.data(), "\x93NUMPY", 6) != 0) return {};
    const auto byte = [&](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(b[i])); };
    const unsigned major = byte(6);
    if (major != 1 && major != 2) return {};
    const std::size_t start = major == 1 ? 10 : 12;
    std::size_t length = byte(8) | byte(9) << 8;
    if (major == 2) length |= byte(10) << 16 | byte(11) << 24;
    if (length > b.size() - start) return {};
    data_at = start + length;
    return {b.data() + start, length};
}

NpyHeader parse_header(const std::vector<char> &bytes, const std::filesystem::path &file, const std::string &member)
{
    NpyHeader h;
    const std::string text = header_text(bytes, h.data_at);
    if (text.empty()) throw EvalError(file, member + ": not an npy array of version 1 or 2");
    std::smatch m;
    if (!std::regex_search(text, m, std::regex("'descr'\\s*:\\s*'([^']{1,16})'")))
        throw EvalError(file, member + ": header without a plain dtype");
    h.descr = m[1];
    if (!std::regex_search(text, std::regex("'fortran_order'\\s*:\\s*False")))
        throw EvalError(file, member + ": not in C order");
    if (!std::regex_search(text, m, std::regex("'shape'\\s*:\\s*\\(\\s*(\\d{1,6})\\s*,\\s*(\\d{1,6})\\s*,?\\s*\\)")))
        throw EvalError(file, member + ": not two-dimensional");
    h.rows = std::stoi(m[1]);
    h.cols = std::stoi(m[2]);
    return h;
}

} // namespace

cv::Mat read_npz(const std::filesystem::path &file, const std::string &name)
{
    const std::string member = name + ".npy";
    const std::vector<char> bytes = unzip(file, member);
    const NpyHeader h = parse_header(bytes, file, member);
    int type = -1;
    if (h.descr == "<f4") type = CV_32F;
    if (h.descr == "<f2") type = CV_16F;
    if (h.descr == "|u1" || h.descr == "<u1") type = CV_8U;
    if (type < 0) throw EvalError(file, member + ": dtype " + h.descr + " (need <f4, <f2 or |u1)");
    if (h.rows == 0 || h.cols == 0) throw EvalError(file, member + ": empty");
    const std::uint64_t need = std::uint64_t(h.rows) * std::uint64_t(h.cols) * CV_ELEM_SIZE(type);
    if (bytes.size() - h.data_at != need)
        throw EvalError(file, member + ": " + std::to_string(bytes.size() - h.data_at) +
                                  " bytes of data where the shape needs " + std::to_string(need));
    cv::Mat out(h.rows, h.cols, type);
    std::memcpy(out.data, bytes.data() + h.data_at, need);
    if (type == CV_16F) out.convertTo(out, CV_32F);
    return out;
}

} // namespace outcrop::eval
