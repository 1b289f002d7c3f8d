// SPDX-License-Identifier: BSD-3-Clause
// Vertices and triangles of a PLY file.
#include "ply.h"

#include "error.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

namespace outcrop::eval {

namespace {

struct Property {
    std::string name;
    std::string type;       // of the value, or of a list's items
    std::string count_type; // empty: not a list
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

// Reads scalars in file order, whatever the encoding; every fault names the file.
class Scalars {
public:
    Scalars(std::istream &in, bool is_ascii, const std::filesystem::path &file)
        : in_(in), is_ascii_(is_ascii), file_(file)
    {}

    double next(const std::string &type)
    {
        if (is_ascii_) {
            double x = 0;
            if (!(in_ >> x)) throw EvalError(file_, "ends early or holds no number");
            return x;
        }
        if (type == "float" || type == "float32") return raw<float>();
        if (type == "double" || type == "float64") return raw<double>();
        if (type == "uchar" || type == "uint8") return raw<std::uint8_t>();
        if (type == "char" || type == "int8") return raw<std::int8_t>();
        if (type == "ushort" || type == "uint16") return raw<std::uint16_t>();
        if (type == "short" || type == "int16") return raw<std::int16_t>();
        if (type == "uint" || type == "uint32") return raw<std::uint32_t>();
        if (type == "int" || type == "int32") return raw<std::int32_t>();
        throw EvalError(file_, "unknown property type " + type);
    }

private:
    template <typename T>
    double raw()
    {
        T x;
        if (!in_.read(reinterpret_cast<char *>(&x), sizeof x)) throw EvalError(file_, "ends early");
        return static_cast<double>(x);
    }

    std::istream &in_;
    bool is_ascii_;
    const std::filesystem::path &file_;
};

struct Header {
    bool is_ascii = false;
    std::vector<Element> elements;
};

bool parse_line(const std::string &line, Header &header)
{
    std::istringstream in(line);
    std::string word;
    in >> word;
    if (word == "comment" || word == "obj_info" || word.empty()) return true;
    if (word == "format") {
        in >> word;
        header.is_ascii = word == "ascii";
        return header.is_ascii || word == "binary_little_endian";
    }
    if (word == "element") {
        Element e;
        if (!(in >> e.name >> e.count)) return false;
        header.elements.push_back(e);
        return true;
    }
    if (word != "property" || header.elements.empty()) return false;
    Property p;
    in >> p.type;
    if (p.type == "list") in >> p.count_type >> p.type;
    if (!(in >> p.name)) return false;
    header.elements.back().properties.push_back(p);
    return true;
}

Header read_header(std::istream &in, const std::filesystem::path &file)
{
    const auto next_line = [&] {
        std::string line;
        if (!std::getline(in, line)) throw EvalError(file, "PLY header ends early");
        if (!line.empty() && line.back() == '\r') line.pop_back();
        return line;
    };
    if (next_line() != "ply") throw EvalError(file, "not a PLY file");
    Header header;
    for (std::string line = next_line(); line != "end_header"; line = next_line())
        if (!parse_line(line, header)) throw EvalError(file, "PLY header: cannot read \"" + line + "\"");
    return header;
}

void read_vertices(const Element &e, Scalars &in, double unit_m, Mesh &mesh, const std::filesystem::path &file)
{
    for (std::size_t i = 0; i < e.count; i++) {
        Eigen::Vector3d v = Eigen::Vector3d::Constant(std::nan(""));
        for (const Property &p : e.properties) {
            if (!p.count_type.empty()) throw EvalError(file, "a vertex with a list property");
            const double x = in.next(p.type);
            if (p.name.size() == 1 && p.name[0] >= 'x' && p.name[0] <= 'z') v[p.name[0] - 'x'] = x;
        }
        if (!v.allFinite()) throw EvalError(file, "a vertex whose x, y, z are not finite");
        mesh.vertices.push_back(v * unit_m);
    }
}

void add_fan(const std::vector<double> &ring, Mesh &mesh, const std::filesystem::path &file)
{
    for (const double index : ring)
        if (!(index >= 0) || !(index < static_cast<double>(mesh.vertices.size())))
            throw EvalError(file, "a face with a vertex index out of range");
    const auto at = [&](std::size_t i) { return static_cast<std::uint32_t>(ring[i]); };
    for (std::size_t i = 2; i < ring.size(); i++) mesh.triangles.push_back({at(0), at(i - 1), at(i)});
}

void read_element(const Element &e, Scalars &in, Mesh &mesh, const std::filesystem::path &file)
{
    for (std::size_t i = 0; i < e.count; i++) {
        for (const Property &p : e.properties) {
            const double n = p.count_type.empty() ? 1 : in.next(p.count_type);
            if (!(n >= 0) || n > 1000) throw EvalError(file, "a list longer than 1000");
            std::vector<double> values;
            for (double k = 0; k < n; k++) values.push_back(in.next(p.type));
            const bool is_ring = p.name == "vertex_indices" || p.name == "vertex_index";
            if (e.name == "face" && is_ring) add_fan(values, mesh, file);
        }
    }
}

} // namespace

Mesh read_ply(const std::filesystem::path &file, double unit_m)
{
    std::ifstream in(file, std::ios::binary);
    if (!in || std::filesystem::is_directory(file)) throw EvalError(file, "cannot be opened");
    const Header header = read_header(in, file);
    Scalars scalars(in, header.is_ascii, file);
    Mesh mesh;
    for (const Element &e : header.elements) {
        if (e.properties.empty() && e.count > 0) throw EvalError(file, "an element without properties");
        if (e.name == "vertex")
            read_vertices(e, scalars, unit_m, mesh, file);
        else
            read_element(e, scalars, mesh, file);
    }
    return mesh;
}

} // namespace outcrop::eval
