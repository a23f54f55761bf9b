// The part of a clip that --from and --to name. Cold.
#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// Each end is a time [s] from the clip's begin, or a timecode, or not given.
struct ClipPart {
  std::optional<double> from_s, to_s;
  std::string from_timecode, to_timecode;

  [[nodiscard]] bool given() const {
    return from_s || to_s || !from_timecode.empty() || !to_timecode.empty();
  }
};

// Adds --from and --to, which set `part`; it must outlive the command.
void add_part_options(CLI::App& command, ClipPart& part);

// Frames [first, end) of a clip.
struct FrameRange {
  int first = 0, end = 0;
};

// The frames between the times, both included. The error names `file` and how long it lasts.
Result<FrameRange> frames_between(const clip::Clip& clip, const ClipPart& part,
                                  const std::string& file);

// Leaves the part alone, by timecodes and then by times.
Result<clip::Clip> part_of(clip::Clip clip, const ClipPart& part, const std::string& file);

}  // namespace posed::tools
