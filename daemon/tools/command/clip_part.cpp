#include "daemon/tools/command/clip_part.hpp"

#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/clip/text.hpp"
#include "proto/clip/timecode_cut.hpp"

namespace posed::tools {
namespace {

// Seconds, or what has a ':'.
void add_moment(CLI::App& command, const std::string& name, const std::string& help,
                std::optional<double>& time_s, std::string& timecode) {
  const auto set = [&time_s, &timecode](const std::string& text) {
    if (text.contains(':')) {
      timecode = text;
    } else {
      time_s = clip::parse_number(text);
    }
  };
  command.add_option_function<std::string>(name, set, help)->check([](const std::string& text) {
    const auto number = clip::parse_number(text);
    const bool possible = text.contains(':') || (number && *number >= 0.0);
    return possible ? std::string() : text + " is neither seconds from 0 on nor hh:mm:ss:ff";
  });
}

}  // namespace

void add_part_options(CLI::App& command, ClipPart& part) {
  add_moment(command, "--from",
             "Begin at this time [s] or timecode: hh:mm:ss:ff, ;ff (drop frame) or .mmm; @25 behind"
             " it: its rate",
             part.from_s, part.from_timecode);
  add_moment(command, "--to", "End at this time [s] or timecode", part.to_s, part.to_timecode);
}

Result<FrameRange> frames_between(const clip::Clip& clip, const ClipPart& part,
                                  const std::string& file) {
  const double from_s = part.from_s.value_or(0.0);
  FrameRange range{.first = 0, .end = clip.frames()};
  while (range.first < range.end && clip.time_of_s(range.first) < from_s) ++range.first;
  while (part.to_s && range.first < range.end && clip.time_of_s(range.end - 1) > *part.to_s) {
    --range.end;
  }
  if (range.first < range.end) return range;
  const std::string until = part.to_s ? fmt::format(" to {:g} s", *part.to_s) : " s on";
  return misuse(fmt::format("has no frame from {:g}{}; it lasts {:.2f} s", from_s, until,
                            clip.frames() / clip.frame_rate_hz),
                file);
}

Result<clip::Clip> part_of(clip::Clip clip, const ClipPart& part, const std::string& file) {
  auto cut = TRY(clip::cut_by_timecode(std::move(clip), part.from_timecode, part.to_timecode));
  if (!part.from_s && !part.to_s) return cut;
  const auto range = TRY(frames_between(cut, part, file));
  clip::keep_frames(cut, range.first, range.end);
  return cut;
}

}  // namespace posed::tools
