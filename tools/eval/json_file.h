/* SPDX-License-Identifier: BSD-3-Clause
 * Reading JSON with faults that name the file and the place. */
#ifndef OUTCROP_EVAL_JSON_FILE_H
#define OUTCROP_EVAL_JSON_FILE_H

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace outcrop::eval {

using Json = nlohmann::json;

/* The whole file as JSON. EvalError when it cannot be opened or parsed (with
 * line and column). */
Json read_json(const std::filesystem::path &file);

/* A value of a JSON file together with where it stands, so that every
 * accessor can say "FILE: views[3].fx: not a number". Cheap to copy; `value`
 * must outlive it. All accessors throw EvalError. */
class Node {
public:
    Node(const std::filesystem::path &file, const Json &value) : file_(&file), value_(&value) {}

    bool has(const std::string &key) const;
    bool is_array() const { return value_->is_array(); }
    bool is_string() const { return value_->is_string(); }
    bool is_number() const { return value_->is_number(); }
    Node at(const std::string &key) const;
    std::vector<Node> items() const; /* of an array */
    double number() const;           /* finite */
    int integer() const;
    std::string text() const;
    Eigen::Vector2d vector2() const;
    Eigen::Vector3d vector3() const;
    Eigen::Matrix3d matrix3() const; /* row by row */
    const Json &json() const { return *value_; }
    [[noreturn]] void fail(const std::string &fault) const;

private:
    Node(const Node &parent, const Json &value, std::string where)
        : file_(parent.file_), value_(&value), where_(std::move(where))
    {}

    const std::filesystem::path *file_;
    const Json *value_;
    std::string where_;
};

/* Metres per unit of a file: its `units`, "m" or "mm"; "m" when absent. */
double metres_per_unit(const Node &root);

} // namespace outcrop::eval
#endif
