#include "models/style/train/training_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "models/style/model/harmonics.hpp"
#include "proto/frame/degree.hpp"
#include "proto/text/nearest_word.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// models/style/train/README.md, "Verdicts", says what was measured.
constexpr double kMinSwing_deg = 6.0;

// What a motion of strides is called, or begins with.
constexpr std::array<std::string_view, 5> kGaits{"walk", "run", "jog", "march", "gait"};

// The file name alone, for use within a sentence.
std::string name_of(const std::string& file) {
  return std::filesystem::path(file).filename().string();
}

std::string with_digits(double value, int digits) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

std::string percent(double share) { return with_digits(100.0 * share, 0) + " %"; }

// Rms over phases and joints of the rotation between two cycles, given as the difference of their
// harmonic coefficients.
double difference_squares(const Dataset& dataset, const MatrixXd& coefficients) {
  const MatrixXd grid = grid_basis();
  return (grid * coefficients).squaredNorm() /
         static_cast<double>(kGridFrames * std::ssize(dataset.spec.joints));
}

double degrees_rms(double squares_sum, int count) {
  return count == 0 ? 0.0 : std::sqrt(squares_sum / count) / kDegree;
}

void measure_cycles(const Dataset& dataset, const std::string& target, TrainingCheck& check) {
  const auto cycles = clip_cycles(dataset);
  double apart = 0.0;
  double scatter = 0.0;
  int companions = 0;
  int pairs = 0;
  for (const ClipCycle& cycle : cycles) {
    const AlignedClip& clip = dataset.clips[cycle.clip];
    const double from_own = difference_squares(
        dataset, cycle.coefficients -
                     group_cycle(dataset, cycles, clip.group, clip.motion, dataset.unit_of(clip)));
    if (from_own == 0.0) continue;  // the unit's only clip
    scatter += from_own;
    ++companions;
  }
  const auto differences = differences_of(dataset, cycles, target);
  for (const Difference& d : differences) {
    for (const auto& [unit, delta] : d.own) apart += difference_squares(dataset, delta);
    pairs += static_cast<int>(d.own.size());
    if (d.own.empty()) {
      apart += difference_squares(dataset, d.delta);
      ++pairs;
      check.warnings.push_back("nobody shows both '" + d.group + "' and '" + target +
                               "' in motion " + d.motion +
                               ", so what sets the people apart is learnt with the "
                               "style; give one person's clips of both, or the same subject "
                               "where it is one person");
    }
  }
  check.difference_deg = degrees_rms(apart, pairs);
  check.scatter_deg = degrees_rms(scatter, companions);
}

// Clips of one person and day in one motion, by group.
using Takes = std::map<std::string, std::vector<ClipCycle>>;

std::vector<Takes> takes_of(const Dataset& dataset) {
  std::map<std::pair<std::string, std::string>, Takes> found;
  for (const ClipCycle& cycle : clip_cycles(dataset)) {
    const AlignedClip& clip = dataset.clips[static_cast<std::size_t>(cycle.clip)];
    found[{clip.motion, dataset.unit_of(clip)}][clip.group].push_back(cycle);
  }
  std::vector<Takes> all;
  all.reserve(found.size());
  for (auto& [key, takes] : found) all.push_back(std::move(takes));
  return all;
}

double apart_deg(const Dataset& dataset, const ClipCycle& a, const ClipCycle& b) {
  return degrees_rms(difference_squares(dataset, a.coefficients - b.coefficients), 1);
}

double nearest_deg(const Dataset& dataset, const ClipCycle& take,
                   const std::vector<ClipCycle>& others) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const ClipCycle& other : others) {
    if (other.clip != take.clip) nearest = std::min(nearest, apart_deg(dataset, take, other));
  }
  return nearest;
}

// Takes of one style by one actor are 1.2 to 4.4 deg rms apart, styles 9.5 and more, and another
// day adds 2 to 4 (models/style/train/README.md, "Verdicts").
constexpr double kSameStyle_deg = 6.0;
constexpr double kSamePerson_deg = 7.0;
constexpr double kMuchNearer = 0.67;

// Names each take that is much nearer to one of another group than to any of its own.
bool name_strays(const Dataset& dataset, const Takes& takes, TrainingCheck& check) {
  bool found = false;
  for (const auto& [group, own] : takes) {
    for (const ClipCycle& take : own) {
      const double own_deg = nearest_deg(dataset, take, own);
      for (const auto& [other, theirs] : takes) {
        const double other_deg = nearest_deg(dataset, take, theirs);
        if (other == group || std::isinf(own_deg) || own_deg < kSameStyle_deg) continue;
        if (other_deg > std::min(kSameStyle_deg, kMuchNearer * own_deg)) continue;
        found = true;
        const std::string& file = dataset.clips[static_cast<std::size_t>(take.clip)].file;
        std::string& warning = check.warnings.emplace_back(name_of(file));
        warning.append(" is in '").append(group).append("', but nearer to a take of '");
        warning.append(other).append("' (").append(with_digits(other_deg, 1));
        warning.append(" deg rms) than to any of its own group (");
        warning.append(with_digits(own_deg, 1)).append("); see whether it is in the right group");
      }
    }
  }
  return found;
}

// The takes that a chain of near ones joins to the first.
std::vector<ClipCycle> first_kind(const Dataset& dataset, std::vector<ClipCycle> rest) {
  std::vector<ClipCycle> kind{rest.front()};
  rest.erase(rest.begin());
  for (std::size_t k = 0; k < kind.size(); ++k) {
    std::vector<ClipCycle> far;
    for (ClipCycle& take : rest) {
      const bool is_near = apart_deg(dataset, kind[k], take) <= kSamePerson_deg;
      (is_near ? kind : far).push_back(std::move(take));
    }
    rest = std::move(far);
  }
  return kind;
}

// Where every group falls apart, as the takes of several people do.
void ask_for_people(const Dataset& dataset, const Takes& takes, TrainingCheck& check) {
  std::string groups;
  std::string files;
  for (const auto& [group, own] : takes) {
    const auto kind = first_kind(dataset, own);
    if (kind.size() == own.size()) return;
    groups.append(groups.empty() ? "'" : " and '").append(group).append("'");
    for (const ClipCycle& take : own) {
      const auto same = [&](const ClipCycle& other) { return other.clip == take.clip; };
      if (std::ranges::any_of(kind, same)) continue;
      const std::string& file = dataset.clips[static_cast<std::size_t>(take.clip)].file;
      files.append(files.empty() ? "" : ", ").append(name_of(file));
    }
  }
  check.warnings.push_back("the takes of " + groups + " are of several kinds each (" + files +
                           " differ from the others): are these several people? Say who it is: "
                           "ann:FILE, or subject = \"ann\" in an experiment");
}

void check_takes(const Dataset& dataset, TrainingCheck& check) {
  for (const Takes& takes : takes_of(dataset)) {
    if (takes.size() < 2) continue;
    if (!name_strays(dataset, takes, check)) ask_for_people(dataset, takes, check);
  }
}

double swing_deg(const VectorXd& leg) {
  return std::sqrt((leg.array() - leg.mean()).square().mean()) / kDegree;
}

// Phases are derived from strides; without strides a cycle is an average of unrelated poses.
void check_strides(const Dataset& dataset, TrainingCheck& check) {
  for (const AlignedClip& clip : dataset.clips) {
    if (!clip.has_legs) continue;
    const std::string what = no_strides(clip);
    if (!what.empty() && is_gait(clip.motion)) {
      check.problems.push_back(name_of(clip.file) + " is no " + clip.motion + ": " + what +
                               "; leave it out, or name the motion it shows with --motion");
    } else if (!what.empty()) {
      check.warnings.push_back(name_of(clip.file) + ": " + what + ", so phases of motion " +
                               clip.motion + " are a guess");
    } else if (clip.stride_score > kUnevenStrides) {
      check.warnings.push_back(name_of(clip.file) + ": the strides are uneven (" +
                               percent(clip.stride_score) +
                               " of the legs' motion fits none); a steadier clip teaches more");
    }
  }
}

// A misspelt gait would count as a non-gait motion and skip the stride check.
void check_motions(const Dataset& dataset, TrainingCheck& check) {
  std::set<std::string> motions;
  for (const AlignedClip& clip : dataset.clips) motions.insert(clip.motion);
  for (const std::string& motion : motions) {
    const std::string gait = nearest(motion, {kGaits.begin(), kGaits.end()});
    if (is_gait(motion) || gait.empty()) continue;
    std::string& warning = check.warnings.emplace_back("motion '" + motion);
    warning += "' is taken for no gait, so its clips need show no strides; if it is one, name it '";
    warning += gait + "'";
  }
}

void check_closing(const std::string& target, TrainingCheck& check) {
  // Two clips of one style by one actor are 1.2 to 4.4 deg rms apart, styles 9.5 and more (dataset
  // 1 and 2; the table is in models/style/train/README.md, "Verdicts").
  constexpr double kMinDifference_deg = 5.0;
  if (check.difference_deg < kMinDifference_deg) {
    check.problems.push_back("there is no difference to learn: the groups' mean cycles are " +
                             with_digits(check.difference_deg, 1) +
                             " deg rms apart, as two takes of one style are; give clips of two "
                             "styles");
    return;
  }
  if (check.scatter_deg > check.difference_deg) {
    check.warnings.push_back("one person's clips of one group differ more (" +
                             with_digits(check.scatter_deg, 1) + " deg rms) than the groups do (" +
                             with_digits(check.difference_deg, 1) + " deg)");
  }
  if (!check.way.measured()) return;
  if (check.way.closes() <= 0.0) {
    check.problems.push_back("a walker who was left out ends up farther from '" + target +
                             "' than without the model (it closes " + percent(check.way.closes()) +
                             " of the way); give more clips, or clips of one motion");
  } else if (check.way.closes() < check.way.constant_closes()) {
    check.warnings.push_back("a constant offset closes more of the way than the model");
  }
}

}  // namespace

std::string no_strides(const AlignedClip& clip) {
  const double swing = swing_deg(clip.leg);
  if (swing < kMinSwing_deg) {
    return "the legs swing by " + with_digits(swing, 1) + " deg rms only";
  }
  if (clip.stride_score <= kNoStrides) return {};
  return "the legs keep no rhythm (" + percent(std::min(1.0, clip.stride_score)) +
         " of their motion fits no stride)";
}

double cycle_residual_deg(const Dataset& dataset, const AlignedClip& clip) {
  const VectorXd phase = clip.phase();
  const MatrixXd cycle =
      harmonic_basis(phase, kCycleHarmonics) * fit_harmonics(phase, clip.q, kCycleHarmonics);
  const auto count = clip.q.rows() * std::ssize(dataset.spec.joints);
  return std::sqrt((clip.q - cycle).squaredNorm() / static_cast<double>(count)) / kDegree;
}

bool shows_strides(const AlignedClip& clip) { return clip.has_legs && no_strides(clip).empty(); }

bool is_gait(std::string_view motion) {
  return std::ranges::any_of(kGaits,
                             [&](std::string_view gait) { return motion.starts_with(gait); });
}

std::string closing_text(double share) {
  return share < 0.0 ? percent(-share) + " in the wrong direction" : percent(share);
}

std::string TrainingCheck::verdict(const std::string& target) const {
  if (!usable()) return "unusable: " + problems.front();
  const std::string apart = "the difference is " + with_digits(difference_deg, 1) + " deg a joint";
  if (!way.measured()) return apart + "; how much of it is learnt could not be measured";
  const std::string where = closing_by == ClosingBy::kLeaveOut ? "on motion it had not seen"
                                                               : "on the motion it learnt from";
  return "learnt " + closing_text(way.closes()) + " of the difference to '" + target +
         "', tested " + where + "; a fixed change of the pose would be " +
         closing_text(way.constant_closes()) + "; " + apart;
}

TrainingCheck check_training(const Dataset& dataset, const std::string& target, const Way& way,
                             ClosingBy closing_by) {
  TrainingCheck check;
  check.way = way;
  check.closing_by = closing_by;
  measure_cycles(dataset, target, check);
  check_motions(dataset, check);
  check_strides(dataset, check);
  check_takes(dataset, check);
  check_closing(target, check);
  return check;
}

bool is_same_recording(const clip::Clip& a, const clip::Clip& b) {
  return a.channels.rows() == b.channels.rows() && a.channels.cols() == b.channels.cols() &&
         a.channels == b.channels;
}

Result<> check_recordings(const std::vector<TrainingClip>& clips) {
  for (std::size_t i = 0; i < clips.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (clips[i].group == clips[k].group) continue;
      if (!is_same_recording(clips[i].clip, clips[k].clip)) continue;
      return fail("is the same recording as " + name_of(clips[k].clip.path) + ", but in group '" +
                      clips[i].group + "' instead of '" + clips[k].group +
                      "': there is no difference to learn; give another clip",
                  clips[i].clip.path);
    }
  }
  return {};
}

}  // namespace posed::style
