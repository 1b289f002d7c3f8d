// SPDX-License-Identifier: BSD-3-Clause
#include "rows.h"

#include <benchmark/benchmark.h>

#include "rivals.h"

namespace outcrop::bench {

namespace {

class Keeper : public benchmark::ConsoleReporter {
public:
    Keeper() : ConsoleReporter(OO_Tabular) {}

    void ReportRuns(const std::vector<Run> &reports) override
    {
        ConsoleReporter::ReportRuns(reports);
        for (const Run &run : reports) {
            if (run.error_occurred) continue;
            const auto found = run.counters.find("found");
            rows_.push_back({{"name", run.benchmark_name()},
                             {"real_ms", run.GetAdjustedRealTime()},
                             {"cpu_ms", run.GetAdjustedCPUTime()},
                             {"iterations", run.iterations},
                             {"found", found == run.counters.end() ? 0.0 : found->second.value}});
        }
    }

    const nlohmann::json &rows() const { return rows_; }

private:
    nlohmann::json rows_ = nlohmann::json::array();
};

void run_one(benchmark::State &state, const Rival &rival, const Picture &picture)
{
    const Work work = rival.make(picture.grey.size());
    std::size_t found = 0;
    for (auto _ : state) {
        found = work(picture.grey);
        benchmark::DoNotOptimize(found);
    }
    state.counters["found"] = static_cast<double>(found);
}

} // namespace

nlohmann::json run_rows(const std::vector<Picture> &pictures)
{
    for (const Picture &picture : pictures) {
        const std::string size = std::to_string(picture.grey.cols) + "x" + std::to_string(picture.grey.rows);
        for (const Rival &rival : rivals()) {
            benchmark::RegisterBenchmark(
                (rival.name + "/" + picture.name + "/" + size).c_str(),
                [&rival, &picture](benchmark::State &state) { run_one(state, rival, picture); })
                ->Unit(benchmark::kMillisecond);
        }
    }
    Keeper keeper;
    benchmark::RunSpecifiedBenchmarks(&keeper);
    return keeper.rows();
}

} // namespace outcrop::bench
