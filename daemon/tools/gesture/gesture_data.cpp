#include "daemon/tools/gesture/gesture_data.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "daemon/tools/gesture/question_file.hpp"
#include "models/gesture/body_recording.hpp"
#include "models/gesture/questions.hpp"
#include "models/gesture/train.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/clip/label_file.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/label.hpp"
#include "proto/frame/median.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

void print_warnings(const std::string& file, const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) {
    std::fprintf(stderr, "posed: warning: %s\n", clean(file + ": " + warning).c_str());
  }
}

Result<clip::Clip> read_body(const std::string& file, const clip::ReadOptions& read) {
  auto clip = clip::read_clip(file, clip::accepted_options(file, read));
  if (clip) print_warnings(file, clip->warnings);
  return clip;
}

Result<gesture::Recording> read_hand(const std::filesystem::path& file, double rate_hz,
                                     const clip::ReadOptions& read) {
  const auto hand = TRY(clip::read_hand_clip(file, read));
  print_warnings(file.string(), hand.warnings);
  return gesture::recording_of(hand, rate_hz);
}

Result<gesture::Vocabulary> body_of(const Skeleton& skeleton) {
  return gesture::body_vocabulary(gesture::body_groups(skeleton));
}

// The clips of a body. Without a questions file the joints are those of the clip with the most, so
// that another skeleton among the clips is refused in whichever order they come.
Result<> read_bodies(const GestureSources& sources, GestureData& data) {
  std::vector<clip::Clip> clips;
  for (const std::string& file : sources.clips) {
    auto clip = TRY(read_body(file, sources.read));
    clips.push_back(std::move(clip));
  }
  if (sources.questions.empty()) {
    for (const clip::Clip& clip : clips) {
      auto vocabulary = body_of(*clip.skeleton);
      if (!vocabulary) {
        vocabulary.error().file = clip.path;
        return std::unexpected(vocabulary.error());
      }
      if (!data.vocabulary.is_hand() && vocabulary->channels() <= data.vocabulary.channels()) {
        continue;
      }
      data.vocabulary = std::move(*vocabulary);
    }
  }
  auto recordings = TRY(gesture::body_recordings(clips, sources.rate_hz, data.vocabulary));
  data.recordings = std::move(recordings);
  return {};
}

Result<> read_hands(const GestureSources& sources, GestureData& data) {
  for (const std::string& file : sources.clips) {
    auto recording = read_hand(file, sources.rate_hz, sources.read);
    if (!recording) {
      const clip::Format* format = clip::format_of(file);
      if (format == nullptr || !format->is_hand)
        recording.error().message += "; to learn from the whole body, add --body";
      return std::unexpected(recording.error());
    }
    data.recordings.push_back(std::move(*recording));
  }
  return {};
}

// The median of each angle that the file has, so that one row is enough and a slip does no harm.
Result<std::vector<double>> shown_hand(const std::string& file, const clip::ReadOptions& read) {
  const auto hand = TRY(clip::read_hand_clip(file, read));
  print_warnings(file, hand.warnings);
  std::vector<double> pose;
  for (std::size_t c = 0; c < kHandChannels; ++c) {
    std::vector<double> values;
    for (const HandAngles& angles : hand.angles) {
      if (std::isfinite(angles[c])) values.push_back(angles[c]);
    }
    if (values.empty()) {
      return fail(
          "the shown pose lacks an angle in every row; fill it, with 0 where nothing measures "
          "the joint",
          file);
    }
    pose.push_back(median(values));
  }
  return pose;
}

// "ok=ok_pose.csv": the pose of a clip that holds it; of a body its mean.
Result<gesture::LabelPose> shown_pose(const std::string& show, const GestureSources& sources,
                                      const gesture::Vocabulary& vocabulary) {
  const auto equals = show.find('=');
  if (equals == std::string::npos || !is_label_name(std::string_view(show).substr(0, equals))) {
    return misuse("'" + show +
                  "' shows no pose; write --show NAME=POSE.csv, NAME of 1 to 15 signs");
  }
  const std::string file = show.substr(equals + 1);
  if (vocabulary.is_hand()) {
    auto pose = TRY(shown_hand(file, sources.read));
    return gesture::LabelPose{show.substr(0, equals), std::move(pose)};
  }
  const auto clip = TRY(read_body(file, sources.read));
  const auto recording = TRY(gesture::body_recording(clip, sources.rate_hz, vocabulary));
  const Eigen::RowVectorXd mean = recording.angles_rad.colwise().mean();
  return gesture::LabelPose{show.substr(0, equals), {mean.begin(), mean.end()}};
}

// Appends the label, in place of one of the same name.
void put_last(gesture::Label label, gesture::Vocabulary& vocabulary) {
  const int known = vocabulary.label_index(label.name);
  if (known >= 0) {
    vocabulary.labels.erase(vocabulary.labels.begin() + known);
    const auto last = static_cast<int>(vocabulary.labels.size());
    for (int& named : vocabulary.named) named = named == known ? last : named - (named > known);
  }
  vocabulary.labels.push_back(std::move(label));
}

// The classes of labels that no questions file gives: proposed, or a hand's built-in ones; then the
// poses given by clips.
Result<> complete_labels(const GestureSources& sources, bool writes, GestureData& data) {
  gesture::Vocabulary& vocabulary = data.vocabulary;
  const auto poses = gesture::label_poses(data.recordings);
  if (sources.questions.empty()) {
    if (!vocabulary.is_hand()) {
      gesture::propose_body_labels(poses, vocabulary);
    } else if (!sources.propose.empty()) {
      vocabulary.labels = gesture::propose_labels(poses);
    } else {
      vocabulary.labels = gesture::built_in_labels();
    }
  }
  if (!sources.propose.empty() && writes) {
    TRY(write_questions(vocabulary, sources.propose));
  }
  for (const std::string& show : sources.shows) {
    const auto shown = TRY(shown_pose(show, sources, vocabulary));
    std::fprintf(
        stderr,
        "posed: '%s' is held as shown; the poses that compose it lie %.0f degrees rms from "
        "there\n",
        clean(shown.name).c_str(),
        gesture::composed_off_rad(shown, poses, vocabulary.groups) / kDegree);
    auto label = gesture::label_like(shown, poses, vocabulary.labels, vocabulary.groups);
    label.shown = shown.angles_rad;
    put_last(std::move(label), vocabulary);
  }
  return {};
}

}  // namespace

Result<GestureData> read_gesture_data(const GestureSources& sources, bool writes) {
  GestureData data;
  if (!sources.questions.empty()) {
    data.vocabulary = TRY(read_questions(sources.questions));
    if (sources.body && data.vocabulary.is_hand()) {
      return misuse(
          "the questions are of a hand's fingers; leave out --body, or give groups of "
          "joints, as config/gestures/raise-arms.toml does",
          sources.questions);
    }
  }
  const bool body = sources.questions.empty() ? sources.body : !data.vocabulary.is_hand();
  TRY(body ? read_bodies(sources, data) : read_hands(sources, data));
  for (std::size_t i = 0; i < sources.clips.size(); ++i) {
    TRY(cut_at(data.recordings[i], sources.labels[i]));
    if (i < sources.people.size()) data.recordings[i].person = sources.people[i];
  }
  TRY(complete_labels(sources, writes, data));
  return data;
}

Result<std::vector<gesture::ChannelGroup>> groups_of(const GestureSources& sources) {
  if (!sources.questions.empty()) {
    auto read = TRY(read_questions(sources.questions));
    return std::move(read.groups);
  }
  if (!sources.body) return gesture::finger_groups();
  return gesture::body_vocabulary(gesture::body_groups())->groups;
}

Result<> cut_at(gesture::Recording& recording, const std::filesystem::path& labels) {
  const auto segments = TRY(clip::read_labels(labels));
  return gesture::cut(recording, segments, labels.string());
}

Result<std::vector<gesture::Recording>> recordings_for(const gesture::GestureModel& model,
                                                       const std::vector<std::string>& clips) {
  std::vector<gesture::Recording> recordings;
  for (const std::string& file : clips) {
    const auto recording = TRY([&]() -> Result<gesture::Recording> {
      if (!model.is_hand()) {
        const auto body = TRY(read_body(file, {}));
        return gesture::body_recording(body, model.rate_hz, model);
      }
      auto hand = TRY(clip::read_hand_clip(file));
      clip::fill_gaps(hand);
      return gesture::recording_of(hand, model.rate_hz);
    }());
    recordings.push_back(recording);
  }
  return recordings;
}

Result<clip::Clip> figure_of(const gesture::GestureModel& model, const std::filesystem::path& clip,
                             const clip::ReadOptions& read) {
  if (model.is_hand()) return clip::Clip{};
  return clip::read_clip(clip, clip::accepted_options(clip, read));
}

Result<gesture::Recording> load_recording(const std::filesystem::path& clip,
                                          const std::filesystem::path& labels, double rate_hz,
                                          const clip::ReadOptions& read) {
  auto recording = TRY(read_hand(clip, rate_hz, read));
  TRY(cut_at(recording, labels));
  return recording;
}

Result<gesture::Recording> load_unlabelled(const std::filesystem::path& clip, bool body,
                                           double rate_hz, const clip::ReadOptions& read) {
  if (!body) return read_hand(clip, rate_hz, read);
  const auto read_clip = TRY(read_body(clip.string(), read));
  const auto vocabulary = TRY(body_of(*read_clip.skeleton));
  return gesture::body_recording(read_clip, rate_hz, vocabulary);
}

}  // namespace posed::tools
