// SPDX-License-Identifier: BSD-3-Clause
// Configuration files, two children, and a summary.
#include "drive.h"

#include <poll.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "children.h"

namespace outcrop {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::json;
using clock = std::chrono::steady_clock;

constexpr const char *kDownUrl = "udpm://239.255.76.67:7667?ttl=0";
constexpr const char *kUpUrl = "udpm://239.255.76.68:7668?ttl=0";
constexpr double kReadyTimeoutS = 20;

void write_text(const fs::path &file, const std::string &text)
{
    std::ofstream out(file);
    out << text;
    if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

std::string yaml_text(const fs::path &path)
{
    std::string out = "\"";
    for (const char c : fs::absolute(path).string()) {
        if (c == '"' || c == '\\') out += '\\';
        out += c;
    }
    return out + "\"";
}

// "images:CODEC:Q" as keys of outcropd.yaml's link section.
std::string link_keys(const std::string &link)
{
    if (link == "layers") return "";
    const std::string lead = "images:";
    const std::size_t colon = link.rfind(':');
    const std::string codec = colon > lead.size() ? link.substr(lead.size(), colon - lead.size()) : "";
    const std::string quality = colon == std::string::npos ? "" : link.substr(colon + 1);
    const bool is_quality = !quality.empty() && quality.size() <= 3 &&
                            quality.find_first_not_of("0123456789") == std::string::npos && std::stoi(quality) >= 1 &&
                            std::stoi(quality) <= 100;
    if (link.rfind(lead, 0) != 0 || (codec != "jpeg" && codec != "webp") || !is_quality)
        throw std::runtime_error("--link: must be layers, images:jpeg:Q or images:webp:Q with Q in 1..100, not " +
                                 link);
    return "  send: images\n  codec: " + codec + "\n  quality: " + quality + "\n";
}

void write_configs(const DriveOptions &options, const std::string &path_file)
{
    const fs::path vehicle = fs::path(options.out) / "vehicle", base = fs::path(options.out) / "base";
    const std::string datagram = std::to_string(options.datagram_bytes);
    write_text(vehicle / "outcropd.yaml",
               std::string("vehicle: 1\nstored_views: 256\nlink:\n  down_url: \"") + kDownUrl + "\"\n  up_url: \"" +
                   kUpUrl + "\"\n  datagram_bytes: " + datagram + "\n" + link_keys(options.link) + "source:\n  site: " +
                   yaml_text(vehicle / "cameras.json") + "\n  period_ms: 20\njunctions:\n  method: " + options.method +
                   "\ndebug_dump: " + yaml_text(vehicle) + "\n");
    std::string text = std::string("vehicle: 1\ndown_url: \"") + kDownUrl + "\"\nup_url: \"" + kUpUrl +
                       "\"\ndatagram_bytes: " + datagram + "\nout: " + yaml_text(options.out) +
                       "\nas: " + options.represent + "\ntextures: " + (options.with_textures ? "true" : "false") +
                       "\nmethod: " + options.method + "\nresume: false\nexit_when_settled: true\n";
    if (!path_file.empty()) text += "path: " + yaml_text(path_file) + "\n";
    write_text(base / "outcrop-base.yaml", text);
}

fs::path own_folder()
{
    return fs::read_symlink("/proc/self/exe").parent_path();
}

double seconds_since(clock::time_point begin)
{
    return std::chrono::duration<double>(clock::now() - begin).count();
}

void pass_on(const std::string &line)
{
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
}

void await_ready(Child &base)
{
    const auto begin = clock::now();
    bool is_ready = false;
    while (!is_ready) {
        pollfd fd{base.fd(), POLLIN, 0};
        poll(&fd, 1, 100);
        base.read([&](const std::string &line) {
            is_ready = is_ready || line == "outcrop-base: ready";
            if (line != "outcrop-base: ready") pass_on(line);
        });
        if (!is_ready && base.poll_exit() >= 0) throw std::runtime_error("outcrop-base ended before it was ready");
        if (!is_ready && seconds_since(begin) > kReadyTimeoutS)
            throw std::runtime_error("outcrop-base was not ready in time");
    }
}

void await_settled(Child &base, Child &vehicle, double timeout_s)
{
    const auto begin = clock::now();
    while (base.poll_exit() < 0) {
        pollfd fds[2] = {{base.fd(), POLLIN, 0}, {vehicle.fd(), POLLIN, 0}};
        poll(fds, 2, 100);
        base.read(pass_on);
        vehicle.read(pass_on);
        if (vehicle.poll_exit() >= 0)
            throw std::runtime_error("outcropd ended with status " + std::to_string(vehicle.poll_exit()));
        if (seconds_since(begin) > timeout_s)
            throw std::runtime_error("the base had not settled after " + std::to_string(timeout_s) + " s");
    }
    base.read(pass_on);
    if (base.poll_exit() != 0)
        throw std::runtime_error("outcrop-base ended with status " + std::to_string(base.poll_exit()));
}

// The base knows views by number; whoever drives a site folder knows their pictures.
void name_images(const std::string &out, const std::map<int, std::string> &names)
{
    const fs::path file = fs::path(out) / "model" / "cameras.json";
    std::ifstream in(file);
    json root = json::parse(in);
    for (json &view : root.at("views")) {
        const auto name = names.find(view.at("index").get<int>());
        if (name != names.end()) view["image"] = name->second;
    }
    write_text(file, root.dump(1) + "\n");
}

void add_options(const DriveOptions &options)
{
    const fs::path file = fs::path(options.out) / "report.json";
    std::ifstream in(file);
    json report = json::parse(in);
    const Perturbation &p = options.site.perturbation;
    report["options"]["site"] = options.site.site;
    report["options"]["link"] = options.link;
    report["options"]["mtu"] = options.datagram_bytes;
    report["options"]["images"] = options.site.images;
    report["options"]["perturb"] = p.is_on ? json(std::to_string(p.seed) + ":" + p.kind) : json(nullptr);
    write_text(file, report.dump(1) + "\n");
}

} // namespace

void check_link(const std::string &link)
{
    link_keys(link);
}

void drive(const DriveOptions &options)
{
    const fs::path out = options.out;
    check_link(options.link);        // say what is wrong before anything is made
    fs::remove(out / "report.json"); // the sign of a finished run
    fs::create_directories(out / "vehicle");
    fs::create_directories(out / "base");
    const ReportedSite site = write_reported_site(options.site, (out / "vehicle" / "cameras.json").string());
    write_configs(options, options.path.empty() ? site.path_file : options.path);

    Child base(own_folder() / "outcrop-base", {"live", "--config", (out / "base" / "outcrop-base.yaml").string()});
    await_ready(base);
    Child vehicle(own_folder() / "outcropd", {"--config", (out / "vehicle" / "outcropd.yaml").string()});
    await_settled(base, vehicle, options.timeout_s);
    const int status = vehicle.stop(10);
    vehicle.read(pass_on);
    if (status != 0) throw std::runtime_error("outcropd ended with status " + std::to_string(status));
    name_images(options.out, site.image_names);
    add_options(options);
}

void print_summary(const std::string &out)
{
    std::ifstream report_file(fs::path(out) / "report.json"), model_file(fs::path(out) / "model" / "obstacles.json");
    const json report = json::parse(report_file), model = json::parse(model_file);
    std::printf("\nBytes on the link (LCM payload, channel and header; with UDP/IP in brackets)\n");
    for (const auto &[layer, bytes] : report.at("bytes").items()) {
        if (layer == "total" || bytes.get<std::uint64_t>() == 0) continue;
        std::printf("  %-11s %8lu (%lu) in %lu messages\n", layer.c_str(), bytes.get<unsigned long>(),
                    report["bytes_ip"][layer].get<unsigned long>(), report["messages"][layer].get<unsigned long>());
    }
    std::printf("  %-11s %8lu (%lu)\n", "total", report["bytes"]["total"].get<unsigned long>(),
                report["bytes_ip"]["total"].get<unsigned long>());
    std::printf("\nObstacles\n");
    for (const json &box : model.at("obstacles")) {
        const auto size = box["obb"]["size"].get<std::vector<double>>();
        const auto centre = box["obb"]["centre"].get<std::vector<double>>();
        std::printf("  %d: %.3f x %.3f m, %.3f m high at (%.3f, %.3f), yaw %.1f deg, %d points\n",
                    box["index"].get<int>(), size[0], size[1], size[2], centre[0], centre[1],
                    box["obb"]["yaw_deg"].get<double>(), box["points"].get<int>());
    }
    std::printf("\nWritten: %s/report.json, model/, matches.json, overhead.png, link.lcm", out.c_str());
    if (!report["sequence"].is_null())
        std::printf(", sequence/%s/%s", report["sequence"]["as"].get<std::string>().c_str(),
                    report["sequence"]["video"].get<bool>() ? " and its .mp4" : "");
    std::printf("\n");
}

} // namespace outcrop
