#include "daemon/tools/live/live_table.hpp"

#include <algorithm>
#include <functional>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/command/paint.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

constexpr int kNameWidth = 11;  // that a name has before the model's is cut
constexpr int kLeastName = 6;   // the heading
constexpr int kLeastModel = 5;  // a model's name that is cut further is no help
constexpr float kMostHz = 9999.9F;

struct Health {
  std::string word;
  const char* colour;
};

// An unplugged device is shown as such, not only as a stream without data.
Health health_of(const v1::StreamStats& stream, bool silent) {
  if (silent) return {"?", kDim};
  if (!stream.refusal().empty()) return {clean_name(stream.state()), kRed};
  if (stream.away()) return {"away", kYellow};
  if (stream.state() == "ended") return {"ended", kDim};
  if (stream.state() != "live") return {clean_name(stream.state()), kYellow};
  return has_lost(stream) ? Health{"lossy", kRed} : Health{"live", kGreen};
}

bool has_times(const v1::Percentiles& times) { return times.p99_us() > 0.0F; }

struct Column {
  std::string title;
  int width = 0;       // 0: as the text is
  bool right = false;  // aligned to the right
  std::function<std::string(const v1::StreamStats&)> text;
  std::function<const char*(const v1::StreamStats&)> colour = nullptr;
};

std::string fitted(const Column& column, const std::string& text) {
  if (column.width == 0) return text;
  return column.right ? fmt::format("{:>{}}", cut(text, column.width), column.width)
                      : fmt::format("{:<{}}", cut(text, column.width), column.width);
}

bool any(const v1::Stats& stats, const std::function<bool(const v1::StreamStats&)>& is) {
  return std::ranges::any_of(stats.stream(), is);
}

int longest(const v1::Stats& stats, const std::function<std::string(const v1::StreamStats&)>& of) {
  int columns = 0;
  for (const v1::StreamStats& stream : stats.stream()) {
    columns = std::max(columns, static_cast<int>(of(stream).size()));
  }
  return columns;
}

std::string name_of(const v1::StreamStats& stream) { return clean_name(stream.stream()); }
std::string model_of(const v1::StreamStats& stream) { return clean_name(stream.model()); }

// The columns between the stream's name and its model.
std::vector<Column> numbers(const v1::Stats& stats, bool silent) {
  std::vector<Column> columns;
  columns.push_back(
      {.title = "STATE",
       .width = 7,
       .text = [silent](const auto& stream) { return health_of(stream, silent).word; },
       .colour = [silent](const auto& stream) { return health_of(stream, silent).colour; }});
  if (!silent) {
    columns.push_back({.title = "HZ", .width = 6, .right = true, .text = [](const auto& stream) {
                         return fmt::format("{:.1f}", std::min(stream.rate_hz(), kMostHz));
                       }});
  }
  if (!silent && any(stats, [](const auto& stream) { return has_times(stream.publish()); })) {
    const auto add = [&](const char* title, float (v1::Percentiles::*time)() const) {
      columns.push_back(
          {.title = title, .width = 8, .right = true, .text = [time](const auto& stream) {
             const v1::Percentiles& times = stream.publish();
             return has_times(times) ? people_duration((times.*time)()) : std::string("-");
           }});
    };
    add("LATENCY", &v1::Percentiles::p50_us);
    add("99 %", &v1::Percentiles::p99_us);
  }
  if (any(stats, has_alpha)) {
    columns.push_back({.title = "ALPHA", .width = 5, .right = true, .text = [](const auto& stream) {
                         return has_alpha(stream) ? fmt::format("{:.2f}", stream.alpha()) : "-";
                       }});
  }
  return columns;
}

// All columns, as wide as fits.
std::vector<Column> columns_of(const v1::Stats& stats, const LiveTableOptions& options) {
  std::vector<Column> columns = numbers(stats, options.silent);
  Column name{.title = "STREAM", .text = name_of};
  Column model{.title = "MODEL", .text = model_of};
  const int names = std::max(longest(stats, name_of), kLeastName);
  const int models = std::max(longest(stats, model_of), kLeastModel);
  bool has_model = longest(stats, model_of) > 0;
  name.width = names;
  if (options.width > 0) {
    int room = options.width - (options.chosen.empty() ? 0 : 2);
    for (const Column& column : columns) room -= column.width + 1;
    for (; room < kLeastName && columns.size() > 1; columns.pop_back()) {
      room += columns.back().width + 1;
    }
    const int for_models = has_model ? models + 1 : 0;
    name.width = std::max(std::min({names, room, std::max(kNameWidth, room - for_models)}), 1);
    model.width = room - name.width - 1;
    has_model = has_model && model.width >= kLeastModel;
  }
  columns.insert(columns.begin(), std::move(name));
  if (has_model) columns.push_back(std::move(model));
  return columns;
}

// The cells beside each other.
std::string row_of(const std::vector<Column>& columns, const LiveTableOptions& options,
                   const v1::StreamStats& stream) {
  const bool chosen = !options.chosen.empty() && stream.stream() == options.chosen;
  std::string row = options.chosen.empty() ? "" : chosen ? "> " : "  ";
  for (const Column& column : columns) {
    if (&column != &columns.front()) row += " ";
    const char* const colour = column.colour ? column.colour(stream) : chosen ? kBold : "";
    row +=
        paint(options.colour, options.silent ? kDim : colour, fitted(column, column.text(stream)));
  }
  return options.width == 0 ? row.substr(0, row.find_last_not_of(' ') + 1) : row;
}

}  // namespace

bool has_alpha(const v1::StreamStats& stream) {
  for (const v1::StageStats& stage : stream.stage()) {
    for (const v1::ParameterStats& parameter : stage.parameter()) {
      if (parameter.name() == "alpha") return true;
    }
  }
  return false;
}

bool has_lost(const v1::StreamStats& stream) { return stream.dropped() > 0 || stream.shed() > 0; }

std::string people_duration(double microseconds) {
  const double ms = microseconds * 1e-3;
  if (ms < 999.95) return fmt::format("{:.1f} ms", ms);
  return fmt::format("{:.1f} s", std::min(ms * 1e-3, 9999.9));
}

std::vector<std::string> live_table(const v1::Stats& stats, const LiveTableOptions& options) {
  const std::vector<Column> columns = columns_of(stats, options);
  std::string heading = options.chosen.empty() ? "" : "  ";
  for (const Column& column : columns) {
    heading += (&column == &columns.front() ? "" : " ") + fitted(column, column.title);
  }
  if (options.width > 0) heading = cut(heading, options.width);
  std::vector<std::string> lines{paint(options.colour, kDim, heading)};
  const int streams = stats.stream_size();
  const int room = options.rows == 0 ? streams : options.rows - 1;
  const int shown = streams <= room ? streams : std::max(0, room - 1);
  int first = 0;
  for (int i = 0; i < streams; ++i) {
    if (stats.stream(i).stream() == options.chosen) first = std::max(0, i - shown + 1);
  }
  for (int i = first; i < first + shown && i < streams; ++i) {
    lines.push_back(row_of(columns, options, stats.stream(i)));
  }
  if (shown < streams) lines.push_back(fmt::format("... and {} more", streams - shown));
  return lines;
}

}  // namespace posed::tools
