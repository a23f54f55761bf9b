// The report of compared logs in JUnit's XML, which GitHub, GitLab and Jenkins show as test cases.
// Schema: https://github.com/testmoapp/junitxml. Cold.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "proto/frame/result.hpp"

namespace posed::tools {

// One log as a test case.
struct JUnitCase {
  std::string name;  // the log's path
  double took_s = 0.0;
  std::string problem;  // why it failed; empty: it passed
};

// Replaces the file at `path` by one suite named "posed replay" with these cases. Text that XML 1.0
// cannot hold is replaced by '?'.
Result<> write_junit(const std::filesystem::path& path, std::span<const JUnitCase> cases);

}  // namespace posed::tools
