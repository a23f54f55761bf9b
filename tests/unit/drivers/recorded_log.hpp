// A recorded device log as text, and its driver's output: each device has such a pair of files
// (tests/golden/devices/NAME.log and NAME.chk).
//
//   # what was recorded, of which device, when, by whom
//   driver template_glove
//   identity left index finger
//   text template_glove hand=left  a line of the description; repeated, they are joined by line
//   ends at 1000000 hex 47 20 31       a chunk that came at this time [ns], as bytes at 2000000
//   line 0 0 0 90      the same as text, with its line end at 3000000 bodies 02 01 00    from here
//   on the bodies of this description are used, as bytes
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/driver.hpp"

namespace posed::test {

struct RecordedLog {
  std::string driver;
  std::string identity;
  std::string text;
  struct Row {
    std::int64_t arrival_ns = 0;
    std::vector<std::byte> bytes;
    bool bodies = false;  // a description in use, not a chunk
  };
  std::vector<Row> rows;
};

// A row of such a log; `form` is "hex" or "bodies".
[[nodiscard]] std::string recorded_row(std::int64_t at_ns, std::string_view form,
                                       std::span<const std::byte> bytes);

[[nodiscard]] RecordedLog read_recorded_log(const std::filesystem::path& path);

// One line for each frame, sample and description, and one that counts outcomes.
[[nodiscard]] std::string decoded_lines(const RecordedLog& log);

// The first line in which two such texts differ by more than 1e-5 in a number or at all in a word;
// empty when they agree.
[[nodiscard]] std::string first_difference(const std::string& got, const std::string& expected);

// Writes the expected output of a log, unless the file agrees already: other rounding is no reason
// to change it.
void update_expected(const std::filesystem::path& path, const std::string& got);

// The whole file; empty if there is none.
[[nodiscard]] std::string expected_lines(const std::filesystem::path& path);

}  // namespace posed::test
