// SPDX-License-Identifier: BSD-3-Clause
// outcrop-bench-junctions as a program: its gates hold, and what is spoilt on purpose is seen for what it is.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Exit code, and what was printed to `text`.
int run(const std::string &arguments, std::string &text)
{
    const std::string command = std::string(OUTCROP_BENCH_PROGRAM) + " " + arguments + " 2>&1";
    FILE *pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) return -1;
    text.clear();
    std::array<char, 4096> part;
    for (std::size_t n; (n = fread(part.data(), 1, part.size(), pipe)) > 0;) text.append(part.data(), n);
    const int status = pclose(pipe);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

constexpr const char *kChecked = "accuracy --quick --no-rivals --check ";

TEST(bench_run, the_gates_hold)
{
    std::string text;
    EXPECT_EQ(run(kChecked, text), 0) << text;
    EXPECT_THAT(text, AllOf(HasSubstr("gates: "), Not(HasSubstr("MISSED")), Not(HasSubstr("NOT KNOWN"))));
}

TEST(bench_run, sees_junctions_a_tenth_of_a_pixel_off)
{
    std::string text;
    EXPECT_EQ(run(std::string(kChecked) + "--set chess --plant-shift 0.1", text), 1) << text;
    EXPECT_THAT(text, AllOf(HasSubstr("rmse_px <= 0.01: MISSED"), Not(HasSubstr("angle_rmse_deg <= 0.08: MISSED"))));
}

TEST(bench_run, sees_branches_a_degree_off)
{
    std::string text;
    EXPECT_EQ(run(std::string(kChecked) + "--set chess --plant-turn 1", text), 1) << text;
    EXPECT_THAT(text, AllOf(HasSubstr("angle_rmse_deg <= 0.08: MISSED"), Not(HasSubstr("rmse_px <= 0.01: MISSED"))));
}

TEST(bench_run, sees_one_junction_in_twenty_lost)
{
    std::string text;
    EXPECT_EQ(run(std::string(kChecked) + "--set chess --plant-drop 20", text), 1) << text;
    EXPECT_THAT(text, AllOf(HasSubstr("recall >= 0.999: MISSED"), HasSubstr("precision >= 0.999: met")));
}

TEST(bench_run, a_check_that_judges_nothing_is_no_pass)
{
    std::string text;
    EXPECT_EQ(run(std::string(kChecked) + "--set polys --variance 400", text), 1) << text;
    EXPECT_THAT(text, HasSubstr("gates: 0 of 0 met"));
}

TEST(bench_run, writes_what_it_prints)
{
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / ("outcrop-bench-" + std::to_string(getpid()) + ".json");
    std::string text;
    ASSERT_EQ(run("accuracy --quick --set chess --variance 0 --lambda 10 --json " + file.string(), text), 0) << text;
    std::ifstream stream(file);
    const nlohmann::json written = nlohmann::json::parse(stream);
    std::filesystem::remove(file);
    EXPECT_EQ(written.at("bench"), "accuracy");
    const nlohmann::json &rows = written.at("result");
    ASSERT_EQ(rows.size(), 5u); // fixed, grown, grown-auto, thesis, gftt+subpix
    char recall[32];
    std::snprintf(recall, sizeof recall, "%.3f", rows[0].at("figures").at("recall").get<double>());
    EXPECT_THAT(text, HasSubstr(recall));
}

TEST(bench_run, says_what_it_skips_and_refuses_what_it_does_not_know)
{
    std::string text;
    EXPECT_EQ(run("chess-stereo --real /nowhere", text), 0);
    EXPECT_THAT(text, HasSubstr("SKIPPED"));
    EXPECT_EQ(run("thesis --figure 3.10 --sites /nowhere", text), 0);
    EXPECT_THAT(text, HasSubstr("SKIPPED"));
    EXPECT_EQ(run("accuracy --set nonsense", text), 2);
    EXPECT_EQ(run("", text), 2);
    EXPECT_EQ(run("accuracy --quick --set chess --json /nowhere/x.json", text), 1);
}

} // namespace
