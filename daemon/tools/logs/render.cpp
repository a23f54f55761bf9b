// `posed render`: draws a clip or a stream of a log as a strip of poses, as one pose or as a video.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/tools/command/clip_part.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/progress.hpp"
#include "daemon/tools/export/log_clip.hpp"
#include "daemon/tools/picture/picture_file.hpp"
#include "daemon/tools/picture/strip.hpp"
#include "models/motion/motion.hpp"
#include "models/style/model/harmonics.hpp"
#include "models/style/model/stride_phase.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/clip/timecode_cut.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

constexpr double kPose_px = 480.0;  // height of a single pose and of a video's
constexpr double kMaxVideoRate_hz = 30.0;

struct RenderArguments {
  std::string in;
  std::filesystem::path out;
  clip::ReadOptions read;
  std::string hand, stream, take, view = "three-quarter";
  bool strip = false, video = false, raw_beside = false, overwrite = false, json = false;
  std::optional<int> frame;
  int count = 8;
  double row_px = 260.0;
  ClipPart part;
};

// A motion ready to be drawn; a hand's gaps are filled.
struct Drawn {
  std::string name;
  motion::Motion motion;
  std::vector<double> time_s;  // [frame]
  std::unique_ptr<picture::FigureShape> shape;
};

Result<> check_render(const RenderArguments& options) {
  TRY(check_log_options(options.in, !options.stream.empty() || !options.take.empty(),
                        options.read));
  if (!is_log(options.in) && options.raw_beside) {
    return misuse("is a clip, which has one motion only; --raw-beside draws a log (.plog)",
                  options.in);
  }
  const std::string extension = clip::extension_of(options.out);
  const bool moves = extension == ".mp4" || extension == ".webp";
  if (moves != options.video) {
    return misuse(moves ? "a " + extension + " is a video: add --video"
                        : "a video is a .mp4 or an animated .webp: name one by --out",
                  options.out.string());
  }
  return OutputFiles(options.overwrite)
      .reads(options.in)
      .reads(options.read.skeleton)
      .writes(options.out, {".svg", ".png", ".mp4", ".webp"})
      .check();
}

// A clip of fingers without a body (a BVH of `posed synth`) as a hand of ours, which is drawn as
// one.
Result<clip::Clip> as_hand(const clip::Clip& clip, const clip::ReadOptions& read) {
  auto hand = TRY(clip::hand_of(clip, read));
  return clip::clip_of_hand(hand, read.hand_shape);
}

// --hand of a body says which of its hands is drawn, once it is read.
clip::ReadOptions in_options(const RenderArguments& options) {
  clip::ReadOptions read = options.read;
  if (!clip::accepts(options.in, clip::ReadOption::kHand)) read.hand.reset();
  return read;
}

Result<clip::Clip> read_motion(const RenderArguments& options, bool raw) {
  const Waiting waiting("reading " + options.in);
  auto clip = is_log(options.in) ? clip_of_log(options.in, options.stream, options.take, raw)
                                 : clip::read_clip(options.in, in_options(options));
  if (clip) {
    clip = clip::cut_by_timecode(*std::move(clip), options.part.from_timecode,
                                 options.part.to_timecode);
  }
  if (clip && clip->skeleton->joint_of(Bone::kHips) < 0 && !hand_side(*clip->skeleton)) {
    if (auto hand = as_hand(*clip, options.read)) clip = std::move(hand);
  }
  if (clip) clip::hold_missing(*clip);
  return clip;
}

// The frames between --from and --to.
Result<Drawn> drawn_of(const RenderArguments& options, const clip::Clip& clip, std::string name) {
  auto motion = TRY(motion::motion_of(clip));
  Drawn drawn;
  drawn.name = std::move(name);
  drawn.motion.skeleton = motion.skeleton;
  drawn.motion.rate_hz = motion.rate_hz;
  const auto range = TRY(frames_between(clip, options.part, options.in));
  for (int i = range.first; i < range.end; ++i) {
    drawn.motion.frames.push_back(motion.frames[i]);
    drawn.time_s.push_back(clip.time_of_s(i));
  }
  drawn.shape = std::make_unique<picture::FigureShape>(drawn.motion.skeleton);
  return drawn;
}

// The motions to draw: with --raw-beside the unstyled one first.
Result<std::vector<Drawn>> read_all(const RenderArguments& options) {
  std::vector<Drawn> all;
  const auto add = [&](bool raw, const std::string& name) -> Result<> {
    const auto clip = TRY(read_motion(options, raw));
    for (const std::string& warning : clip.warnings) {
      std::fprintf(stderr, "posed: %s\n", clean(options.in + ": " + warning).c_str());
    }
    auto drawn = TRY(drawn_of(options, clip, name));
    all.push_back(std::move(drawn));
    return {};
  };
  if (options.raw_beside) {
    TRY(add(true, "as it came in"));
  }
  TRY(add(false, options.raw_beside ? "as posed published it" : ""));
  return all;
}

picture::Camera camera_of(const Drawn& drawn, picture::View view) {
  return {view, drawn.shape->facing(motion::walk_heading_rad(drawn.motion))};
}

picture::StripPose pose_at(const Drawn& drawn, std::size_t frame, std::string caption) {
  return {.figure = drawn.shape->pose(drawn.motion.frames[frame]), .caption = std::move(caption)};
}

std::string title_of(const RenderArguments& options) {
  const std::string file = std::filesystem::path(options.in).filename().string();
  return options.stream.empty() ? file : file + ", " + options.stream;
}

std::string time_words(double time_s) { return fmt::format("{:.2f} s", time_s); }

// Frames at even distances. Of a walk each moves by up to half a distance, so that the pictures go
// through one stride together, because at a whole stride's distance all would show the same pose.
std::vector<int> strip_frames(const motion::Motion& motion, int poses) {
  const int end = motion.size() - 1;
  const double step = poses > 1 ? 1.0 * end / (poses - 1) : 0.0;
  std::vector<int> frames;
  for (int i = 0; i < poses; ++i) frames.push_back(static_cast<int>(std::lround(i * step)));
  const auto leg = motion::leg_signal(motion);
  if (poses < 3 || !leg || !style::has_stride(motion.size(), motion.rate_hz)) return frames;
  const auto walk = style::walk_phases(*leg, motion.rate_hz);
  if (!walk) return frames;
  const auto& phase = walk->phase;
  const auto walked = static_cast<double>(walk->frames.back() - walk->frames.front());
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const double stride = walked * kTurn / (phase[phase.size() - 1] - phase[0]);  // frames
  if (!(step > stride / 4.0)) return frames;
  for (int i = 0; i < poses; ++i) {
    double least = std::numeric_limits<double>::infinity();
    int nearest = frames[i];
    for (std::size_t k = 0; k < walk->frames.size(); ++k) {
      const double away = std::abs(static_cast<double>(walk->frames[k]) - i * step) / step;
      if (away > 0.5) continue;
      const double wanted = phase[0] + kTurn * i / poses;
      const double off =
          std::abs(std::remainder(phase[static_cast<Eigen::Index>(k)] - wanted, kTurn)) +
          away / 4.0;
      if (off >= least) continue;
      least = off;
      nearest = static_cast<int>(walk->frames[k]);
    }
    frames[i] = nearest;
  }
  return frames;
}

// `count` poses of each motion, or the one pose of --frame.
Result<std::string> still(const RenderArguments& options, const std::vector<Drawn>& all,
                          picture::View view) {
  const Drawn& last = all.back();
  if (options.frame && (*options.frame < 0 || *options.frame >= last.motion.size())) {
    return misuse(
        fmt::format("has the frames 0 to {}, not {}", last.motion.size() - 1, *options.frame),
        options.in);
  }
  const int poses = options.frame ? 1 : std::min(options.count, last.motion.size());
  const std::vector<int> frames =
      options.frame ? std::vector{*options.frame} : strip_frames(last.motion, poses);
  std::vector<picture::StripRow> rows;
  for (const Drawn& drawn : all) {
    picture::StripRow row{.title = drawn.name, .pale = all.size() > 1 && rows.empty(), .poses = {}};
    for (const int frame : frames) {
      const std::size_t at = std::min(frame, drawn.motion.size() - 1);
      row.poses.push_back(pose_at(drawn, at, time_words(drawn.time_s[at])));
    }
    rows.push_back(std::move(row));
  }
  const picture::Camera camera = camera_of(last, view);
  const bool ground = !last.shape->is_hand();
  const auto layout =
      picture::layout_of(rows, camera, options.frame ? kPose_px : options.row_px, ground);
  return picture::strip_svg(
      rows, camera, layout,
      {.title = title_of(options),
       .sentence = fmt::format("{} pose{} seen {}; {}{}.", poses, poses == 1 ? "" : "s",
                               picture::view_words(view), last.shape->legend(),
                               ground ? "; the ground is marked each 0.5 m" : "")});
}

Result<> render_video(const RenderArguments& options, const std::vector<Drawn>& all,
                      picture::View view) {
  const Drawn& last = all.back();
  const picture::Camera camera = camera_of(last, view);
  const double duration_s = last.time_s.back() - last.time_s.front();
  const double rate_hz = std::min(kMaxVideoRate_hz, last.motion.rate_hz);
  const int frames = static_cast<int>(duration_s * rate_hz) + 1;
  // The motions side by side, each at the frame of that time.
  const auto row_at = [&](int frame) {
    const double time_s = last.time_s.front() + frame / rate_hz;
    picture::StripRow row;
    for (const Drawn& drawn : all) {
      const auto next = std::ranges::upper_bound(drawn.time_s, time_s + 1e-6);
      const auto at =
          static_cast<std::size_t>(std::max(next - drawn.time_s.begin() - 1, std::ptrdiff_t{0}));
      const std::string words = time_words(time_s);
      row.poses.push_back(
          pose_at(drawn, at, drawn.name.empty() ? words : drawn.name + ", " + words));
    }
    return row;
  };
  std::vector<picture::StripRow> every;
  every.reserve(frames);
  for (int frame = 0; frame < frames; ++frame) every.push_back(row_at(frame));
  const auto layout = picture::layout_of(every, camera, kPose_px, !last.shape->is_hand());
  ProgressBar bar(kQuietFor_s);
  const picture::StripText text{
      .title = title_of(options),
      .sentence = fmt::format("Seen {}; {}.", picture::view_words(view), last.shape->legend())};
  const auto done = picture::write_video(
      {.frames = frames,
       .rate_hz = rate_hz,
       .draw =
           [&](int frame) {
             const std::size_t at = frame;
             return picture::strip_svg({every[at]}, camera, layout, text);
           },
       .progress = [&](int drawn) { return bar.show("drawing", 1.0 * drawn / frames); }},
      options.out);
  bar.finish();
  return done;
}

Result<> run_render(const RenderArguments& options) {
  TRY(check_render(options));
  const auto view = TRY(picture::view_from_name(options.view));
  const auto all = TRY(read_all(options));
  if (options.video) {
    TRY(render_video(options, all, view));
  } else {
    const auto svg = TRY(still(options, all, view));
    TRY(picture::write_picture(svg, options.out));
  }
  const Drawn& last = all.back();
  Findings()
      .add("in", options.in)
      .add("out", options.out.string())
      .add("view", options.view)
      .add("frames", last.motion.size())
      .add("from_s", last.time_s.front())
      .add("to_s", last.time_s.back())
      .remark("wrote " + options.out.string())
      .show(options.json, -1);
  return {};
}

}  // namespace

void add_render(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("render", "Draw a clip or a log's stream: strip or video");
  auto options = std::make_shared<RenderArguments>();
  command
      ->add_option("IN", options->in,
                   "To draw: " + clip::listed(clip::Use::kRead) + "; or a log (.plog)")
      ->required();
  command->add_option("--out", options->out, "To write: .svg or .png; .mp4 or .webp with --video")
      ->required();
  auto* strip = command->add_flag("--strip", options->strip, "Poses side by side (the default)");
  auto* frame = command->add_option("--frame", options->frame, "One pose: this frame, from 0")
                    ->excludes(strip);
  auto* video = command
                    ->add_flag("--video", options->video,
                               "The motion as an .mp4, or a .webp that repeats (needs ffmpeg)")
                    ->excludes(strip)
                    ->excludes(frame);
  command->add_option("--view", options->view, "From where the figure is seen")
      ->check(CLI::IsMember({"front", "side", "three-quarter"}))
      ->capture_default_str();
  command->add_option("--count", options->count, "Poses of a strip; of a walk they share a stride")
      ->check(CLI::Range(1, 100))
      ->excludes(frame)
      ->excludes(video)
      ->capture_default_str();
  command->add_option("--height", options->row_px, "Height of a strip's poses [px]")
      ->check(CLI::Range(40, 4000))
      ->capture_default_str();
  add_part_options(*command, options->part);
  command->add_flag("--raw-beside", options->raw_beside,
                    "The unstyled motion of a log, too, in grey");
  command->add_option("--stream", options->stream,
                      "Which of a log's streams (default: the only one)");
  command->add_option("--take", options->take, "Only this take of a log: its number or its name");
  command->add_option("--skeleton", options->read.skeleton,
                      "Skeleton of an AMC (default: beside it, such as NN.asf of NN_MM.amc)");
  add_figure_options(*command, options->read);
  command->add_option("--hand", options->hand, "The hand of a hand CSV")
      ->check(CLI::IsMember({"left", "right"}));
  add_overwrite_option(*command, options->overwrite);
  command->add_flag("--json", options->json, "Print a summary as JSON on stdout");
  command->footer(
      "The camera looks at a walker along its way; the pictures are without perspective, so poses\n"
      "can be compared. No display is needed.\n\n"
      "Examples:\n"
      "  posed render walk.bvh --out walk.png\n"
      "  posed render walk.bvh --view side --from 1 --to 2.2 --count 6 --out stride.svg\n"
      "  posed render glove.csv --hand left --frame 40 --out sign.png\n"
      "  posed render take1.plog --stream walker --raw-beside --video --out walker.mp4\n"
      "  posed render walk.bvh --video --from 1 --to 3 --out walk.webp   # for a page");
  command->callback([options, &exit_code] {
    if (!options->hand.empty()) {
      options->read.hand = side_named(options->hand);
    }
    exit_code = report(run_render(*options));
  });
}

}  // namespace posed::tools
