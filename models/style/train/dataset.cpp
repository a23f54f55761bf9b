#include "models/style/train/dataset.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "models/feet/legs.hpp"
#include "models/motion/motion.hpp"
#include "models/motion/symmetric_eigen.hpp"
#include "models/style/live/body_mask.hpp"
#include "models/style/model/harmonics.hpp"
#include "models/style/model/stride_phase.hpp"
#include "models/style/model/style_model.hpp"
#include "models/style/train/flips.hpp"
#include "models/style/train/training_check.hpp"
#include "models/style/train/walk_only.hpp"
#include "models/task_numbers.hpp"
#include "proto/frame/degree.hpp"
#include "proto/text/clean.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kStill = 1e-6;            // a column with a smaller standard deviation is constant
constexpr double kMinLength_m = 0.02;      // a bone shorter than this has no direction
constexpr double kSameZeroPose_rad = 0.8;  // how far bone directions of one joint may differ

struct Source {
  const TrainingClip* clip;
  motion::Motion motion;
  double heading_rad;
  bool dropped_first = false;
  std::vector<std::string> left_out;  // sentences
};

Error in_clip(Error error, const std::string& path) {
  if (error.file.empty()) error.file = path;
  return error;
}

// Clips with the same joint names may still have different zero poses, which give the same
// rotations another meaning.
Result<> check_same_figure(const Skeleton& first, const Skeleton& other, const std::string& path) {
  for (int j = first.root_joint + 1; j < std::ssize(first.joints); ++j) {
    const Joint& joint = first.joints[j];
    const int there = other.joint_index(joint.name);
    if (there < 0 || joint.offset_m.norm() < kMinLength_m) continue;
    const Eigen::Vector3d& offset = other.joints[there].offset_m;
    if (offset.norm() < kMinLength_m) continue;
    const double cosine = joint.offset_m.normalized().dot(offset.normalized());
    if (std::acos(std::clamp(cosine, -1.0, 1.0)) > kSameZeroPose_rad) {
      return fail("joint " + clean_name(joint.name) +
                      " points elsewhere in this clip's zero pose than in the "
                      "first clip's; train on clips of one kind, or use --pose-space humanoid",
                  path);
    }
  }
  return {};
}

std::vector<std::string> standing_sentences(const Standing& standing) {
  std::vector<std::string> sentences;
  const auto add = [&](double seconds, const char* where) {
    if (!(seconds > 0.0)) return;
    const auto tenths = std::to_string(std::lround(10.0 * seconds));
    std::string text = tenths.size() < 2 ? "0" + tenths : tenths;
    text.insert(text.size() - 1, ".");
    sentences.push_back(text + " s of standing " + where + " the walk are left out");
  };
  add(standing.before_s, "before");
  add(standing.after_s, "after");
  return sentences;
}

Result<std::vector<Source>> read_sources(const std::vector<TrainingClip>& clips, double rate_hz,
                                         motion::Space space) {
  std::vector<Source> sources;
  for (const TrainingClip& clip : clips) {
    const auto same = std::ranges::find_if(sources, [&](const Source& known) {
      return known.clip->group == clip.group && is_same_recording(known.clip->clip, clip.clip);
    });
    if (same != sources.end()) {
      same->left_out.push_back("is in its group twice (" + clip.clip.path +
                               " is the same recording) and counts once");
      continue;
    }
    auto motion = motion::motion_of(clip.clip);
    if (!motion) return std::unexpected(in_clip(motion.error(), clip.clip.path));
    const bool added_pose = motion::begins_with_added_pose(*motion);
    if (added_pose) motion::drop_first_frame(*motion);
    std::vector<std::string> left_out;
    const bool walks = is_gait(clip.motion);
    if (walks) left_out = standing_sentences(leave_out_standing(*motion));
    motion::Motion at_rate = motion::resample(*motion, rate_hz);
    // A motion that is called a turn teaches it.
    const double turned_rad = walks && !clip.motion.contains("turn") ? straighten(at_rate) : 0.0;
    if (turned_rad > 0.0) {
      left_out.push_back("its turns (" + std::to_string(std::lround(turned_rad / kDegree)) +
                         " degrees) are taken out; a motion that is called a turn (--motion "
                         "walk-turn) would teach them");
    }
    if (!has_stride(at_rate.size(), rate_hz)) {
      return fail("the clip has " + std::to_string(at_rate.size()) + " frames at " +
                      std::to_string(static_cast<int>(rate_hz)) +
                      " Hz, too few for one stride (0.6 s); give a longer clip",
                  clip.clip.path);
    }
    if (space == motion::Space::kNative && !sources.empty()) {
      TRY(check_same_figure(*sources.front().motion.skeleton, *at_rate.skeleton, clip.clip.path));
    }
    const double heading_rad = motion::walk_heading_rad(at_rate);
    sources.push_back({&clip, std::move(at_rate), heading_rad, added_pose, std::move(left_out)});
  }
  return sources;
}

Result<VectorXd> kernel_scale_of(const motion::PoseSpaceSpec& spec, const Source& source) {
  constexpr double kTrunk = 0.5, kHeadAndArms = 0.25;
  const auto space = motion::PoseSpace::bind(spec, *source.motion.skeleton);
  if (!space) return std::unexpected(in_clip(space.error(), source.clip->clip.path));
  const std::vector<BodyPart> parts = parts_of(*space, spec);
  VectorXd scale = VectorXd::Ones(space->dims());
  for (int d = 0; d < space->dims(); ++d) {
    const BodyPart part = parts[static_cast<std::size_t>(d)];
    if (space->joint_of_dim(d) == spec.root || part >= BodyPart::kLeftLeg) continue;
    scale[d] = std::sqrt(part == BodyPart::kTrunk ? kTrunk : kHeadAndArms);
  }
  return scale;
}

// The pose vectors of a clip, without flips, and what was mended.
struct Vectors {
  MatrixXd q;
  std::vector<std::string> mended;
};

Result<Vectors> vectors(const motion::PoseSpaceSpec& spec, const Source& source, double rate_hz) {
  const std::string& path = source.clip->clip.path;
  const auto space = motion::PoseSpace::bind(spec, *source.motion.skeleton);
  if (!space) return std::unexpected(in_clip(space.error(), path));
  Vectors vectors{.q = motion::pose_vectors(source.motion, *space, source.heading_rad),
                  .mended = {}};
  auto mended = mend_flips(spec, *space, rate_hz, vectors.q);
  if (!mended) return std::unexpected(in_clip(mended.error(), path));
  vectors.mended = std::move(*mended);
  return vectors;
}

// The bones that all figures have: a style of people of whom one has no toes is one without toes.
void keep_common_bones(const std::vector<Source>& sources, motion::PoseSpaceSpec& spec) {
  std::vector<std::string> common;
  for (const std::string& name : spec.joints) {
    const auto has = [bone = *bone_from_name(name)](const Source& source) {
      return source.motion.skeleton->joint_of(bone) >= 0;
    };
    if (std::ranges::all_of(sources, has)) common.push_back(name);
  }
  // Without its root or any bone the spec stays, and the clip that lacks them is refused.
  if (common.empty() || common.front() != spec.joints[static_cast<std::size_t>(spec.root)]) return;
  spec.joints = std::move(common);
  spec.mean.resize(spec.joints.size());
}

int subject_index(Dataset& dataset, const TrainingClip& clip) {
  for (std::size_t s = 0; s < dataset.subjects.size(); ++s) {
    const Subject& known = dataset.subjects[s];
    if (known.name == clip.subject && known.group == clip.group && known.motion == clip.motion &&
        known.day == clip.day) {
      return static_cast<int>(s);
    }
  }
  dataset.subjects.push_back({clip.subject, clip.group, clip.motion, clip.day, {}});
  return static_cast<int>(dataset.subjects.size()) - 1;
}

AlignedClip aligned_clip(const Source& source, MatrixXd q, double rate_hz) {
  AlignedClip clip;
  clip.file = source.clip->clip.path;
  clip.group = source.clip->group;
  clip.motion = source.clip->motion;
  clip.dropped_first = source.dropped_first;
  const MatrixXd root_m = motion::root_positions_m(source.motion, source.heading_rad);
  const MatrixXd velocity = motion::time_derivative(root_m, rate_hz);
  clip.height_m = root_m.col(1);
  const auto dims = q.cols();
  clip.state.resize(q.rows(), 3 + 2 * dims);
  clip.state << velocity, q, motion::time_derivative(q, rate_hz);
  clip.q = std::move(q);
  if (auto leg = motion::leg_signal(source.motion)) {
    clip.leg = std::move(*leg);
    clip.has_legs = true;
    if (const auto legs = feet::Legs::find(*source.motion.skeleton)) {
      clip.root.resize(root_m.rows(), RootFunction::kDims);
      clip.root << root_m.col(1), velocity.col(2), velocity.col(0);
      clip.root /= legs->length_m();
    }
  }
  return clip;
}

// Used where no skeleton names its legs: the motion's first principal component, the same one for
// all clips, so that their phases have one origin.
void use_principal_component(Dataset& dataset, const std::string& motion) {
  const std::vector<int> members = dataset.clips_of(motion);
  if (std::ranges::all_of(members, [&](int c) { return dataset.clips[c].has_legs; })) return;
  MatrixXd scatter = MatrixXd::Zero(dataset.dims(), dataset.dims());
  for (const int c : members) {
    const MatrixXd& q = dataset.clips[c].q;
    const MatrixXd centred = q.rowwise() - Eigen::RowVectorXd(q.colwise().mean());
    scatter += centred.transpose() * centred / static_cast<double>(q.rows());
  }
  const MatrixXd axes = motion::symmetric_eigen(scatter).vectors;
  for (const int c : members) {
    dataset.clips[c].leg = dataset.clips[c].q * axes.rightCols(1);
    dataset.clips[c].has_legs = false;
  }
}

// The states of one motion's clips below one another, without the columns that never move.
MgpmData stack_states(Dataset& dataset, const std::vector<int>& members,
                      std::vector<int>& first_subject) {
  MgpmData data;
  int frames = 0;
  for (const int c : members) {
    const AlignedClip& clip = dataset.clips[c];
    auto at = std::ranges::find(first_subject, clip.subject);
    if (at == first_subject.end()) at = first_subject.insert(at, clip.subject);
    data.clip_subject.push_back(static_cast<int>(at - first_subject.begin()));
    data.clip_frames.push_back(static_cast<int>(clip.state.rows()));
    frames += data.clip_frames.back();
  }
  MatrixXd all(frames, dataset.clips[members.front()].state.cols());
  int row = 0;
  for (const int c : members) {
    const MatrixXd& state = dataset.clips[c].state;
    all.middleRows(row, state.rows()) = state;
    row += static_cast<int>(state.rows());
  }
  const Eigen::RowVectorXd mean = all.colwise().mean();
  all.rowwise() -= mean;
  std::vector<int> live;
  for (int d = 0; d < all.cols(); ++d) {
    if (std::sqrt(all.col(d).squaredNorm() / frames) > kStill) live.push_back(d);
  }
  data.y = all(Eigen::all, live);
  dataset.column_means.push_back(mean.transpose());
  dataset.live_columns.push_back(std::move(live));
  return data;
}

// Whoever stands, starts or stops shows no style of walking.
void keep_frames(const Eigen::Matrix<Eigen::Index, Eigen::Dynamic, 1>& kept, AlignedClip& clip) {
  clip.q = MatrixXd(clip.q(kept, Eigen::all));
  if (clip.root.rows() > 0) clip.root = MatrixXd(clip.root(kept, Eigen::all));
  clip.state = MatrixXd(clip.state(kept, Eigen::all));
  clip.leg = VectorXd(clip.leg(kept));
  clip.height_m = VectorXd(clip.height_m(kept));
  clip.local_phase = VectorXd(clip.local_phase(kept));
}

// Strides of all clips, each a task: the score, the mean cadence and the phase of every frame.
Result<> follow_clips(Dataset& dataset, const DatasetOptions& options) {
  const Task task = [&](std::size_t c) {
    const StridePhase found = follow_strides(dataset.clips[c].leg, dataset.rate_hz);
    const VectorXd kept = Eigen::Map<const Eigen::Matrix<Eigen::Index, Eigen::Dynamic, 1>>(
                              found.strides.data(), std::ssize(found.strides))
                              .cast<double>();
    return NumberWriter().add(found.score).add(found.dtheta).add(found.phase).add(kept).take();
  };
  const auto count = dataset.clips.size();
  const TaskProgress progress = [&](std::size_t done) {
    const double fraction = static_cast<double>(done) / static_cast<double>(count);
    return !options.progress || options.progress("following strides", fraction);
  };
  SerialTasks serial;
  TaskRunner& tasks = options.tasks != nullptr ? *options.tasks : serial;
  const auto found = tasks.run(count, task, progress);
  if (!found) return training_stopped();
  for (std::size_t c = 0; c < count; ++c) {
    NumberReader numbers((*found)[c]);
    AlignedClip& clip = dataset.clips[c];
    clip.stride_score = numbers.number();
    clip.dtheta = numbers.number();
    clip.local_phase = numbers.vector();
    if (clip.root.rows() > 0) {  // a second to a stride
      clip.root.rightCols(2) *= 2.0 * std::numbers::pi / (clip.dtheta * dataset.rate_hz);
    }
    // The MGPM has one cadence a clip, so that its frames must follow one another.
    if (!options.mgpm && clip.has_legs) keep_frames(numbers.vector().cast<Eigen::Index>(), clip);
  }
  return {};
}

// The legs set a clip's phase, whatever estimated it.
void turn_to_legs(AlignedClip& clip) {
  if (clip.has_legs) clip.theta0 -= first_harmonic_phase(clip.phase(), clip.leg);
  clip.theta0 = std::remainder(clip.theta0, 2.0 * std::numbers::pi);
}

Result<> align_by_mgpm(Dataset& dataset, std::size_t motion, const DatasetOptions& options) {
  const std::vector<int> members = dataset.clips_of(dataset.motions[motion]);
  std::vector<int> subjects;
  const MgpmData data = stack_states(dataset, members, subjects);
  if (data.y.cols() == 0) {
    return fail("the clips of motion " + dataset.motions[motion] + " do not move at all",
                dataset.clips[members.front()].file);
  }
  VectorXd theta0(members.size());
  VectorXd dtheta(members.size());
  for (int m = 0; m < std::ssize(members); ++m) {
    const Stride stride = find_stride(dataset.clips[members[m]].leg, dataset.rate_hz);
    theta0[m] = stride.theta0;
    dtheta[m] = stride.dtheta;
  }
  MgpmOptions mgpm{
      .starts = options.starts, .seed = options.seed, .tasks = options.tasks, .progress = {}};
  const double share = 1.0 / static_cast<double>(dataset.motions.size());
  if (options.progress) {
    mgpm.progress = [&](double fraction) {
      return options.progress("aligning phases", (static_cast<double>(motion) + fraction) * share);
    };
  }
  auto fits = TRY(mgpm_train(data, theta0, dtheta, mgpm));
  const MgpmParams& best = fits.front().params;
  for (int m = 0; m < std::ssize(members); ++m) {
    AlignedClip& clip = dataset.clips[members[m]];
    clip.theta0 = best.theta0[m];
    clip.dtheta = best.dtheta[m];
    clip.local_phase.resize(0);
    turn_to_legs(clip);  // the likelihood may shift a clip against its legs
  }
  for (int s = 0; s < std::ssize(subjects); ++s) {
    dataset.subjects[subjects[s]].xi = best.xi.row(s).transpose();
  }
  dataset.fitted.push_back(dataset.motions[motion]);
  dataset.fits.push_back(std::move(fits.front()));
  dataset.states.push_back(data);
  return {};
}

}  // namespace

VectorXd AlignedClip::phase() const {
  if (local_phase.size() > 0) return (local_phase.array() + theta0).matrix();
  return clip_phase(theta0, dtheta, static_cast<int>(q.rows()));
}

std::string Dataset::unit_of(const AlignedClip& clip) const {
  const Subject& subject = subjects[static_cast<std::size_t>(clip.subject)];
  return subject.day.empty() ? subject.name : subject.name + " on " + subject.day;
}

std::vector<int> Dataset::clips_of(const std::string& motion) const {
  std::vector<int> found;
  for (int c = 0; c < std::ssize(clips); ++c) {
    if (clips[c].motion == motion) found.push_back(c);
  }
  return found;
}

motion::Space usual_space(const std::vector<TrainingClip>& clips) {
  const bool are_people = std::ranges::all_of(
      clips, [](const TrainingClip& clip) { return motion::is_person(*clip.clip.skeleton); });
  return are_people ? motion::Space::kHumanoid : motion::Space::kNative;
}

Result<Dataset> make_dataset(const std::vector<TrainingClip>& clips,
                             const std::vector<std::string>& targets,
                             const DatasetOptions& options) {
  if (clips.empty()) return misuse("there is no clip to learn from");
  auto sources = TRY(read_sources(clips, options.rate_hz, options.space));
  Dataset dataset;
  dataset.rate_hz = options.rate_hz;
  auto spec = motion::describe_space(options.space, *sources.front().motion.skeleton);
  if (!spec) return std::unexpected(in_clip(spec.error(), sources.front().clip->clip.path));
  dataset.spec = std::move(*spec);
  if (options.space == motion::Space::kHumanoid) keep_common_bones(sources, dataset.spec);
  // The mean rotations are those of the filter's input, that is of the sources.
  std::vector<const motion::Motion*> source_motions;
  for (const Source& source : sources) {
    if (std::ranges::find(targets, source.clip->group) != targets.end()) continue;
    source_motions.push_back(&source.motion);
  }
  TRY(motion::set_mean_rotations(source_motions, dataset.spec));
  dataset.kernel_scale = TRY(kernel_scale_of(dataset.spec, sources.front()));
  for (const Source& source : sources) {
    auto seen = TRY(vectors(dataset.spec, source, options.rate_hz));
    AlignedClip clip = aligned_clip(source, std::move(seen.q), options.rate_hz);
    clip.mended = source.left_out;
    clip.mended.insert(clip.mended.end(), seen.mended.begin(), seen.mended.end());
    clip.subject = subject_index(dataset, *source.clip);
    if (std::ranges::find(dataset.motions, clip.motion) == dataset.motions.end()) {
      dataset.motions.push_back(clip.motion);
    }
    dataset.clips.push_back(std::move(clip));
  }
  for (const std::string& motion : dataset.motions) use_principal_component(dataset, motion);
  TRY(follow_clips(dataset, options));
  return dataset;
}

Result<> align(Dataset& dataset, const DatasetOptions& options) {
  for (std::size_t m = 0; m < dataset.motions.size(); ++m) {
    const std::vector<int> members = dataset.clips_of(dataset.motions[m]);
    const bool legs =
        std::ranges::all_of(members, [&](int c) { return dataset.clips[c].has_legs; });
    if (options.mgpm || !legs) {
      TRY(align_by_mgpm(dataset, m, options));
      continue;
    }
    for (const int c : members) turn_to_legs(dataset.clips[c]);
  }
  return {};
}

}  // namespace posed::style
