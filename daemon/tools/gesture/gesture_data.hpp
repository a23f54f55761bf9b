// What a gesture model is trained from: recordings of a hand or a body with their labels, and the
// classes of all labels. Cold.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "models/gesture/recording.hpp"
#include "models/gesture/vocabulary.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

struct GestureSources {
  std::vector<std::string> clips, labels;  // one label file for each clip
  std::vector<std::string> people{};       // one for each clip, or none: whose hand it is
  std::vector<std::string> shows;          // NAME=CLIP: labels that were not recorded
  std::string questions, propose;          // a file to read, or to write; at most one
  bool body = false;                       // without questions: the clips are of a body
  double rate_hz = 30.0;
  clip::ReadOptions read{};
};

struct GestureData {
  gesture::Vocabulary vocabulary;
  std::vector<gesture::Recording> recordings;
};

// `writes`: whether proposed classes are written to `propose`.
Result<GestureData> read_gesture_data(const GestureSources& sources, bool writes);

// The groups of channels that the model will have, as far as they are known without the clips:
// those of the questions file, else a hand's fingers, else those of a whole body.
Result<std::vector<gesture::ChannelGroup>> groups_of(const GestureSources& sources);

// A hand's clip with its labels, resampled to the training rate.
Result<gesture::Recording> load_recording(const std::filesystem::path& clip,
                                          const std::filesystem::path& labels, double rate_hz,
                                          const clip::ReadOptions& read = {});

// Recordings to compare a model with, each as it sees them: at its rate, a hand's gaps filled.
Result<std::vector<gesture::Recording>> recordings_for(const gesture::GestureModel& model,
                                                       const std::vector<std::string>& clips);

// Cuts the recording at the labels of a file.
Result<> cut_at(gesture::Recording& recording, const std::filesystem::path& labels);

// The clip on whose figure a model of bodies is drawn; empty for one of hands.
Result<clip::Clip> figure_of(const gesture::GestureModel& model, const std::filesystem::path& clip,
                             const clip::ReadOptions& read = {});

// A clip without labels, of a body about its T-pose, or of a hand.
Result<gesture::Recording> load_unlabelled(const std::filesystem::path& clip, bool body,
                                           double rate_hz, const clip::ReadOptions& read);

}  // namespace posed::tools
