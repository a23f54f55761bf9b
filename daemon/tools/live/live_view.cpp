#include "daemon/tools/live/live_view.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/command/paint.hpp"
#include "daemon/tools/live/monitor_line.hpp"
#include "models/stages/registry.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/sink.hpp"
#include "proto/frame/time.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"

namespace posed::tools {
namespace {

constexpr int kNameWidth = 11;  // to which a stream's name is cut before the model's is
constexpr int kMinName = 6;     // the heading
constexpr int kMinModel = 5;    // a model's name that is cut further is no help
constexpr float kMaxShown_hz = 9999.9F;
constexpr float kKnown = 0.95F;   // of a motion; only a smaller share is worth a word
constexpr float kMinTold = 0.1F;  // of what the input has of the style; less is within the error

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
  return stream.lossy() ? Health{"lossy", kRed} : Health{"live", kGreen};
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
                         return fmt::format("{:.1f}", std::min(stream.rate_hz(), kMaxShown_hz));
                       }});
  }
  if (!silent && any(stats, [](const auto& stream) { return has_times(stream.publish()); })) {
    const auto add = [&](const char* title, float (v1::Percentiles::*time)() const) {
      columns.push_back(
          {.title = title, .width = 8, .right = true, .text = [time](const auto& stream) {
             const v1::Percentiles& times = stream.publish();
             return has_times(times) ? display_duration((times.*time)() * 1e-6) : std::string("-");
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
  const int names = std::max(longest(stats, name_of), kMinName);
  const int models = std::max(longest(stats, model_of), kMinModel);
  bool has_model = longest(stats, model_of) > 0;
  name.width = names;
  if (options.width > 0) {
    int room = options.width - (options.chosen.empty() ? 0 : 2);
    for (const Column& column : columns) room -= column.width + 1;
    for (; room < kMinName && columns.size() > 1; columns.pop_back()) {
      room += columns.back().width + 1;
    }
    const int for_models = has_model ? models + 1 : 0;
    name.width = std::max(std::min({names, room, std::max(kNameWidth, room - for_models)}), 1);
    model.width = room - name.width - 1;
    has_model = has_model && model.width >= kMinModel;
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

std::string display_duration(double time_s) {
  if (time_s < 0.99995) return fmt::format("{:.1f} ms", std::max(time_s, 0.0) * 1e3);
  if (time_s < 9.95) return fmt::format("{:.1f} s", time_s);
  if (time_s < 120.0) return fmt::format("{:.0f} s", time_s);
  if (time_s < 7200.0) return fmt::format("{:.0f} min", time_s / 60.0);
  return fmt::format("{:.1f} h", std::min(time_s / 3600.0, 9999.9));
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

namespace {

constexpr int kMinWidth = 20;
constexpr int kNoteRows = 3;  // that the table and the panel leave to the notes

// The daemon in one line. What no longer fits is left out: the processor and the memory first.
std::string head(const v1::Stats& stats, const LiveViewOptions& options) {
  std::vector<std::string> parts;
  if (stats.has_take()) {
    parts.push_back(fmt::format("take {}", stats.take().number()));
    if (!stats.take().name().empty()) parts.back() += " " + in_quotes(stats.take().name());
  }
  if (!stats.recorder_file().empty()) {
    parts.push_back("rec " + clean_name(stats.recorder_file()));
    const auto add = [&](const char* what, std::uint64_t count) {
      if (count > 0) parts.back() += fmt::format(" {} {}", what, count);
    };
    add("lost", stats.recorder_lost_chunks());
    add("errors", stats.recorder_errors());
  }
  const int streams = stats.stream_size();
  parts.push_back(fmt::format("{} stream{}", streams, streams == 1 ? "" : "s"));
  if (options.silence.empty()) {
    parts.push_back(fmt::format("cpu {:.1f} %", stats.cpu_percent()));
    parts.push_back(fmt::format("{:.1f} MB", static_cast<double>(stats.rss_bytes()) / 1e6));
  }
  std::string line = options.title;
  for (const std::string& part : parts) {
    const int columns = static_cast<int>(line.size() + part.size()) + 3;
    if (options.width == 0 || columns <= options.width) line += "   " + part;
  }
  return line;
}

// As the config writes it; empty for the default. Texts, such as the weights of styles, are empty
// by default.
std::string unusual_value(const ParameterSpec& spec, const v1::ParameterStats& parameter) {
  if (!has_number(spec)) return clean_name(parameter.text());
  const double usual = number_of(spec, spec.default_value) * spec.display_scale;
  if (parameter.value() == usual) return {};
  return display_text(spec, parameter.value() / spec.display_scale);
}

// How often a robot was stopped, and by what just now; empty if never.
std::string robot_words(const v1::StreamStats& stream) {
  const std::uint64_t stops = stream.robot_stops() + stream.robot_hard_stops();
  if (stops + stream.robot_holds() + stream.robot_limited() == 0) return {};
  std::string text =
      fmt::format("robot: stops {} (hard {}), holds {}, limited commands {}", stops,
                  stream.robot_hard_stops(), stream.robot_holds(), stream.robot_limited());
  if (!stream.robot_stop_joint().empty()) {
    text += fmt::format(", stopped by {} and {}", clean_name(stream.robot_stop_joint()),
                        clean_name(stream.robot_stop_other()));
  }
  return text;
}

// What people read for a stage, here and on the page.
std::string words_of(const v1::StageStats& stage) {
  const StageType* type = find_stage_type(stage.name());
  return type == nullptr || type->words.empty() ? clean_name(stage.name())
                                                : std::string(type->words);
}

// What the style's model makes of the input, where it is worth a word.
std::string input_words(const v1::StreamStats& stream) {
  std::string text;
  if (stream.has_style_gate() && stream.style_gate() <= kKnown) {
    text = fmt::format("knows the motion to {:.0f} %", 100.0F * stream.style_gate());
  }
  if (stream.has_style_estimate() && stream.style_estimate() >= kMinTold) {
    text += fmt::format("{}has {:.0f} % of the style before it", text.empty() ? "" : ", ",
                        100.0F * stream.style_estimate());
  }
  return text;
}

// A line below the stream's row about its stages; empty if there is nothing to report.
std::string stages_row(const v1::StreamStats& stream) {
  std::string text = label_words(stream);
  const auto add = [&](const std::string& words) { add_word(text, words); };
  for (const v1::StageStats& one : stream.stage()) {
    if (one.time().p99_us() == 0.0F) continue;  // it processed no frame in this second
    add(words_of(one) + " " + display_duration(one.time().p99_us() * 1e-6));
  }
  if (stream.lag_frames() > 0) {
    add(fmt::format("lag {} frame{} ({:.1f} ms)", stream.lag_frames(),
                    stream.lag_frames() == 1 ? "" : "s", stream.lag_ms()));
  }
  // Parameters that differ from their defaults; alpha has its own column. Before the first frame
  // nobody has reported them.
  for (const v1::StageStats& one : stream.stage()) {
    if (stream.frames() == 0) break;
    const StageType* type = find_stage_type(one.name());
    for (const v1::ParameterStats& parameter : one.parameter()) {
      const ParameterSpec* spec =
          type == nullptr ? nullptr : find_parameter(type->parameters, parameter.name());
      if (spec == nullptr || !spec->live || parameter.name() == "alpha") continue;
      const std::string value = unusual_value(*spec, parameter);
      if (value.empty()) continue;
      add(fmt::format("{}.{} {}", clean_name(one.name()), parameter.name(), value));
    }
  }
  if (stream.gate_dropped() >= 0.001F) {
    add(fmt::format("{}: {:.1f} % dropped", clean_name(stream.gate_joint()),
                    100.0F * stream.gate_dropped()));
  }
  if (const std::string words = robot_words(stream); !words.empty()) add(words);
  if (const std::string words = input_words(stream); !words.empty()) add(words);
  // As far as the column shows, alpha has reached its target.
  if (std::abs(stream.alpha_target() - stream.alpha()) >= 0.005F) {
    add(fmt::format("alpha slides to {:.2f}", stream.alpha_target()));
  }
  return text;
}

// What the kernel dropped of a device's datagrams; empty if it dropped none.
std::string kernel_words(std::uint64_t dropped) {
  if (dropped == 0) return {};
  return fmt::format("the kernel dropped {} datagrams (machine too slow)", dropped);
}

// Whether a glove is connected, how its clock runs and what the kernel dropped; empty for a stream
// without any of it. The drops of a body's device are in the row of its source.
std::string device_row(const v1::StreamStats& stream, std::int64_t now_ns) {
  const std::string since = display_duration(seconds(now_ns - stream.link_ns()));
  const std::uint64_t links = stream.connections();
  if (stream.away()) {
    if (links == 0) return "not there yet; posed has looked for it for " + since;
    return fmt::format("away for {}; connected {} before", since,
                       links == 1 ? "once" : fmt::format("{} times", links));
  }
  std::string text;
  const auto add = [&](const std::string& words) { add_word(text, words); };
  if (links > 1) {
    add(fmt::format("back for {}, reconnected {}", since,
                    links == 2 ? "once" : fmt::format("{} times", links - 1)));
  }
  if (stream.has_clock_offset_ns()) {
    // avoids -0.0
    const float drift_ppm = std::round(stream.clock_drift_ppm() * 10.0F) / 10.0F + 0.0F;
    add(fmt::format("clock drift {:+.1f} ppm", drift_ppm));
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

// A camera is switched on when somebody likes, so its silence is no fault.
bool is_camera(const v1::SourceStats& source) { return source.driver() == "landmarks"; }

// Why a camera shows no hand. Who writes a tracker sees which of its messages are refused, and why.
std::string without_hand(std::uint64_t valid, std::uint64_t torn, std::uint64_t odd,
                         std::uint64_t foreign) {
  std::string text = "no hand: its camera is off, or sees none";
  if (torn + odd + foreign == 0) return text;
  text += fmt::format("; refused of {} messages so far:", valid + torn + odd + foreign);
  const auto add = [&](std::uint64_t count, const char* why) {
    if (count > 0) text += fmt::format("{} {} ({})", text.ends_with(":") ? "" : ",", count, why);
  };
  add(torn, "no whole JSON object with 63 numbers a hand");
  add(odd, "points of no hand, or another side than left and right");
  add(foreign, "not version 1 of landmarks, or a hand that came less than three times");
  return text;
}

// Why nothing comes of a device with several bodies.
std::string without_body(const v1::SourceStats& source) {
  if (source.away()) return "the device is away";
  std::string text = "no body is streamed";
  const auto count = [&](Outcome outcome) {
    const int i = static_cast<int>(outcome);
    return i < source.outcome_size() ? source.outcome(i) : 0;
  };
  if (is_camera(source)) {
    return without_hand(count(Outcome::kOk), count(Outcome::kShort), count(Outcome::kOutOfRange),
                        count(Outcome::kForeign));
  }
  const std::uint64_t valid = count(Outcome::kOk), foreign = count(Outcome::kForeign);
  const std::uint64_t damaged =
      count(Outcome::kShort) + count(Outcome::kBadChecksum) + count(Outcome::kOutOfRange);
  if (valid + foreign + damaged == 0) return text + ": nothing came from the device yet";
  return text + fmt::format(
                    ": {} packets were right, {} damaged, {} of another sender or no known "
                    "body",
                    valid, damaged, foreign);
}

// A line below the streams' rows about a device with several bodies; empty if there is nothing to
// report.
std::string source_row(const v1::SourceStats& source) {
  const bool silent = std::ranges::all_of(source.outcome(), [](auto count) { return count == 0; });
  if (is_camera(source) && silent) return {};  // nobody has asked for it
  std::string text = source.streams() == 0 ? without_body(source) : "";
  const std::string dropped = kernel_words(source.kernel_dropped());
  if (!text.empty() && !dropped.empty()) text += ", ";
  return text + dropped;
}

// What of the stream did not come out; empty if everything did.
std::string lost_row(const v1::StreamStats& stream) {
  if (!has_lost(stream)) return {};
  std::string text;
  if (stream.dropped() > 0) {
    text = fmt::format("{} dropped because a queue was full, ", stream.dropped());
  }
  if (stream.shed() > 0) text += fmt::format("{} skipped for newer ones, ", stream.shed());
  return "frames: " + text + "so far (machine too slow)";
}

// "vmc output, 3 receivers, 1200 frames, 3600 sent"
std::string output_row(const v1::OutputStats& output) {
  std::string text = fmt::format(
      "{} output, {} receiver{}, {} frames, {} sent", clean_name(output.kind()), output.receivers(),
      output.receivers() == 1 ? "" : "s", output.frames(), output.sent());
  if (output.dropped() > 0) text += fmt::format(", {} dropped", output.dropped());
  if (output.failures() > 0) text += fmt::format(", {} failed", output.failures());
  return text;
}

// A line about one stream: its colour and its text, which may be empty.
struct Detail {
  const char* colour;
  std::string text;
};

// The details of a stream, what is wrong first; with `only_wrong` nothing else.
std::vector<Detail> details_of(const v1::StreamStats& stream, std::int64_t now_ns,
                               bool only_wrong) {
  const bool refused = !stream.refusal().empty();
  std::vector<Detail> details;
  if (stream.lossy() || !only_wrong)
    details.push_back({stream.lossy() ? kRed : "", lost_row(stream)});
  if (refused || !only_wrong) details.push_back({refused ? kRed : "", body_row(stream)});
  if (stream.away() || !only_wrong) {
    details.push_back({stream.away() ? kYellow : "", device_row(stream, now_ns)});
  }
  if (!refused && !only_wrong) details.push_back({"", stages_row(stream)});
  return details;
}

// The text in as many lines as it needs, each after `indent` blanks.
std::vector<std::string> broken(const std::string& text, const LiveViewOptions& options,
                                const char* colour, int indent) {
  const std::string blanks(indent, ' ');
  std::vector<std::string> lines{text};
  if (options.width > 0) lines = wrapped(text, options.width - indent, "  ");
  for (std::string& line : lines) line = paint(options.colour, colour, line).insert(0, blanks);
  return lines;
}

// The lines below the table.
std::vector<std::string> rows_below(const v1::Stats& stats, const LiveViewOptions& options) {
  std::vector<std::string> rows;
  const auto add = [&](const char* colour, const std::string& text) {
    for (std::string& line : broken(text, options, colour, 2)) rows.push_back(std::move(line));
  };
  if (!stats.replay_file().empty()) add("", replay_words(stats));
  if (!stats.recorder_trouble().empty()) {
    add(kRed, "nothing can be written to the log: " + clean(stats.recorder_trouble()));
  }
  for (const v1::SourceStats& source : stats.source()) {
    const std::string text = source_row(source);
    const bool fault = !is_camera(source) || source.streams() > 0;
    if (!text.empty()) add(fault ? kYellow : "", clean_name(source.name()) + ": " + text);
  }
  for (const v1::StreamStats& stream : stats.stream()) {
    const bool only_wrong = !options.chosen.empty() && stream.stream() != options.chosen;
    for (const auto& [colour, text] : details_of(stream, stats.time_ns(), only_wrong)) {
      if (!text.empty()) add(colour, clean_name(stream.stream()) + ": " + text);
    }
  }
  for (const v1::OutputStats& output : stats.output()) {
    const bool wrong = output.dropped() > 0 || output.failures() > 0;
    add(wrong ? kYellow : "", clean_name(output.name()) + ": " + output_row(output));
  }
  return rows;
}

// The newest notes that fit into `rows` lines, oldest first; of the newest at least its beginning.
std::vector<std::string> newest_notes(const LiveViewOptions& options, std::size_t rows) {
  std::vector<std::string> lines;
  for (std::size_t i = options.notes.size(); i > 0; --i) {
    auto note = broken(options.notes[i - 1], options, "", 0);
    if (lines.empty() && note.size() > rows) note.resize(rows);
    if (lines.size() + note.size() > rows) break;
    lines.insert(lines.begin(), note.begin(), note.end());
  }
  return lines;
}

// The lines kept for the notes: a note may be the only answer to a key, so a long table or a high
// panel does not push out the newest.
int rows_of_notes(const LiveViewOptions& options) {
  if (options.notes.empty()) return 0;
  const int newest = static_cast<int>(broken(options.notes.back(), options, "", 0).size());
  const int most = std::min(std::max(newest, kNoteRows), options.height / 4);
  return static_cast<int>(newest_notes(options, static_cast<std::size_t>(most)).size());
}

}  // namespace

const char* const kColumnsHelp = R"(Columns, one row a stream; one that no stream needs is left out:
  STATE    live, lossy (frames were dropped or skipped in the last ten seconds: the machine is too
           slow), waiting (nothing came yet), stale (fell silent), away (device unplugged), ended,
           refused (a stage cannot serve this body)
  HZ       frames published in the last second
  LATENCY  from arrival to handed out, lag included: half of the frames of the last second took at
           most this, and 99 % at most the column behind it
  ALPHA    how much style, -2 to 2; below the table its target, while it moves
  MODEL    the style model in use, or the gesture model
Below the table are what is wrong, the time of each stage (99 % of the frames took at most this), a
hand's label, the lag, and settings that are not the usual ones. Of a style: how far its model knows
the motion (0 %: passed through), and what the input has of the style already, where it is seen.
--json has every figure, in microseconds)";

std::vector<std::string> live_view(const v1::Stats& stats, const LiveViewOptions& wanted) {
  LiveViewOptions options = wanted;
  if (options.width > 0) options.width = std::max(options.width, kMinWidth);
  const bool silent = !options.silence.empty();
  const bool limited = options.height > 0;
  const auto left = [&](std::size_t lines) {
    return limited ? std::max(0, options.height - static_cast<int>(lines)) : 1'000'000;
  };
  std::vector<std::string> lines;
  const auto add = [&](const std::vector<std::string>& more, int kept = 0) {
    const int room = std::max(0, left(lines.size()) - kept);
    const auto count = std::min(more.size(), static_cast<std::size_t>(room));
    lines.insert(lines.end(), more.begin(), more.begin() + static_cast<std::ptrdiff_t>(count));
  };
  const int notes = rows_of_notes(options);
  const std::string first = head(stats, options);
  // If the daemon is silent, the first line says so, because everything below it is old.
  if (silent) add(broken(options.silence, options, kRed, 0));
  add({paint(options.colour, kBold, options.width == 0 ? first : cut(first, options.width))});
  add(live_table(stats, {.width = options.width,
                         .rows = limited ? std::max(1, left(lines.size()) - notes) : 0,
                         .colour = options.colour,
                         .silent = silent,
                         .chosen = options.chosen}));
  if (!silent) add(rows_below(stats, options), notes);
  if (options.panel && !silent) {
    add(options.panel(left(lines.size()) - notes));
  }
  add(newest_notes(options, static_cast<std::size_t>(left(lines.size()))));
  return lines;
}

namespace {

termios keyboard_before;  // global, because a process has one terminal

void put_on_screen(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stdout);
  std::fflush(stdout);
}

Key other_key(char byte) { return byte == 'q' || byte == 'Q' ? Key::kQuit : Key::kOther; }

Key arrow(char last_byte) {
  switch (last_byte) {
    case 'A':
      return Key::kUp;
    case 'B':
      return Key::kDown;
    case 'C':
      return Key::kRight;
    case 'D':
      return Key::kLeft;
    default:
      return Key::kOther;
  }
}

}  // namespace

LiveScreen::LiveScreen()
    : terminal_(isatty(STDOUT_FILENO) == 1), keyboard_(terminal_ && isatty(STDIN_FILENO) == 1) {
  if (keyboard_ && tcgetattr(STDIN_FILENO, &keyboard_before) == 0) {
    termios raw = keyboard_before;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // Ctrl-C still sends a signal
    raw.c_iflag &= ~static_cast<tcflag_t>(IXON);           // Ctrl-S would stop it for good
    tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  } else {
    keyboard_ = false;
  }
  if (terminal_) put_on_screen("\x1b[?1049h\x1b[?25l\x1b[2J");  // alternate screen, no cursor
}

LiveScreen::~LiveScreen() {
  if (terminal_) put_on_screen("\x1b[?25h\x1b[?1049l");
  if (keyboard_) tcsetattr(STDIN_FILENO, TCSANOW, &keyboard_before);
}

void LiveScreen::measure(LiveViewOptions& options) const {
  options.colour = terminal_ && std::getenv("NO_COLOR") == nullptr;
  if (!terminal_) {
    options.width = 0;
    options.height = 0;
    return;
  }
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return;
  options.width = size.ws_col;
  options.height = size.ws_row;
}

void LiveScreen::draw(const std::vector<std::string>& lines) const {
  std::string text = terminal_ ? "\x1b[H" : "";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (terminal_) {
      text += lines[i] + "\x1b[K" + (i + 1 < lines.size() ? "\r\n" : "");
    } else {
      text += lines[i] + "\n";
    }
  }
  if (terminal_) text += "\x1b[J";
  put_on_screen(text);
}

char LiveScreen::key_pressed() const {
  char key = 0;
  pollfd waits{STDIN_FILENO, POLLIN, 0};
  if (!keyboard_ || poll(&waits, 1, 0) <= 0 || ::read(STDIN_FILENO, &key, 1) != 1) return 0;
  return key;
}

// An arrow is ESC [ A to D, or ESC O A to D where the terminal is in application mode. A network
// may deliver its bytes apart, so the first of them are kept until the others come.
Key LiveScreen::next_key() {
  while (const char byte = key_pressed()) {
    const std::size_t before = std::exchange(arrow_bytes_, 0);
    if (byte == '\x1b') {
      arrow_bytes_ = 1;
    } else if (before == 1 && (byte == '[' || byte == 'O')) {
      arrow_bytes_ = 2;
    } else {
      return before == 2 ? arrow(byte) : other_key(byte);
    }
  }
  return Key::kNone;
}

}  // namespace posed::tools
