#include "daemon/cli/live/live_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <spdlog/fmt/fmt.h>

#include "daemon/cli/live/monitor_line.hpp"
#include "daemon/cli/paint.hpp"
#include "models/stages/registry.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/sink.hpp"
#include "proto/frame/time.hpp"
#include "proto/text/clean.hpp"

namespace posed::cli {
namespace {

constexpr int kMinWidth = 80;
constexpr int kNameWidth = 11;

// Cuts or pads to exactly `width` columns (names are ASCII); 0: neither.
std::string fit(const std::string& text, int width) {
  if (width == 0) return text.substr(0, text.find_last_not_of(' ') + 1);
  return fmt::format("{:<{}}", cut(text, width), width);
}

// Columns for a whole line, for stream names and for model names; 0: no limit.
struct Widths {
  int line = kMinWidth;
  int name = kNameWidth;
  int model = 1;
};

// A count in at most 5 characters.
std::string short_count(std::uint64_t count) {
  if (count < 100'000) return std::to_string(count);
  if (count < 10'000'000) return fmt::format("{}k", count / 1000);
  return fmt::format("{}M", std::min<std::uint64_t>(count / 1'000'000, 9999));
}

// "-" for a stage that processed no frame in this second.
std::string stage(const v1::Percentiles& percentiles) {
  if (percentiles.p99_us() == 0.0F && percentiles.max_us() == 0.0F) return "-";
  return short_duration(percentiles.p50_us()) + "/" + short_duration(percentiles.p99_us());
}

std::string head(const v1::Stats& stats, const LiveViewOptions& options) {
  std::string line = fmt::format("{}   {} stream{}", options.title, stats.stream_size(),
                                 stats.stream_size() == 1 ? "" : "s");
  if (options.silence.empty()) {
    line += fmt::format("   cpu {:.1f} %   rss {:.1f} MB", stats.cpu_percent(),
                        static_cast<double>(stats.rss_bytes()) / 1e6);
  }
  if (!stats.recorder_file().empty()) {
    line += fmt::format("   rec {} lost {} errors {}", clean_name(stats.recorder_file()),
                        stats.recorder_lost_chunks(), stats.recorder_errors());
  }
  if (stats.has_take()) {
    line += fmt::format("   take {}", stats.take().number());
    if (!stats.take().name().empty()) line += " " + in_quotes(stats.take().name());
  }
  return line;
}

// An unplugged device is shown as such, not only as a stream without data.
std::string state_of(const v1::StreamStats& stream) {
  return stream.away() ? "away" : clean_name(stream.state());
}

// "-" for a stream whose stages have no alpha.
std::string alpha_of(const v1::StreamStats& stream) {
  bool has = stream.stage().empty();
  for (const v1::StageStats& stage : stream.stage()) {
    for (const v1::ParameterStats& parameter : stage.parameter()) {
      has = has || parameter.name() == "alpha";
    }
  }
  return has ? fmt::format("{:.2f}", stream.alpha()) : "-";
}

std::string row(const v1::StreamStats& stream, const Widths& widths, bool silent) {
  const std::string rate =
      silent ? "-" : fmt::format("{:.1f}", std::min(stream.rate_hz(), 9999.9F));
  const auto now = [&](const v1::Percentiles& times) { return silent ? "-" : stage(times); };
  return fmt::format("{} {} {:>6} {:>5} {:>5} {:>9} {:>9} {:>9} {:>5} {}",
                     fit(clean_name(stream.stream()), widths.name),
                     fit(silent ? "?" : state_of(stream), 7), rate, short_count(stream.dropped()),
                     short_count(stream.shed()), now(stream.decode()), now(stream.stages()),
                     now(stream.publish()), alpha_of(stream),
                     fit(clean_name(stream.model()), widths.model));
}

// A line below the stream's row about its stages; empty if there is nothing to report.
std::string stages_row(const v1::StreamStats& stream) {
  std::string text = label_words(stream);
  const auto add = [&](const std::string& words) { text += (text.empty() ? "" : ", ") + words; };
  // If there is a single stage, the column already shows its time.
  for (const v1::StageStats& one : stream.stage()) {
    if (stream.stage_size() > 1) add(clean_name(one.name()) + " " + stage(one.time()));
  }
  if (stream.lag_frames() > 0) {
    add(fmt::format("lag {} frame{} ({:.0f} ms)", stream.lag_frames(),
                    stream.lag_frames() == 1 ? "" : "s", stream.lag_ms()));
  }
  // Parameters that differ from their defaults; alpha has its own column.
  for (const v1::StageStats& one : stream.stage()) {
    const StageType* type = find_stage_type(one.name());
    for (const v1::ParameterStats& parameter : one.parameter()) {
      const ParameterSpec* spec =
          type == nullptr ? nullptr : find_parameter(type->parameters, parameter.name());
      if (spec == nullptr || !spec->live || parameter.name() == "alpha") continue;
      const double usual = number_of(*spec, spec->default_value) * spec->people_scale;
      if (parameter.value() == usual) continue;
      add(fmt::format("{}.{} {}", clean_name(one.name()), parameter.name(),
                      people_text(*spec, parameter.value() / spec->people_scale)));
    }
  }
  if (stream.has_style_gate()) add(fmt::format("gate {:.2f}", stream.style_gate()));
  if (stream.has_style_estimate()) add(fmt::format("style {:.2f}", stream.style_estimate()));
  // As far as the column shows, alpha has reached its target.
  if (std::abs(stream.alpha_target() - stream.alpha()) >= 0.005F) {
    add(fmt::format("alpha slides to {:.2f}", stream.alpha_target()));
  }
  return text;
}

// "8 s", "5 min", "2.5 h"
std::string for_people(double time_s) {
  if (time_s < 120.0) return fmt::format("{:.0f} s", std::max(time_s, 0.0));
  if (time_s < 7200.0) return fmt::format("{:.0f} min", time_s / 60.0);
  return fmt::format("{:.1f} h", time_s / 3600.0);
}

// What the kernel dropped of a device's datagrams; empty if it dropped none.
std::string kernel_words(std::uint64_t dropped) {
  if (dropped == 0) return {};
  return fmt::format("the kernel dropped {} datagrams (machine too slow)", dropped);
}

// Whether a glove is connected, how its clock runs and what the kernel dropped; empty for a stream
// without any of it. The drops of a body's device are in the row of its source.
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
    // avoids -0.0
    const float drift_ppm = std::round(stream.clock_drift_ppm() * 10.0F) / 10.0F + 0.0F;
    add(fmt::format("clock {:+.3f} s, drift {:+.1f} ppm", seconds(stream.clock_offset_ns()),
                    drift_ppm));
  }
  if (!stream.device_info().empty()) add(clean(stream.identity()));
  const std::uint64_t dropped = stream.source_name().empty() ? stream.kernel_dropped() : 0;
  if (dropped > 0) add(kernel_words(dropped));
  return text;
}

// Which body of which source the stream is, and why posed cannot serve it; empty if it is no body.
std::string body_row(const v1::StreamStats& stream) {
  std::string text;
  if (!stream.source_name().empty()) {
    text = fmt::format("body {} of {}", in_quotes(stream.body()), clean_name(stream.source_name()));
  }
  if (stream.refusal().empty()) return text;
  return text + (text.empty() ? "" : ": ") + clean(stream.refusal());
}

// Why nothing comes of a device with several bodies.
std::string without_body(const v1::SourceStats& source) {
  if (source.away()) return "the device is away";
  std::string text = "no body is streamed";
  const auto count = [&](Outcome outcome) {
    const int i = static_cast<int>(outcome);
    return i < source.outcome_size() ? source.outcome(i) : 0;
  };
  const std::uint64_t heard = count(Outcome::kOk), foreign = count(Outcome::kForeign);
  const std::uint64_t damaged =
      count(Outcome::kShort) + count(Outcome::kBadChecksum) + count(Outcome::kOutOfRange);
  if (heard + foreign + damaged == 0) return text + ": nothing came from the device yet";
  return text + fmt::format(": {} packets were right, {} damaged, {} of another device or sender",
                            heard, damaged, foreign);
}

// A line below the streams' rows about a device with several bodies; empty if there is nothing to
// report.
std::string source_row(const v1::SourceStats& source) {
  std::string text = source.streams() == 0 ? without_body(source) : "";
  const std::string dropped = kernel_words(source.kernel_dropped());
  if (!text.empty() && !dropped.empty()) text += ", ";
  return text + dropped;
}

// "3 receivers, 1200 frames, 3600 sent"
std::string output_row(const v1::OutputStats& output) {
  std::string text = fmt::format(
      "{} output: {} receiver{}, {} frames, {} sent", clean_name(output.kind()), output.receivers(),
      output.receivers() == 1 ? "" : "s", output.frames(), output.sent());
  if (output.dropped() > 0) text += fmt::format(", {} dropped", output.dropped());
  if (output.failures() > 0) text += fmt::format(", {} failed", output.failures());
  return text;
}

// The lines below the rows of the streams.
std::vector<std::string> rows_below(const v1::Stats& stats, const Widths& widths) {
  std::vector<std::string> rows;
  if (!stats.replay_file().empty()) rows.push_back("  " + replay_words(stats));
  for (const v1::SourceStats& source : stats.source()) {
    const std::string text = source_row(source);
    if (text.empty()) continue;
    rows.push_back("  " + fit(clean_name(source.name()), widths.name - 1) + text);
  }
  for (const v1::OutputStats& output : stats.output()) {
    // Names with their stream's behind the kind are often too long for the column.
    rows.push_back("  " + fit(clean_name(output.name()), widths.name - 2) + " " +
                   output_row(output));
  }
  for (const v1::StreamStats& stream : stats.stream()) {
    for (const std::string& text :
         {body_row(stream), device_row(stream, stats.time_ns()),
          stream.refusal().empty() ? stages_row(stream) : std::string()}) {
      if (text.empty()) continue;
      rows.push_back("  " + fit(clean_name(stream.stream()), widths.name - 1) + text);
    }
  }
  return rows;
}

Widths widths_for(const v1::Stats& stats, int wanted) {
  if (wanted > 0) return {.line = std::max(wanted, kMinWidth)};
  Widths widths{.line = 0, .model = 0};
  for (const v1::StreamStats& stream : stats.stream()) {
    widths.name = std::max(widths.name, static_cast<int>(stream.stream().size()) + 2);
  }
  for (const v1::OutputStats& output : stats.output()) {
    widths.name = std::max(widths.name, static_cast<int>(output.name().size()) + 2);
  }
  return widths;
}

const char* colour_of(const v1::StreamStats& stream) {
  if (stream.dropped() > 0 || stream.shed() > 0 || !stream.refusal().empty()) return kRed;
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

const char* const kColumnsHelp = R"(Columns, one row a stream:
  STATE    waiting (nothing came yet), live, stale (fell silent), away (device unplugged), ended,
           refused (a stage cannot serve this body; below the row is why)
  HZ       frames published in the last second
  DROP     frames lost so far because a queue was full (machine too slow)
  SHED     frames skipped so far because newer ones were waiting
  DECODE   from arrival to decoded, STAGES in all stages together, PUBLISH from arrival to handed
           out: 50 % of the frames of the last second took at most the first figure, 99 % the
           second; microseconds, with m milliseconds, with s seconds; - where no frame passed
  ALPHA    how much style, -2 to 2; below the row its target, while it moves
  MODEL    the style model in use, or the gesture model
Below the rows, of a style: gate, 1 where the model knows the motion to 0 where it is passed
through; style, what the input shows of it already, 0 like its source to 1 like its target)";

std::vector<std::string> live_view(const v1::Stats& stats, const LiveViewOptions& options) {
  Widths widths = widths_for(stats, options.width);
  const bool silent = !options.silence.empty();
  const std::string names =
      fmt::format("{} {} {:>6} {:>5} {:>5} {:>9} {:>9} {:>9} {:>5} ", fit("STREAM", widths.name),
                  fit("STATE", 7), "HZ", "DROP", "SHED", "DECODE", "STAGES", "PUBLISH", "ALPHA");
  if (widths.line > 0) widths.model = std::max(1, widths.line - static_cast<int>(names.size()));
  std::vector<std::string> lines{
      paint(options.colour, kBold, fit(head(stats, options), widths.line)),
      paint(options.colour, kDim, fit(names + fit("MODEL", widths.model), widths.line)),
  };
  // If the daemon is silent, the first line says so, because everything below it is old.
  if (silent)
    lines.insert(lines.begin(), paint(options.colour, kRed, fit(options.silence, widths.line)));
  // Streams first; those that do not fit are at least counted.
  const int above = static_cast<int>(lines.size());
  const int room = options.height == 0 ? stats.stream_size() : options.height - above - 1;
  const int shown = stats.stream_size() <= room ? stats.stream_size() : std::max(0, room - 1);
  for (int i = 0; i < shown; ++i) {
    const char* const colour = silent ? kDim : colour_of(stats.stream(i));
    const std::string text = fit(row(stats.stream(i), widths, silent), widths.line);
    lines.push_back(paint(options.colour, colour, text));
  }
  if (shown < stats.stream_size()) {
    lines.push_back(fmt::format("... and {} more", stats.stream_size() - shown));
  }
  const auto fits = [&] {
    return options.height == 0 || static_cast<int>(lines.size()) + 1 < options.height;
  };
  if (!silent) {
    for (const std::string& below : rows_below(stats, widths)) {
      if (fits()) lines.push_back(fit(below, widths.line));
    }
  }
  lines.push_back(
      paint(options.colour, kDim,
            fit("stage times: p50/p99 in us (m: ms), publish counts from arrival", widths.line)));
  const std::size_t left =
      options.height == 0
          ? options.notes.size()
          : static_cast<std::size_t>(std::max(0, options.height - static_cast<int>(lines.size())));
  const std::size_t first = options.notes.size() - std::min(left, options.notes.size());
  for (std::size_t i = first; i < options.notes.size(); ++i) {
    lines.push_back(fit(options.notes[i], widths.line));
  }
  return lines;
}

}  // namespace posed::cli
