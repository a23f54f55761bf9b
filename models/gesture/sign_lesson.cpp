#include "models/gesture/sign_lesson.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "models/gesture/model_file.hpp"
#include "models/gesture/movement_label.hpp"
#include "models/gesture/pose_distance.hpp"
#include "models/gesture/questions.hpp"
#include "models/gesture/train.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/label.hpp"
#include "proto/frame/median.hpp"
#include "proto/text/clean.hpp"

namespace posed::gesture {
namespace {

constexpr double kSignRate_hz = 30.0;       // as `posed train gesture`
constexpr std::size_t kMinShowFrames = 12;  // a camera on a slow computer gives a few a second
constexpr double kMaxGap_s = 0.5;           // between two frames of a show
constexpr double kMaxMissing = 0.2;         // share of a show's frames that lack a value
constexpr double kJump_s = 0.2;     // a camera's error lasts no longer, and two frames at most
constexpr double kMinHold_s = 0.4;  // of the part that is taken as held
// Each is the rms over one finger's angles, of the finger in which it is largest.
constexpr double kMaxMoved_rad = 8.0 * kDegree;   // about the mean of the hold
constexpr double kMinApart_rad = 10.0 * kDegree;  // of two signs
constexpr double kMaxApart_rad = 30.0 * kDegree;  // of two shows of one sign

// "values are missing in 12 of 90 frames"; empty: the show is whole. What no frame measures is a
// joint without a sensor, as the shows of all signs will have it.
std::string missing_in(const clip::HandClip& show) {
  std::array<bool, kHandChannels> measured{};
  for (const HandAngles& angles : show.angles) {
    for (std::size_t c = 0; c < angles.size(); ++c) measured[c] |= std::isfinite(angles[c]);
  }
  const auto lacks = [&](const HandAngles& angles) {
    for (std::size_t c = 0; c < angles.size(); ++c) {
      if (measured[c] && !std::isfinite(angles[c])) return true;
    }
    return false;
  };
  const std::size_t frames = show.angles.size();
  const auto without = static_cast<std::size_t>(std::ranges::count_if(show.angles, lacks));
  if (std::ranges::none_of(measured, std::identity())) return "the hand has no values at all";
  if (static_cast<double>(without) <= kMaxMissing * static_cast<double>(frames)) return {};
  return fmt::format("values are missing in {} of {} frames", without, frames);
}

Result<> check_whole(const clip::HandClip& show) {
  if (show.angles.size() < kMinShowFrames) {
    return fail(fmt::format("only {} frames came; is the hand in sight, the glove on?",
                            show.angles.size()));
  }
  for (std::size_t t = 1; t < show.time_s.size(); ++t) {
    const double gap_s = show.time_s[t] - show.time_s[t - 1];
    if (gap_s > kMaxGap_s) return fail(fmt::format("no frames came for {:.1f} s", gap_s));
  }
  const std::string missing = missing_in(show);
  return missing.empty() ? Result<>() : fail(missing);
}

// Takes out what no hand does but a camera sees: angles that jump away and back. Each angle becomes
// the median of the frames about it, which leaves ways and holds as they are.
void drop_jumps(clip::HandClip& show) {
  const std::vector<HandAngles> seen = show.angles;
  const auto jump = static_cast<std::ptrdiff_t>(std::clamp(kJump_s * show.rate_hz, 1.0, 2.0));
  std::vector<double> about(2 * jump + 1);
  for (std::ptrdiff_t t = jump; t + jump < std::ssize(seen); ++t) {
    for (std::size_t c = 0; c < kHandChannels; ++c) {
      for (std::ptrdiff_t i = 0; i < std::ssize(about); ++i) about[i] = seen[t + i - jump][c];
      if (!std::ranges::all_of(about, [](double angle) { return std::isfinite(angle); })) continue;
      show.angles[t][c] = median(about);
    }
  }
  std::fill_n(show.angles.begin(), jump, show.angles[jump]);
  std::fill_n(show.angles.rbegin(), jump, *(show.angles.rbegin() + jump));
}

// How far the hand moves while it holds the sign [rad].
double moved_rad(const Recording& show) {
  const Segment held = held_part(show.segments.front());
  const auto angles = show.angles_rad.middleRows(held.begin, held.frames());
  const FeatureMatrix off = angles.rowwise() - angles.colwise().mean();
  double most = 0.0;
  for (const ChannelGroup& finger : finger_groups()) {
    const auto of_finger = off.middleCols(finger.first, finger.channels);
    most = std::max(most, std::sqrt(of_finger.squaredNorm() / static_cast<double>(off.rows()) /
                                    finger.channels));
  }
  return most;
}

std::string finger_words(std::string_view finger) {
  return std::string(finger) + (finger == "thumb" ? "" : " finger");
}

struct FingerApart {
  double rad = 0.0;  // rms over the finger's angles
  std::string_view finger{};
};

// Two poses, where they differ most.
FingerApart most_apart(const LabelPose& a, const LabelPose& b) {
  static const Vocabulary hand;
  FingerApart most;
  for (const ChannelGroup& finger : hand.groups) {
    const double rad = apart(hand, finger, a.angles_rad, b.angles_rad).rms_rad();
    if (most.finger.empty() || rad > most.rad) most = {rad, finger.name};
  }
  return most;
}

const LabelPose* find_pose(const std::vector<LabelPose>& poses, std::string_view label) {
  const auto found = std::ranges::find(poses, label, &LabelPose::name);
  return found == poses.end() ? nullptr : &*found;
}

// Against what has been shown before: the sign itself must be the same, all others differ.
Result<> check_apart(const LabelPose& shown, const std::vector<LabelPose>& before) {
  for (const LabelPose& other : before) {
    const auto [rad, finger] = most_apart(shown, other);
    if (other.name == shown.name) {
      if (rad <= kMaxApart_rad) continue;
      return fail(fmt::format(
          "this is not {} as it was shown before: the {} is {:.0f} degrees from there; show it"
          " alike, or forget the sign and begin again",
          in_quotes(shown.name), finger_words(finger), rad / kDegree));
    }
    if (rad >= kMinApart_rad) continue;
    return fail(
        fmt::format("this is like {}: no finger is more than {:.0f} degrees from there; make it"
                    " differ more",
                    in_quotes(other.name), rad / kDegree));
  }
  return {};
}

std::vector<Recording> all_of(const std::map<std::string, std::vector<Recording>>& shows) {
  std::vector<Recording> all;
  for (const auto& [label, of_label] : shows) {
    all.insert(all.end(), of_label.begin(), of_label.end());
  }
  return all;
}

// Every label may be asked for by name: two signs whose fingers are of the same classes differ.
Vocabulary vocabulary_of(const std::vector<LabelPose>& poses) {
  Vocabulary vocabulary;
  vocabulary.labels = propose_labels(poses);
  vocabulary.tells_none = true;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    vocabulary.labels[i].shown = poses[i].angles_rad;
    vocabulary.named.push_back(static_cast<int>(i));
  }
  return vocabulary;
}

std::string verdict_of(const std::vector<LabelPose>& poses, std::size_t shows) {
  std::vector<std::string> names;
  double least_rad = std::numeric_limits<double>::infinity();
  std::string alike;
  for (const LabelPose& a : poses) {
    names.push_back(clean(a.name));
    for (const LabelPose& b : poses) {
      if (!(a.name < b.name)) continue;
      const double rad = most_apart(a, b).rad;
      if (rad >= least_rad) continue;
      least_rad = rad;
      alike = fmt::format("{} and {}", clean(a.name), clean(b.name));
    }
  }
  return fmt::format(
      "knows {} from {} shows; the most alike, {}, are {:.0f} degrees apart in a"
      " finger",
      fmt::join(names, ", "), shows, alike, least_rad / kDegree);
}

}  // namespace

Result<> SignLesson::check_label(const std::string& label) const {
  if (!is_label_name(label)) {
    return fail("a sign's name has 1 to 15 letters, digits or signs of ASCII, without a blank");
  }
  if (label == kRest || label == "none") {
    return fail(in_quotes(label) + " is learnt from every show by itself; name the sign");
  }
  const auto found = shows_.find(label);
  if (found == shows_.end() && shows_.size() >= kMaxSigns) {
    return fail(fmt::format("{} signs are enough for one lesson; forget one first", kMaxSigns));
  }
  if (found == shows_.end() || found->second.size() < kMaxShows) return {};
  return fail(fmt::format("{} was shown {} times; that is enough", in_quotes(label), kMaxShows));
}

Result<std::string> SignLesson::add(const std::string& label, clip::HandClip show) {
  TRY(check_whole(show));
  clip::fill_gaps(show);
  show.path = {};  // errors have no file to name
  auto seen = TRY(recording_of(show, kSignRate_hz));
  drop_jumps(show);
  auto recording = TRY(recording_of(show, kSignRate_hz));
  recording.segments = TRY(propose_movement(recording, label, std::string(kRest)));
  const Segment held = held_part(recording.segments.front());
  if (held.frames() < kMinHold_s * kSignRate_hz) {
    return fail("the sign was not held; stay in it for a second or two");
  }
  const double moved = moved_rad(recording);
  if (moved > kMaxMoved_rad) {
    return fail(
        fmt::format("the hand moved too much while it held the sign: {:.0f} degrees; at"
                    " most {:.0f}",
                    moved / kDegree, kMaxMoved_rad / kDegree));
  }
  const std::vector<LabelPose> poses = label_poses({recording});
  const std::vector<LabelPose> before =
      shows_.empty() ? std::vector<LabelPose>() : label_poses(all_of(shows_));
  TRY(check_apart(*find_pose(poses, label), before));
  TRY(check_apart(*find_pose(poses, label), {*find_pose(poses, kRest)}));
  const double lasted_s = recording.segments.front().frames() / kSignRate_hz;
  auto& kept = shows_[label];
  seen.segments = std::move(recording.segments);
  kept.push_back(std::move(seen));  // with the jumps: so the hand will be seen again
  return fmt::format("{}: show {} of {:.1f} s, held within {:.0f} degrees", clean(label),
                     kept.size(), lasted_s, std::ceil(moved / kDegree));
}

Result<> SignLesson::check_ready() const {
  if (shows_.empty()) return fail("no sign was shown yet; show one first");
  for (const auto& [label, shows] : shows_) {
    if (shows.size() >= kMinShows) continue;
    return fail(fmt::format("{} needs {} good shows and has {}; show it again, or forget it",
                            in_quotes(label), kMinShows, shows.size()));
  }
  return {};
}

Result<SignLesson::Learnt> SignLesson::train(const std::function<bool()>& go_on) const {
  TRY(check_ready());
  const std::vector<Recording> recordings = all_of(shows_);
  const std::vector<LabelPose> poses = label_poses(recordings);
  TrainOptions options;
  options.vocabulary = vocabulary_of(poses);
  options.progress = [&](std::string_view, double) { return go_on(); };
  const auto model = TRY(train_gesture(recordings, options));
  return Learnt{serialize_model(model), verdict_of(poses, recordings.size())};
}

}  // namespace posed::gesture
