#include "daemon/tools/bench/bench_report.hpp"

#include <cstdio>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "daemon/tools/command/json_numbers.hpp"
#include "proto/text/json_text.hpp"

namespace posed::tools {

Result<> write_bench_page(const BenchPage& page, const nlohmann::ordered_json& figures,
                          const ReportFile& file) {
  if (!file.wanted()) return {};
  report::Page out("Measurement", page.command);
  out.verdict(page.verdict, page.good);
  out.section("Distributions");
  for (const report::Figure& figure : page.figures) out.add(figure);
  const auto numbers = numbers_of(figures);
  if (!numbers.empty()) {
    out.section("Numbers");
    out.add(report::all_numbers("Every number", "`" + page.command + " --help` explains them.",
                                numbers));
  }
  add_json(figures, out);
  return report::write_page(out, file.path);
}

Result<> show_bench(bool as_json, const nlohmann::ordered_json& figures,
                    const std::function<void()>& print, const BenchPage& page,
                    const ReportFile& file) {
  if (as_json) {
    std::printf("%s\n", json_text(figures, 2).c_str());
  } else {
    print();
  }
  return write_bench_page(page, figures, file);
}

report::Percentiles percentiles_of(const HopFigures& figures) {
  return {.p50_us = figures.p50_us,
          .p99_us = figures.p99_us,
          .p999_us = figures.p999_us,
          .max_us = figures.max_us};
}

report::Percentiles percentiles_of(const nlohmann::json& figures) {
  return {.p50_us = figures["p50_us"].get<double>(),
          .p99_us = figures["p99_us"].get<double>(),
          .p999_us = figures["p99_9_us"].get<double>(),
          .max_us = figures["max_us"].get<double>()};
}

std::string pressure_words(double pressure_percent) {
  if (pressure_percent < 0.0) return "; the kernel does not say how busy the CPU was";
  return fmt::format(
      "; others kept the CPU busy for {:.1f} % of the time{}", pressure_percent,
      pressure_percent > kMostPressure_percent ? ", too much: repeat on a quiet machine" : "");
}

}  // namespace posed::tools
