// SPDX-License-Identifier: BSD-3-Clause
// Reading JSON with faults that name the file and the place.
#include "json_file.h"

#include "error.h"

#include <cmath>
#include <fstream>
#include <sstream>

namespace outcrop::eval {

namespace {

std::string slurp(const std::filesystem::path &file)
{
    std::ifstream in(file, std::ios::binary);
    if (!in || std::filesystem::is_directory(file)) throw EvalError(file, "cannot be opened");
    std::ostringstream text;
    text << in.rdbuf();
    if (in.bad()) throw EvalError(file, "cannot be read");
    return text.str();
}

// The library's own message spans lines and shows its internals; the place is
// what the reader needs.
std::string place_of(const std::string &text, std::size_t byte)
{
    std::size_t line = 1, column = 1;
    for (std::size_t i = 0; i + 1 < byte && i < text.size(); i++) {
        column++;
        if (text[i] == '\n') {
            line++;
            column = 1;
        }
    }
    return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

} // namespace

Json read_json(const std::filesystem::path &file)
{
    const std::string text = slurp(file);
    try {
        return Json::parse(text);
    } catch (const Json::parse_error &e) {
        throw EvalError(file, "not valid JSON at " + place_of(text, e.byte));
    }
}

void Node::fail(const std::string &fault) const
{
    throw EvalError(*file_, where_.empty() ? fault : where_ + ": " + fault);
}

bool Node::has(const std::string &key) const
{
    return value_->is_object() && value_->contains(key) && !value_->at(key).is_null();
}

Node Node::at(const std::string &key) const
{
    if (!value_->is_object()) fail("not an object");
    if (!value_->contains(key)) fail("has no \"" + key + "\"");
    return {*this, value_->at(key), where_.empty() ? key : where_ + "." + key};
}

std::vector<Node> Node::items() const
{
    if (!value_->is_array()) fail("not an array");
    std::vector<Node> out;
    out.reserve(value_->size());
    for (std::size_t i = 0; i < value_->size(); i++)
        out.push_back({*this, (*value_)[i], where_ + "[" + std::to_string(i) + "]"});
    return out;
}

double Node::number() const
{
    if (!value_->is_number()) fail("not a number");
    const double x = value_->get<double>();
    if (!std::isfinite(x)) fail("not finite");
    return x;
}

int Node::integer() const
{
    const double x = number();
    if (x != std::floor(x) || !(std::abs(x) <= 1e9)) fail("not an integer");
    return static_cast<int>(x);
}

std::string Node::text() const
{
    if (!value_->is_string()) fail("not a string");
    return value_->get<std::string>();
}

Eigen::Vector2d Node::vector2() const
{
    const auto e = items();
    if (e.size() != 2) fail("not 2 numbers");
    return {e[0].number(), e[1].number()};
}

Eigen::Vector3d Node::vector3() const
{
    const auto e = items();
    if (e.size() != 3) fail("not 3 numbers");
    return {e[0].number(), e[1].number(), e[2].number()};
}

Eigen::Matrix3d Node::matrix3() const
{
    const auto rows = items();
    if (rows.size() != 3) fail("not 3 rows");
    Eigen::Matrix3d m;
    for (int r = 0; r < 3; r++) m.row(r) = rows[static_cast<std::size_t>(r)].vector3().transpose();
    return m;
}

double metres_per_unit(const Node &root)
{
    if (!root.has("units")) return 1.0;
    const std::string units = root.at("units").text();
    if (units == "m") return 1.0;
    if (units == "mm") return 1e-3;
    root.at("units").fail("neither \"m\" nor \"mm\"");
}

} // namespace outcrop::eval
