#include "daemon/cli/live_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <spdlog/fmt/fmt.h>

#include "daemon/cli/paint.hpp"
#include "daemon/config/words.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/time.hpp"

namespace posed::cli {
namespace {

constexpr int kLeastWidth = 80;
constexpr int kNameWidth = 11;

// Cut or padded to exactly `width` columns (names are ASCII).
std::string fit(const std::string& text, int width) {
  return fmt::format("{:<{}}", cut(text, width), width);
}

// A count in at most 5 characters.
std::string short_count(std::uint64_t count) {
  if (count < 100'000) return std::to_string(count);
  if (count < 10'000'000) return fmt::format("{}k", count / 1000);
  return fmt::format("{}M", std::min<std::uint64_t>(count / 1'000'000, 9999));
}

std::string stage(const v1::Percentiles& percentiles) {
  return short_duration(percentiles.p50_us()) + "/" + short_duration(percentiles.p99_us());
}

// How long the daemon has been on this machine's clock is not known; its own numbers are.
std::string head(const v1::Stats& stats, const std::string& title) {
  std::string line = fmt::format("{}   {} stream{}   cpu {:.1f} %   rss {:.1f} MB", title,
                                 stats.stream_size(), stats.stream_size() == 1 ? "" : "s",
                                 stats.cpu_percent(), static_cast<double>(stats.rss_bytes()) / 1e6);
  if (!stats.recorder_file().empty()) {
    line += fmt::format("   rec {} lost {} errors {}", stats.recorder_file(),
                        stats.recorder_lost_chunks(), stats.recorder_errors());
  }
  return line;
}

// A device that is not there is more than a stream in which nothing comes.
std::string state_of(const v1::StreamStats& stream) {
  return stream.away() ? "away" : stream.state();
}

std::string row(const v1::StreamStats& stream, int model_width) {
  return fmt::format(
      "{} {} {:>6.1f} {:>5} {:>5} {:>9} {:>9} {:>9} {:>5.2f} {}", fit(stream.stream(), kNameWidth),
      fit(state_of(stream), 7), std::min(stream.rate_hz(), 9999.9F), short_count(stream.dropped()),
      short_count(stream.shed()), stage(stream.decode()), stage(stream.style()),
      stage(stream.publish()), stream.alpha(), fit(config::printable(stream.model()), model_width));
}

// What a hand does, below its row; empty for a stream that has neither lag nor label.
std::string hand_row(const v1::StreamStats& stream) {
  std::string text;
  if (!stream.label().empty()) {
    text = fmt::format("label {} ({:.0f} %)", config::printable(stream.label()),
                       100.0F * stream.label_probability());
  }
  if (stream.lag_frames() > 0) {
    text += fmt::format("{}lag {} frame{} ({:.0f} ms)", text.empty() ? "" : ", ",
                        stream.lag_frames(), stream.lag_frames() == 1 ? "" : "s", stream.lag_ms());
  }
  return text;
}

// "8 s", "5 min", "2.5 h"
std::string for_people(double time_s) {
  if (time_s < 120.0) return fmt::format("{:.0f} s", std::max(time_s, 0.0));
  if (time_s < 7200.0) return fmt::format("{:.0f} min", time_s / 60.0);
  return fmt::format("{:.1f} h", time_s / 3600.0);
}

// Whether a glove is there and how its clock runs; empty for a stream without either.
std::string device_row(const v1::StreamStats& stream, std::int64_t now_ns) {
  const std::string since = for_people(seconds(now_ns - stream.link_ns()));
  const std::uint64_t links = stream.connections();
  if (stream.away()) {
    if (links == 0) return "not there yet; posed has looked for it for " + since;
    return fmt::format("away for {}; connected {} before", since,
                       links == 1 ? "once" : fmt::format("{} times", links));
  }
  std::string text;
  const auto add = [&](const std::string& words) { text += (text.empty() ? "" : ", ") + words; };
  if (links > 1) {
    add(fmt::format("back for {}, reconnected {}", since,
                    links == 2 ? "once" : fmt::format("{} times", links - 1)));
  }
  if (stream.has_clock_offset_ns()) {
    const float drift_ppm = std::round(stream.clock_drift_ppm() * 10.0F) / 10.0F + 0.0F;  // no -0.0
    add(fmt::format("clock {:+.3f} s, drift {:+.1f} ppm", seconds(stream.clock_offset_ns()),
                    drift_ppm));
  }
  if (!stream.greeting().empty()) add(config::without_controls(stream.identity()));
  return text;
}

// What stands below the streams' rows.
std::vector<std::string> rows_below(const v1::Stats& stats) {
  std::vector<std::string> rows;
  for (const v1::StreamStats& stream : stats.stream()) {
    for (const std::string& text : {device_row(stream, stats.time_ns()), hand_row(stream)}) {
      if (!text.empty()) rows.push_back("  " + fit(stream.stream(), kNameWidth - 1) + text);
    }
  }
  return rows;
}

const char* colour_of(const v1::StreamStats& stream) {
  if (stream.dropped() > 0 || stream.shed() > 0) return kRed;
  if (stream.away() || stream.state() == "stale" || stream.state() == "waiting") return kYellow;
  return stream.state() == "ended" ? kDim : "";
}

}  // namespace

std::string short_duration(double microseconds) {
  if (microseconds < 999.5) return fmt::format("{:.0f}", microseconds);
  if (microseconds < 9'950) return fmt::format("{:.1f}m", microseconds * 1e-3);
  if (microseconds < 999'500) return fmt::format("{:.0f}m", microseconds * 1e-3);
  return fmt::format("{:.0f}s", std::min(microseconds * 1e-6, 999.0));
}

std::vector<std::string> live_view(const v1::Stats& stats, const LiveViewOptions& options) {
  const int width = std::max(options.width, kLeastWidth);
  const std::string names =
      fmt::format("{} {} {:>6} {:>5} {:>5} {:>9} {:>9} {:>9} {:>5} ", fit("STREAM", kNameWidth),
                  fit("STATE", 7), "HZ", "DROP", "SHED", "DECODE", "STYLE", "PUBLISH", "ALPHA");
  const int model_width = std::max(1, width - static_cast<int>(names.size()));
  std::vector<std::string> lines{
      paint(options.colour, kBold, fit(head(stats, options.title), width)),
      paint(options.colour, kDim, fit(names + fit("MODEL", model_width), width)),
  };
  // Streams first; what does not fit is at least counted.
  const int room = options.height == 0 ? stats.stream_size() : options.height - 3;
  const int shown = stats.stream_size() <= room ? stats.stream_size() : std::max(0, room - 1);
  for (int i = 0; i < shown; ++i) {
    lines.push_back(
        paint(options.colour, colour_of(stats.stream(i)), row(stats.stream(i), model_width)));
  }
  if (shown < stats.stream_size()) {
    lines.push_back(fmt::format("... and {} more", stats.stream_size() - shown));
  }
  for (const std::string& below : rows_below(stats)) {
    const bool fits = options.height == 0 || static_cast<int>(lines.size()) + 1 < options.height;
    if (fits) lines.push_back(fit(below, width));
  }
  lines.push_back(
      paint(options.colour, kDim,
            fit("stage times: p50/p99 in us (m: ms), publish counts from arrival", width)));
  const std::size_t left =
      options.height == 0
          ? options.notes.size()
          : static_cast<std::size_t>(std::max(0, options.height - static_cast<int>(lines.size())));
  const std::size_t first = options.notes.size() - std::min(left, options.notes.size());
  for (std::size_t i = first; i < options.notes.size(); ++i) {
    lines.push_back(fit(options.notes[i], width));
  }
  return lines;
}

}  // namespace posed::cli
