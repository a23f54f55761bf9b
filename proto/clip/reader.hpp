// The steps that all clip readers share, from a file's text to a Clip; private to proto/clip.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/clip.hpp"
#include "proto/clip/frame_text.hpp"
#include "proto/frame/profile.hpp"

namespace posed::clip {

// The text of one frame in the file.
struct FrameSpan {
  std::string_view text;
  int line = 0;  // line of its first word
};

// A clip whose header has been read, with everything needed to read the frames.
struct Draft {
  Skeleton skeleton;  // metres; not finished, except for a hand
  const Profile* profile = nullptr;
  FrameParser parser;
  double frame_rate_hz = 0.0;
  double metres_per_unit = 1.0;
  std::string_view header;  // everything before the first frame
  std::vector<FrameSpan> frames;
  std::vector<std::string> warnings;
  double untimed_rate_hz = 30.0;  // rate of a format with times whose file has none
};

[[nodiscard]] Result<Draft> draft_bvh(std::string_view text, const std::string& name,
                                      const ReadOptions& options);
[[nodiscard]] Result<Draft> draft_amc(std::string_view amc, const std::string& amc_name,
                                      std::string_view asf, const std::string& asf_name,
                                      const ReadOptions& options);

[[nodiscard]] Result<Draft> draft_hand_csv(std::string_view text, const std::string& name,
                                           const ReadOptions& options);

// Completes the times of the frames as hand_clip.hpp describes. `time_s` holds NaN where one is
// missing. Sets `rate_hz` to 1 / median step.
[[nodiscard]] Result<> settle_times(const Draft& draft, const std::string& name,
                                    std::vector<double>& time_s, double& rate_hz,
                                    std::vector<std::string>& warnings);

// Facts that take all frames to find, supplied when only the first is available (the device
// description in a log).
struct Hints {
  std::optional<int> root_joint;
  KnownT T;
};

// Reads the frames and completes the skeleton.
[[nodiscard]] Result<Clip> clip_of(Draft draft, const std::string& name, const Hints& hints = {});

}  // namespace posed::clip
