#include <array>
#include <utility>

#include "daemon/tools/report/bench_sections.hpp"
#include "daemon/tools/report/plot.hpp"

namespace posed::report {

Figure percentile_bars(const PercentileBars& all) {
  using Member = double Percentiles::*;
  constexpr std::array<std::pair<const char*, Member>, 4> kRows{
      {{"half are below (p50)", &Percentiles::p50_us},
       {"99 % are below", &Percentiles::p99_us},
       {"99.9 % are below", &Percentiles::p999_us},
       {"the longest", &Percentiles::max_us}}};
  Bars bars{.quantity = all.quantity,
            .unit = "us, logarithmic",
            .series = {},
            .groups = {},
            .rules = {},
            .logarithmic = true};
  Table table{.columns = {{"", false}, {"p50 [us]"}, {"p99 [us]"}, {"p99.9 [us]"}, {"max [us]"}},
              .rows = {}};
  for (const auto& [name, member] : kRows) bars.groups.push_back({name, {}});
  for (const Measured& peer : all.peers) {
    bars.series.push_back(peer.name);
    std::vector<std::string> row{peer.name};
    for (std::size_t r = 0; r < kRows.size(); ++r) {
      const double value = peer.percentiles.*kRows[r].second;
      bars.groups[r].values.push_back(value);
      row.push_back(number_text(value, 1));
    }
    table.rows.push_back(std::move(row));
  }
  return {.title = all.title,
          .sentence = all.sentence,
          .drawings = {draw_bars(bars)},
          .tables = {std::move(table)}};
}

Figure paired_bars(const PairedBars& all) {
  Bars bars{.quantity = all.quantity,
            .unit = all.unit,
            .series = all.series,
            .groups = {},
            .rules = {},
            .logarithmic = false,
            .digits = all.digits};
  for (const PairedBars::Row& row : all.rows) bars.groups.push_back({row.name, row.values});
  return {
      .title = all.title, .sentence = all.sentence, .drawings = {draw_bars(bars)}, .tables = {}};
}

Figure all_numbers(const std::string& title, const std::string& sentence,
                   const std::vector<NamedNumber>& numbers) {
  Table table{.columns = {{"name", false}, {"value"}}, .rows = {}};
  for (const NamedNumber& number : numbers) table.rows.push_back({number.name, number.value});
  return {.title = title, .sentence = sentence, .drawings = {}, .tables = {std::move(table)}};
}

}  // namespace posed::report
