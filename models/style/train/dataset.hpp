// Dataset: clips at one rate, in one pose space and in common phase; the input of style training.
// Cold.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "models/motion/pose_space.hpp"
#include "models/style/train/mgpm.hpp"
#include "models/tasks.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

struct TrainingClip {
  clip::Clip clip;
  std::string group;    // "masculine"
  std::string subject;  // who; the same name is one person, in any group, motion or file
  std::string motion;   // "walk"
  std::string day{};    // of the recording, any word; clips without one are of one day
};

// Receives the current step and its fraction done, 0 to 1; returning false stops the training.
using StepProgress = std::function<bool(std::string_view step, double fraction)>;

struct DatasetOptions {
  motion::Space space = motion::Space::kNative;
  double rate_hz = 30.0;
  std::uint64_t seed = 0;
  bool mgpm = false;  // phases by the MGPM in every motion, not only where legs are missing
  std::vector<MgpmStart> starts{MgpmStart::kSvd, MgpmStart::kRandom};
  TaskRunner* tasks = nullptr;  // not owned; null: one task after another
  StepProgress progress;
};

struct AlignedClip {
  std::string file, group, motion;
  int subject = 0;                  // index into Dataset::subjects
  bool dropped_first = false;       // the file's first frame was an added rest pose
  std::vector<std::string> mended;  // sentences about what flipped, and what is left out
  Eigen::MatrixXd q;                // [T x D], rad
  Eigen::MatrixXd state;     // y = (v, q, dq/dt) [T x 3 + 2D]; 89 for cmu43, as in Sato et al.
  Eigen::VectorXd leg;       // the stride's reference signal [T]
  Eigen::VectorXd height_m;  // of the root [T]
  // Its height [lengths of a leg], its speed forward and to the left [such lengths a stride] [T x
  // 3]; no rows without legs.
  Eigen::MatrixXd root;
  bool has_legs = false;              // else `leg` is the first principal component of q
  double theta0 = 0.0, dtheta = 0.0;  // phase of the first frame, mean phase per frame
  Eigen::VectorXd local_phase;  // of every frame, from theta0 = 0; empty: the cadence is constant
  double stride_score = 0.0;    // of the leg signal under its own strides (stride_phase.hpp)

  [[nodiscard]] Eigen::VectorXd phase() const;
};

// One person in one group, one motion and one day: one style point.
struct Subject {
  std::string name, group, motion, day;
  Eigen::VectorXd xi;
};

struct Dataset {
  motion::PoseSpaceSpec spec;
  double rate_hz = 30.0;
  // How much each dimension counts in the kernel [D]: the legs, whose pose tells where in the
  // stride a walker is, more than what may do something else (models/style/train/README.md, "Choice
  // of the kernel").
  Eigen::VectorXd kernel_scale;
  std::vector<std::string> motions;  // in order of appearance
  std::vector<AlignedClip> clips;
  std::vector<Subject> subjects;
  std::vector<std::string> fitted;  // the motions that the MGPM was fitted to
  std::vector<MgpmFit> fits;        // the best fit of each of them, in this order
  std::vector<MgpmData> states;     // what each was fitted to
  // The columns of `state` that each fit used (the others are constant), and the means of all
  // columns.
  std::vector<std::vector<int>> live_columns;
  std::vector<Eigen::VectorXd> column_means;

  [[nodiscard]] int dims() const { return motion::space_dims(spec); }
  [[nodiscard]] std::vector<int> clips_of(const std::string& motion) const;
  // Whose own difference a clip shows: the person on that day, because on another day a person's
  // walk and acting are others.
  [[nodiscard]] std::string unit_of(const AlignedClip& clip) const;
};

// The space of clips for which nobody names one: a person's model then runs on any person's
// skeleton, whoever recorded it.
[[nodiscard]] motion::Space usual_space(const std::vector<TrainingClip>& clips);

// Reads poses and strides. Of gaits the walk counts (walk_only.hpp); one recording that is twice in
// a group counts once. Phases have no common origin yet: theta0 is each clip's own leg phase.
// The training mean of the pose space is over the clips of every group but `targets`.
Result<Dataset> make_dataset(const std::vector<TrainingClip>& clips,
                             const std::vector<std::string>& targets,
                             const DatasetOptions& options);

// Gives all clips of a motion phases with a common origin: each clip's own strides, shifted so that
// its leg signal peaks at phase 0. The MGPM estimates the phases of a motion with clips that name
// no legs and, with `mgpm`, of all (models/style/train/README.md, "Phase alignment").
Result<> align(Dataset& dataset, const DatasetOptions& options);

}  // namespace posed::style
