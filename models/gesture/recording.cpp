#include "models/gesture/recording.hpp"

#include <algorithm>
#include <cmath>

#include "models/gesture/gesture_model.hpp"

namespace posed::gesture {
namespace {

using Eigen::Index;

constexpr double kEven = 0.25;      // of a frame: largest deviation of times from an even grid
constexpr double kMaxFrames = 1e7;  // 90 hours at 30 Hz
constexpr double kMaxFinger_rad =
    20;  // three turns: no finger has such an angle, so the values are degrees

auto row_of(const clip::HandClip& clip, std::size_t frame) {
  return Eigen::Map<const Eigen::RowVectorXd>(clip.angles[frame].data(), kHandChannels);
}

Result<> check_values(const clip::HandClip& clip) {
  if (static_cast<int>(clip.angles.size()) < kStates) {
    return fail("the recording has " + std::to_string(clip.angles.size()) +
                    " frames; a gesture alone needs " + std::to_string(kStates),
                clip.path);
  }
  for (std::size_t t = 0; t < clip.angles.size(); ++t) {
    const std::string frame = "frame " + std::to_string(t + 1);
    const auto angles = row_of(clip, t);
    if (!angles.allFinite()) {
      return fail(frame + " lacks a value; fill gaps with `posed smooth` before training",
                  clip.path);
    }
    if (angles.cwiseAbs().maxCoeff() > kMaxFinger_rad) {
      return fail(frame + " has an angle beyond three turns; angles are in radians", clip.path);
    }
    if (t > 0 && !(clip.time_s[t] > clip.time_s[t - 1])) {
      return fail("the time of " + frame + " is not after the one before", clip.path);
    }
  }
  return {};
}

// Whether the frames' times are already those of `rate_hz`.
bool is_even(const clip::HandClip& clip, double rate_hz) {
  for (std::size_t t = 0; t < clip.time_s.size(); ++t) {
    const double on_grid = (clip.time_s[t] - clip.time_s[0]) * rate_hz;
    if (std::abs(on_grid - static_cast<double>(t)) > kEven) return false;
  }
  return true;
}

FeatureMatrix interpolate(const clip::HandClip& clip, double rate_hz, Index frames) {
  FeatureMatrix out(frames, kHandChannels);
  std::size_t after = 1;
  for (Index t = 0; t < frames; ++t) {
    const double time_s = clip.time_s[0] + static_cast<double>(t) / rate_hz;
    while (after + 1 < clip.time_s.size() && clip.time_s[after] < time_s) ++after;
    const double span_s = clip.time_s[after] - clip.time_s[after - 1];
    const double share = std::clamp((time_s - clip.time_s[after - 1]) / span_s, 0.0, 1.0);
    out.row(t) = (1.0 - share) * row_of(clip, after - 1) + share * row_of(clip, after);
  }
  return out;
}

}  // namespace

double duration_s(const clip::HandClip& clip) {
  if (clip.time_s.size() < 2) return 0.0;
  const double span_s = clip.time_s.back() - clip.time_s.front();
  const auto steps = static_cast<double>(clip.time_s.size() - 1);
  return span_s * (steps + 1.0) / steps;  // the last frame lasts one mean frame period
}

Result<Recording> recording_of(const clip::HandClip& clip, double rate_hz) {
  TRY(check_values(clip));
  Recording recording{.file = clip.path, .rate_hz = rate_hz, .angles_rad = {}, .segments = {}};
  if (is_even(clip, rate_hz)) {
    recording.angles_rad.resize(static_cast<Index>(clip.angles.size()), kHandChannels);
    for (std::size_t t = 0; t < clip.angles.size(); ++t) {
      recording.angles_rad.row(static_cast<Index>(t)) = row_of(clip, t);
    }
    return recording;
  }
  const double frames = std::floor(duration_s(clip) * rate_hz + 0.5);
  if (frames < kStates || frames > kMaxFrames) {
    return fail("the recording lasts " + std::to_string(duration_s(clip)) + " s, which at " +
                    std::to_string(rate_hz) + " Hz is no number of frames to learn from",
                clip.path);
  }
  recording.angles_rad = interpolate(clip, rate_hz, static_cast<Index>(frames));
  return recording;
}

Result<> cut(Recording& recording, const std::vector<clip::LabelSegment>& labels,
             const std::string& file) {
  const auto frames = static_cast<int>(recording.angles_rad.rows());
  for (const clip::LabelSegment& label : labels) {
    const double begin = std::round(label.start_s * recording.rate_hz);
    const double end = std::round(label.end_s * recording.rate_hz);
    if (!(end <= frames + 1)) {  // one frame of tolerance: files differ in whether the last frame
                                 // has a duration
      return fail("the segment ends at " + std::to_string(label.end_s) + " s, after the end of " +
                      recording.file,
                  file, label.line);
    }
    Segment segment{static_cast<int>(begin), std::min(static_cast<int>(end), frames), label.name};
    if (segment.frames() < kStates) {
      return fail("the segment has " + std::to_string(segment.frames()) + " frames at " +
                      std::to_string(recording.rate_hz) + " Hz; a gesture needs at least " +
                      std::to_string(kStates),
                  file, label.line);
    }
    if (segment.frames() > kMaxState_s * recording.rate_hz) {
      return fail("the segment lasts " + std::to_string(segment.frames() / recording.rate_hz) +
                      " s; a gesture lasts at most " + std::to_string(std::lround(kMaxState_s)) +
                      " s: mark a part of it",
                  file, label.line);
    }
    recording.segments.push_back(std::move(segment));
  }
  return {};
}

}  // namespace posed::gesture
