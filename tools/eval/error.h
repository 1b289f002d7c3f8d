/* SPDX-License-Identifier: BSD-3-Clause
 * The one exception of outcrop-eval, and the list of notes a run gathers. */
#ifndef OUTCROP_EVAL_ERROR_H
#define OUTCROP_EVAL_ERROR_H

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace outcrop::eval {

/* A file that cannot be read or is ill-formed. what() is one line that names
 * the file and the fault; main prints it and exits 1. */
class EvalError : public std::runtime_error {
public:
    EvalError(const std::filesystem::path &file, const std::string &fault)
        : std::runtime_error(file.string() + ": " + fault)
    {}
};

/* Why a figure is null, one line each, in the order found. */
using Notes = std::vector<std::string>;

} // namespace outcrop::eval
#endif
