// Label files (.lab): which gesture a hand makes when. One line per segment, `start end name`, in
// time order. Times are seconds from the recording's first frame, or HTK's 100 ns integers (when
// every time is an integer and the last exceeds 10,000). Blank lines are skipped. Cold.
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
  int line = 0;  // line in the file, from 1
};

// Fails, naming file and line, on an unreadable or negative time; on a segment that is empty, runs
// backwards, overlaps the one before or ends after `recording_s`; and on a name that is not a valid
// label (proto/frame/label.hpp). There may be gaps between segments.
Result<std::vector<LabelSegment>> parse_labels(
    std::string_view text, const std::string& file,
    double recording_s = std::numeric_limits<double>::infinity());
Result<std::vector<LabelSegment>> read_labels(
    const std::filesystem::path& path,
    double recording_s = std::numeric_limits<double>::infinity());

// Times are in seconds with six decimals; reading the text gives the same segments.
[[nodiscard]] std::string labels_text(const std::vector<LabelSegment>& segments);
Result<> write_labels(const std::vector<LabelSegment>& segments, const std::filesystem::path& path);

}  // namespace posed::clip
