// The page of a benchmark's `--report`. Cold.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "daemon/tools/bench/hop_report.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/report/bench_sections.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

struct BenchPage {
  std::string command;  // "posed bench pipeline"
  std::string verdict;  // one sentence
  bool good = true;
  std::vector<report::Figure> figures;
};

// Does nothing where no report is wanted. `figures`: what `--json` prints.
[[nodiscard]] Result<> write_bench_page(const BenchPage& page,
                                        const nlohmann::ordered_json& figures,
                                        const ReportFile& file);

// What was measured, at the end of a benchmark: `figures` as JSON or what `print` prints, and the
// page where one is wanted.
[[nodiscard]] Result<> show_bench(bool as_json, const nlohmann::ordered_json& figures,
                                  const std::function<void()>& print, const BenchPage& page,
                                  const ReportFile& file);

[[nodiscard]] report::Percentiles percentiles_of(const HopFigures& figures);
// Of {"p50_us", "p99_us", "p99_9_us", "max_us"}.
[[nodiscard]] report::Percentiles percentiles_of(const nlohmann::json& figures);

// Whether others kept the CPU so busy (PSI some, percent) that a measurement does not count; and
// the sentence about it.
inline constexpr double kMostPressure_percent = 5.0;
[[nodiscard]] std::string pressure_words(double pressure_percent);

}  // namespace posed::tools
