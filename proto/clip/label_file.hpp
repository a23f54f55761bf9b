// Label files (.lab): which gesture a hand makes when. A line a segment, `start end name`, in time
// order; seconds from the recording's first frame, or HTK's 100 ns integers (when every time is an
// integer and the last exceeds 10,000). Blank lines are skipped. Cold.
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::clip {

struct LabelSegment {
  double start_s = 0.0, end_s = 0.0;
  std::string name;
  int line = 0;  // of the file, from 1
};

// Refuses, with file and line: a time that is none or below zero, a segment that is empty, runs
// backwards, overlaps the one before or ends past `recording_s`, and a name that is no label
// (proto/frame/label.hpp). Segments need not touch.
[[nodiscard]] Result<std::vector<LabelSegment>> parse_labels(
    std::string_view text, const std::string& file,
    double recording_s = std::numeric_limits<double>::infinity());
[[nodiscard]] Result<std::vector<LabelSegment>> read_labels(
    const std::filesystem::path& path,
    double recording_s = std::numeric_limits<double>::infinity());

// In seconds with six decimals, which read back as the same segments.
[[nodiscard]] std::string labels_text(const std::vector<LabelSegment>& segments);
[[nodiscard]] Result<> write_labels(const std::vector<LabelSegment>& segments,
                                    const std::filesystem::path& path);

}  // namespace posed::clip
