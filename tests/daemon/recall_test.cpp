// SPDX-License-Identifier: BSD-3-Clause
// UTC as people write it.
#include "recall.h"

#include <ctime>

#include <gtest/gtest.h>

namespace outcrop {
namespace {

TEST(ParseUtc, UnderstandsDatesAndMicroseconds)
{
    EXPECT_EQ(parse_utc("1970-01-01T00:00:00Z"), 0);
    EXPECT_EQ(parse_utc("2004-01-01T00:00:00Z"), 1072915200000000);
    EXPECT_EQ(parse_utc("2024-02-29T23:59:59.25Z"), 1709251199250000);
    EXPECT_EQ(parse_utc("2024-02-29T23:59:59.1234567Z"), 1709251199123456);
    EXPECT_EQ(parse_utc("1072915200000001"), 1072915200000001);
}

TEST(ParseUtc, AgreesWithTheSystemOnEveryDayOfACentury)
{
    for (std::time_t t = 86399; t < 4102444800; t += 86400 * 7 + 3607) {
        char text[32];
        std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&t));
        ASSERT_EQ(parse_utc(text), static_cast<std::int64_t>(t) * 1000000) << text;
    }
}

TEST(ParseUtc, RefusesWhatIsNoTime)
{
    for (const char *text :
         {"", "now", "2024-02-30T00:00:00Z", "2023-02-29T00:00:00Z", "2024-13-01T00:00:00Z", "2024-00-01T00:00:00Z",
          "2024-01-01T24:00:00Z", "2024-01-01T00:60:00Z", "2024-01-01T00:00:00", "2024-01-01 00:00:00Z",
          "2024-01-01T00:00:00.Z", "2024-01-01T00:00:00.5xZ", "2024-01-01T00:00:00+01:00", "1969-12-31T23:59:59Z",
          "99999999999999999", "-5", "1e9", "12345678901234567890"})
        EXPECT_THROW(parse_utc(text), std::runtime_error) << text;
}

} // namespace
} // namespace outcrop
