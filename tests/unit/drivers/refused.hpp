// What a driver refuses before it opens anything.
#pragma once

#include <catch2/catch.hpp>

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "drivers/driver.hpp"

namespace posed::test {

// Each of these options is wrong use, and the sentence has this word.
inline void check_refused(const drivers::Driver& driver,
                          const std::vector<std::pair<drivers::Options, std::string>>& wrong) {
  for (const auto& [options, word] : wrong) {
    INFO(word);
    const auto expected = driver.expect(options);
    REQUIRE_FALSE(expected);
    INFO(expected.error().message);
    CHECK(expected.error().exit_code == ExitCode::kWrongUse);
    CHECK(expected.error().message.find(word) != std::string::npos);
  }
}

// None of these texts is a description of the driver's (Description::text).
inline void check_undescribed(const drivers::Driver& driver,
                              std::initializer_list<const char*> texts) {
  for (const char* text : texts) {
    INFO(text);
    CHECK_FALSE(driver.describe(text, "x"));
  }
}

}  // namespace posed::test
