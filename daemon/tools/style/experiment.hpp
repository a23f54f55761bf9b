// The clips of `posed train style`, from an experiment file or the command line: the group, person
// and motion of each.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "models/style/train/train.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// Who shows the clips that name nobody.
inline constexpr const char* kOnePerson = "one person";

struct ExperimentClip {
  std::filesystem::path file;  // absolute; relative paths start at the experiment file's folder
  std::string group, subject, motion;
  int line = 0;       // of its [[clip]] header
  std::string day{};  // of the recording; clips without one are of one day
};

struct Experiment {
  std::vector<std::string> targets;  // at least one
  double rate_hz = 30.0;
  std::optional<motion::Space> space;  // unset: humanoid where all clips show people
  style::TrainMode mode = style::TrainMode::kDefault;
  std::filesystem::path asf;  // skeleton of all AMC clips; empty: each has one beside it
  std::vector<ExperimentClip> clips;
};

// Errors name file and line; the error for an unknown key names the nearest known one.
Result<Experiment> read_experiment(const std::filesystem::path& path);

// A clip named on the command line, [PERSON:]FILE. The person is the part before the first colon
// where no file has the whole name and that part holds no '/', which only a file's name does;
// without one it is the same person as every other clip without one.
[[nodiscard]] ExperimentClip named_clip(const std::string& argument, const std::string& group,
                                        const std::string& motion);

// The target clips of the command line, [NAME=][PERSON:]FILE. A NAME is the part before the first
// '=' where no file has the whole name and that part holds no '/'; it is the group of its clip and
// of those after it, up to the next NAME. Without any, all are the group "to". Adds the clips and
// the targets. The error is for clips before the first NAME.
Result<> add_target_clips(const std::vector<std::string>& arguments, const std::string& motion,
                          Experiment& experiment);

// The days of the command line, [NAME=]FILE: a NAME, told as above, begins the files of a day,
// which must be among the clips. Files before the first NAME are of a day of their own.
Result<> add_days(const std::vector<std::string>& arguments, Experiment& experiment);

// Reads the clips themselves.
Result<std::vector<style::TrainingClip>> load_clips(const Experiment& experiment);

}  // namespace posed::tools
