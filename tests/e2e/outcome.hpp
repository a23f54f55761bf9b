// Runs the real binary to its end.
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "tests/support/has.hpp"
#include "tests/support/process.hpp"

namespace posed::test {

struct ProgramOutcome {
  int code;
  std::string out, err;
};

inline ProgramOutcome posed(std::vector<std::string> arguments,
                            std::chrono::milliseconds within = Process::kPatience) {
  Process process(std::move(arguments));
  const std::string out = process.rest();
  const auto code = process.exit_code(within);
  REQUIRE(code);
  return {*code, out, process.errors()};
}

// Whether it ended with this code and said `what` on stderr and nothing on stdout.
inline bool one_sentence(const ProgramOutcome& outcome, int code, const std::string& what) {
  UNSCOPED_INFO(outcome.code << ": " << outcome.err);
  return outcome.code == code && outcome.out.empty() && in_order(outcome.err, what);
}

}  // namespace posed::test
