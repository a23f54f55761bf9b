#include "daemon/tools/live/monitor_line.hpp"

#include <string_view>

#include "posed/v1/posed.pb.h"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

// "KIND_CLOCK_JUMPED" without "KIND_" -> "clock_jumped". A value from a newer version of posed has
// no name.
std::string short_name(const std::string& name, std::string_view prefix) {
  if (!name.starts_with(prefix)) return "unknown";
  std::string out;
  for (const char c : name.substr(prefix.size())) {
    out += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return out;
}

// How the pose was made: one that is performed was not measured.
std::string quality(const v1::Frame& frame) {
  if (frame.source() == v1::SOURCE_LABELS && frame.quality() == v1::QUALITY_MEASURED) {
    return "performed";
  }
  return short_name(v1::Quality_Name(frame.quality()), "QUALITY_");
}

// The time from arrival to publication, in the most readable unit.
std::string age(const v1::Frame& frame) {
  if (!frame.has_published_ns()) return fmt::format(" {:>9}", "-");
  const double age_us = static_cast<double>(frame.published_ns() - frame.arrival_ns()) * 1e-3;
  if (age_us < 9'999.5) return fmt::format(" {:>6.0f} us", age_us);
  if (age_us < 9'999'500.0) return fmt::format(" {:>6.0f} ms", age_us * 1e-3);
  return fmt::format(" {:>6.1f} s ", age_us * 1e-6);
}

std::string line_head(const std::string& stream, std::uint64_t sequence, const std::string& what) {
  return fmt::format("{:<16} {:>8} {:<9}", clean_name(stream), sequence, what);
}

}  // namespace

template <typename Labelled>
std::string label_words(const Labelled& labelled) {
  if (labelled.label().empty()) return {};
  const std::string label = clean_name(labelled.label());
  if (labelled.source() == v1::SOURCE_LABELS) return "plays " + label;
  return fmt::format("recognised {} {:.0f} %", label, 100.0F * labelled.label_probability());
}
template std::string label_words(const v1::Frame& frame);
template std::string label_words(const v1::StreamStats& stream);

std::string monitor_line(const v1::Frame& frame) {
  std::string out = line_head(frame.stream(), frame.sequence(), quality(frame)) + age(frame);
  if (frame.root_position_m_size() == 3) {
    out += fmt::format("  root {:7.3f} {:7.3f} {:7.3f} m", frame.root_position_m(0),
                       frame.root_position_m(1), frame.root_position_m(2));
  }
  if (!frame.label().empty()) out += "  " + label_words(frame);
  if (frame.lag_frames() > 0) {
    out += fmt::format("  lag {} frame{} ({:.0f} ms)", frame.lag_frames(),
                       frame.lag_frames() == 1 ? "" : "s", frame.lag_ms());
  }
  return out;
}

std::string monitor_line(const v1::Sample& sample) {
  std::string out = line_head(sample.stream(), sample.sequence(),
                              short_name(v1::Quality_Name(sample.quality()), "QUALITY_"));
  for (int i = 0; i < sample.value_size() && i < sample.name_size(); ++i) {
    const std::string unit = i < sample.unit_size() ? sample.unit(i) : "";
    out += fmt::format(" {}={:.3f}{}{}", clean_name(sample.name(i)), sample.value(i),
                       unit.empty() ? "" : " ", clean_name(unit));
  }
  return out;
}

std::string monitor_line(const v1::Event& event) {
  return line_head(event.stream(), event.sequence(),
                   short_name(v1::Event::Kind_Name(event.kind()), "KIND_")) +
         " " + clean(event.text());
}

std::string monitor_line(const v1::Skeleton& skeleton) {
  return fmt::format("{:<16} skeleton {:08x} {} {} joints, {} channels",
                     clean_name(skeleton.stream()), skeleton.id(), clean_name(skeleton.name()),
                     skeleton.joint_name_size(), skeleton.channel_joint_size());
}

std::string replay_words(const v1::Stats& stats) {
  const std::string pace = stats.replay_speed() == 0.0
                               ? "as fast as possible"
                               : fmt::format("{} x its pace", stats.replay_speed());
  return fmt::format("a replay of {}, {}; all times are the recording's",
                     clean_name(stats.replay_file()), pace);
}

std::string monitor_line(const v1::Stats& stats) {
  std::string out = fmt::format("cpu {:.1f} %, rss {:.1f} MB", stats.cpu_percent(),
                                static_cast<double>(stats.rss_bytes()) / 1e6);
  if (!stats.replay_file().empty()) {
    out += "; " + replay_words(stats);
  }
  for (const auto& stream : stats.stream()) {
    out += fmt::format("; {} {} {:.1f} Hz, {} dropped, {} shed", clean_name(stream.stream()),
                       stream.away() ? "away" : clean_name(stream.state()), stream.rate_hz(),
                       stream.dropped(), stream.shed());
    if (!stream.refusal().empty()) out += ": " + clean(stream.refusal());
  }
  return out;
}

}  // namespace posed::tools
