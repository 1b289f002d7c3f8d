// SPDX-License-Identifier: BSD-3-Clause
// LCM logs: round trip, LCM's own reader and writer, and everything that may be wrong with a file.
#include "wire_log.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>

#include <gmock/gmock.h>
#include <lcm/lcm-cpp.hpp>

namespace outcrop {
namespace {

using Bytes = std::vector<char>;

class WireLog : public testing::Test {
protected:
    WireLog()
    {
        char name[] = "/tmp/outcrop_log_XXXXXX";
        dir_ = mkdtemp(name);
        file_ = dir_ + "/a.lcm";
    }
    ~WireLog() override { std::filesystem::remove_all(dir_); }

    void write(const Bytes &bytes)
    {
        std::ofstream out(file_, std::ios::binary);
        out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    }

    // Five events of 7 to 47 payload bytes.
    Bytes five_events()
    {
        LogWriter writer(file_);
        for (int i = 0; i < 5; i++) writer.write(1000 + i, i % 2 ? "OCU" : "OCD", payload(i).data(), payload(i).size());
        return bytes_of(file_);
    }

    static std::vector<std::uint8_t> payload(int i)
    {
        return std::vector<std::uint8_t>(static_cast<std::size_t>(7 + 10 * i), static_cast<std::uint8_t>(i));
    }

    static Bytes bytes_of(const std::string &file)
    {
        std::ifstream in(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    }

    // Times of the events that were read; each must be whole.
    std::vector<int> times(LogFaults *faults)
    {
        std::vector<int> out;
        *faults = read_log(file_, [&](const LogEvent &event) {
            const int i = static_cast<int>(event.utime_us) - 1000;
            out.push_back(i);
            EXPECT_EQ(event.channel, i % 2 ? "OCU" : "OCD");
            EXPECT_EQ(event.payload, payload(i)) << "event " << i;
        });
        return out;
    }

    // Where event i begins in five_events().
    static std::size_t begin_of(int i)
    {
        std::size_t at = 0;
        for (int k = 0; k < i; k++) at += 28 + 3 + payload(k).size();
        return at;
    }

    std::string dir_, file_;
};

std::string fault_of(const std::string &file)
{
    try {
        read_log(file, [](const LogEvent &) {});
    } catch (const std::runtime_error &fault) {
        return fault.what();
    }
    return "";
}

TEST_F(WireLog, reads_what_it_wrote)
{
    five_events();
    LogFaults faults;
    EXPECT_THAT(times(&faults), testing::ElementsAre(0, 1, 2, 3, 4));
    EXPECT_EQ(faults.garbage_bytes, 0u);
    EXPECT_FALSE(faults.is_cut);
}

TEST_F(WireLog, is_read_by_lcm)
{
    five_events();
    lcm::LogFile log(file_, "r");
    ASSERT_TRUE(log.good());
    for (int i = 0; i < 5; i++) {
        const lcm::LogEvent *event = log.readNextEvent();
        ASSERT_NE(event, nullptr);
        EXPECT_EQ(event->eventnum, i);
        EXPECT_EQ(event->timestamp, 1000 + i);
        EXPECT_EQ(event->channel, i % 2 ? "OCU" : "OCD");
        const auto *data = static_cast<const std::uint8_t *>(event->data);
        EXPECT_EQ(std::vector<std::uint8_t>(data, data + event->datalen), payload(i));
    }
    EXPECT_EQ(log.readNextEvent(), nullptr);
}

TEST_F(WireLog, has_the_very_bytes_that_lcm_writes)
{
    const Bytes ours = five_events();
    const std::string theirs = dir_ + "/lcm.lcm";
    {
        lcm::LogFile log(theirs, "w");
        ASSERT_TRUE(log.good());
        for (int i = 0; i < 5; i++) {
            std::vector<std::uint8_t> data = payload(i);
            lcm::LogEvent event{};
            event.channel = i % 2 ? "OCU" : "OCD";
            event.timestamp = 1000 + i;
            event.datalen = static_cast<std::int32_t>(data.size());
            event.data = data.data();
            ASSERT_EQ(log.writeEvent(&event), 0);
        }
    }
    EXPECT_EQ(bytes_of(theirs), ours);
}

TEST_F(WireLog, cut_at_any_byte_keeps_the_events_before)
{
    const Bytes whole = five_events();
    for (std::size_t n = begin_of(1); n < whole.size(); n++) {
        write(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n)));
        int n_whole = 0;
        while (n_whole < 5 && begin_of(n_whole + 1) <= n) n_whole++;
        LogFaults faults;
        const std::vector<int> read = times(&faults);
        EXPECT_EQ(static_cast<int>(read.size()), n_whole) << "cut at " << n;
        EXPECT_EQ(faults.is_cut, n != begin_of(n_whole)) << "cut at " << n;
        EXPECT_EQ(faults.garbage_bytes, 0u) << "cut at " << n;
    }
}

TEST_F(WireLog, cut_in_the_first_event_holds_nothing_and_says_so)
{
    const Bytes whole = five_events();
    for (std::size_t n = 0; n < begin_of(1); n++) {
        write(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n)));
        EXPECT_EQ(fault_of(file_), file_ + ": holds no LCM event") << "cut at " << n;
    }
}

TEST_F(WireLog, skips_garbage_between_events_and_counts_it)
{
    const Bytes whole = five_events();
    const unsigned seed = 5;
    std::mt19937 random(seed);
    for (int before = 0; before <= 5; before++) {
        for (const std::size_t n_garbage : {1u, 3u, 4u, 100u}) {
            Bytes garbage(n_garbage), bytes = whole;
            for (char &c : garbage) c = static_cast<char>(random() % 200); // not a sync word's first byte, 0xED
            bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(begin_of(before)), garbage.begin(), garbage.end());
            write(bytes);
            LogFaults faults;
            EXPECT_THAT(times(&faults), testing::ElementsAre(0, 1, 2, 3, 4)) << before << ", seed " << seed;
            EXPECT_EQ(faults.garbage_bytes, n_garbage);
            EXPECT_FALSE(faults.is_cut);
        }
    }
}

TEST_F(WireLog, garbage_inside_an_event_costs_that_event_only)
{
    const Bytes whole = five_events();
    const std::size_t in_payload = begin_of(2) + 28 + 3 + 9;
    Bytes bytes = whole;
    bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(in_payload), 50, 'x');
    write(bytes);
    std::vector<int> others;
    const LogFaults faults = read_log(file_, [&](const LogEvent &event) {
        const int i = static_cast<int>(event.utime_us) - 1000;
        if (i == 2) {
            EXPECT_NE(event.payload, payload(2)) << "the garbage has vanished";
        } else {
            EXPECT_EQ(event.payload, payload(i));
            others.push_back(i);
        }
    });
    EXPECT_THAT(others, testing::ElementsAre(0, 1, 3, 4));
    EXPECT_EQ(faults.garbage_bytes, 50u);
}

TEST_F(WireLog, an_impossible_length_costs_that_event_only)
{
    const Bytes whole = five_events();
    struct Case {
        std::size_t place; // in the event
        unsigned char bytes[4];
    };
    const Case cases[] = {{20, {0, 0, 0, 0}},    {20, {0, 0, 0, 64}}, {20, {0xff, 0xff, 0xff, 0xff}},
                          {24, {0, 0x10, 0, 1}}, {24, {0, 1, 0, 0}}, // past the end of the file, but not impossible
                          {24, {0, 0, 0, 60}},                       // into the next event
                          {24, {0x80, 0, 0, 0}}};
    for (const Case &c : cases) {
        Bytes bytes = whole;
        std::copy(c.bytes, c.bytes + 4, bytes.begin() + static_cast<std::ptrdiff_t>(begin_of(2) + c.place));
        write(bytes);
        LogFaults faults;
        EXPECT_THAT(times(&faults), testing::ElementsAre(0, 1, 3, 4)) << c.place << ": " << int{c.bytes[3]};
        EXPECT_EQ(faults.garbage_bytes, begin_of(3) - begin_of(2));
        EXPECT_FALSE(faults.is_cut);
    }
}

TEST_F(WireLog, says_in_one_line_what_is_wrong_with_a_file)
{
    EXPECT_EQ(fault_of(dir_ + "/none.lcm"), dir_ + "/none.lcm: No such file or directory");
    write({});
    EXPECT_EQ(fault_of(file_), file_ + ": holds no LCM event");
    write(Bytes(5000, 'z'));
    EXPECT_EQ(fault_of(file_), file_ + ": holds no LCM event");
    EXPECT_THAT(fault_of(dir_), testing::StartsWith(dir_ + ": "));
    EXPECT_THROW(LogWriter(dir_ + "/no/such/place.lcm"), std::runtime_error);
}

} // namespace
} // namespace outcrop
