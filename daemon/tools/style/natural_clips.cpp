#include "daemon/tools/style/natural_clips.hpp"

#include <algorithm>
#include <array>
#include <system_error>
#include <utility>

#include "daemon/tools/command/options.hpp"
#include "models/gesture/recording.hpp"
#include "models/motion/motion.hpp"
#include "models/natural/compare.hpp"
#include "models/task_numbers.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/degree.hpp"

namespace posed::tools {
namespace {

using Path = std::filesystem::path;

// A body's numbers are half a megabyte and stand twice while a task's result is taken over.
constexpr std::size_t kBatch = 32;

// Measures the files of one comparison.
class Measure {
 public:
  // Bodies are measured about the mean pose of the clip in question.
  static Result<Measure> of(const NaturalOptions& options) {
    Measure measure(options);
    if (measure.of_hands()) return measure;
    const auto motion = TRY(measure.body(options.clip));
    auto spec = TRY(natural::compared_space(*motion.skeleton));
    const std::array<const motion::Motion*, 1> one{&motion};
    TRY(motion::set_mean_rotations(one, spec));
    measure.spec_ = std::move(spec);
    return measure;
  }

  [[nodiscard]] bool of_hands() const {
    const clip::Format* format = clip::format_of_file(options_.clip);
    return !options_.hand.empty() || (format != nullptr && format->is_hand);
  }
  [[nodiscard]] bool may_be_clip(const Path& path) const {
    const clip::Format* format = clip::format_of_file(path);
    if (format == nullptr || format->read == nullptr) return false;
    if (format->is_hand) return of_hands();
    // A body holds two hands, so only --hand says which.
    return !of_hands() || !options_.hand.empty();
  }

  [[nodiscard]] const std::vector<std::string>& joints() const { return spec_.joints; }
  // Compares from now on without the bones that one of these lacks. Returns whether there are such.
  bool leave_out_lacking(const std::vector<natural::Figures>& corpus) {
    std::vector<std::string> lacking;
    for (std::size_t j = 0; j < spec_.joints.size(); ++j) {
      const auto lacks = [j](const natural::Figures& figures) {
        return figures.lacks.size() > 0 && figures.lacks[static_cast<Eigen::Index>(j)] > 0.0;
      };
      if (std::ranges::any_of(corpus, lacks)) lacking.push_back(spec_.joints[j]);
    }
    if (lacking.empty()) return false;  // as of hands, which have no space
    natural::remove_joints(lacking, spec_);
    return true;
  }

  Result<natural::Figures> operator()(const Path& path) const {
    auto figures = of_hands() ? hand_figures(path) : body_figures(path);
    if (!figures && figures.error().file.empty()) figures.error().file = path.string();
    return figures;
  }

 private:
  explicit Measure(const NaturalOptions& options) : options_(options) {}

  // A subject's clips have bones of their own, so a skeleton beside a clip of the corpus is right
  // for it and the named one is not.
  [[nodiscard]] clip::ReadOptions how(const Path& path) const {
    std::error_code ignored;
    const bool other = path != options_.clip && exists(clip::skeleton_beside(path), ignored);
    return clip::accepted_options(path, {.skeleton = other ? Path() : Path(options_.skeleton)});
  }
  Result<motion::Motion> body(const Path& path) const {
    const auto read = TRY(clip::read_clip(path, how(path)));
    auto motion = TRY(motion::performed_motion_of(read));
    motion.skeleton = natural::with_one_trunk(motion.skeleton);
    return motion::resample(motion, options_.rate_hz);
  }
  Result<natural::Figures> body_figures(const Path& path) const {
    const auto motion = TRY(body(path));
    return natural::figures_of(motion, spec_);
  }
  Result<natural::Figures> hand_figures(const Path& path) const {
    clip::ReadOptions read = how(path);
    if (!options_.hand.empty()) read.hand = side_named(options_.hand);
    auto hand = TRY(clip::read_hand_clip(path, read));
    clip::fill_gaps(hand);
    const auto recording = TRY(gesture::recording_of(hand, options_.rate_hz));
    return natural::figures_of(recording.angles_rad / kDegree, options_.rate_hz);
  }

  NaturalOptions options_;
  motion::PoseSpaceSpec spec_;  // of bodies
};

Result<std::vector<Path>> files_of(const Path& folder, const Measure& measure) {
  std::error_code error;
  std::filesystem::recursive_directory_iterator at(folder, error);
  if (error) {
    return misuse("is no folder that can be read: " + error.message(), folder.string());
  }
  std::vector<Path> files;
  Path last;  // where a folder cannot be entered, the iterator has ended
  std::error_code ignored;
  for (; at != std::filesystem::recursive_directory_iterator(); at.increment(error)) {
    last = at->path();
    if (at->is_regular_file(ignored) && measure.may_be_clip(last)) files.push_back(last);
  }
  if (error) {
    return fail("cannot be read: " + error.message() +
                    "; a part of a corpus has another spread, so make it readable or take it away",
                last.string());
  }
  std::ranges::sort(files);
  if (files.empty()) {
    return fail(measure.of_hands()
                    ? "the corpus holds no hand recording (" + clip::listed(clip::Use::kRead) +
                          "; of bodies, --hand says which hand)"
                    : "the corpus holds no clip (" + clip::listed(clip::Use::kReadBody) + ")",
                folder.string());
  }
  return files;
}

Result<> check_enough(const NaturalClips& clips, const Path& corpus) {
  if (clips.corpus.size() >= natural::kMinClips) return {};
  const std::size_t count = clips.corpus.size();
  std::string why = (count == 0   ? "no clip"
                     : count == 1 ? "one clip"
                                  : "two clips") +
                    std::string(" can be compared with, and a spread needs ") +
                    std::to_string(natural::kMinClips);
  if (!clips.left_out.empty()) {
    why += "; left out: " + clips.left_out.front().file + " (" + clips.left_out.front().why + ")";
    const std::size_t more = clips.left_out.size() - 1;
    if (more > 0) why += " and " + std::to_string(more) + " more";
  }
  return fail(why, corpus.string());
}

// A text, empty where the figures follow.
TaskResult numbers_of(const Path& file, const Path& own, const Measure& measure) {
  NumberWriter numbers;
  std::error_code ignored;
  if (std::filesystem::equivalent(file, own, ignored)) {
    return numbers.add("it is the clip itself").take();
  }
  const auto figures = measure(file);
  if (!figures) return numbers.add(figures.error().message).take();
  natural::write(*figures, numbers.add(""));
  return numbers.take();
}

void add_clip(const Path& file, const TaskResult& numbers, NaturalClips& clips) {
  NumberReader reader(numbers);
  std::string why = reader.text();
  if (why.empty()) {
    clips.corpus.push_back(natural::figures_from(reader));
  } else {
    clips.left_out.push_back({file.string(), std::move(why)});
  }
}

Result<NaturalClips> read_all(const NaturalOptions& options, const Measure& measure,
                              TaskRunner& tasks, const ReadProgress& progress) {
  NaturalClips clips;
  clips.clip = TRY(measure(options.clip));
  const auto files = TRY(files_of(options.corpus, measure));
  for (std::size_t first = 0; first < files.size(); first += kBatch) {
    const auto task = [&](std::size_t i) {
      return numbers_of(files[first + i], options.clip, measure);
    };
    const auto found =
        tasks.run(std::min(kBatch, files.size() - first), task, [&](std::size_t done) {
          const auto share = static_cast<double>(first + done) / static_cast<double>(files.size());
          return !progress || progress(share);
        });
    if (!found) return fail("stopped");
    for (std::size_t i = 0; i < found->size(); ++i) {
      add_clip(files[first + i], (*found)[i], clips);
    }
  }
  return clips;
}

}  // namespace

Result<NaturalClips> read_natural_clips(const NaturalOptions& options, TaskRunner& tasks,
                                        const ReadProgress& progress) {
  auto measure = TRY(Measure::of(options));
  auto clips = TRY(read_all(options, measure, tasks, progress));
  if (measure.leave_out_lacking(clips.corpus)) {
    clips = TRY(read_all(options, measure, tasks, progress));
  }
  clips.joints = measure.joints();
  TRY(check_enough(clips, options.corpus));
  return clips;
}

}  // namespace posed::tools
