// `posed inspect`: what posed takes the figure of a clip or a running stream for, bone by bone,
// drawn in T-pose beside the first frame, and the file that corrects it. `posed compare`: whether
// two clips show one figure.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <toml++/toml.h>
#include <CLI/CLI.hpp>

#include "daemon/config/config.hpp"
#include "daemon/tools/command/client.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/live/chosen_stream.hpp"
#include "daemon/tools/logs/robot_table.hpp"
#include "daemon/tools/picture/braille.hpp"
#include "daemon/tools/picture/picture_file.hpp"
#include "daemon/tools/picture/strip.hpp"
#include "models/motion/motion.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/clip/format.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/message/bounded_parse.hpp"
#include "proto/rig/live.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"

namespace posed::tools {
namespace {

constexpr double kUnsure = 0.5;
constexpr double kRow_px = 320.0;

struct InspectArguments {
  std::string in, tips;
  std::filesystem::path write, out;
  clip::ReadOptions read;
  ClientOptions client;
  double timeout_s = 0.0;
  bool overwrite = false, json = false;
};

// What is inspected: of a stream the clip has no frames, and the motion its one pose.
struct Inspected {
  clip::Clip clip;
  motion::Motion motion;
};

Result<clip::Clip> read_figure(const std::string& path, const clip::ReadOptions& options) {
  auto clip = TRY(clip::read_clip(path, options));
  if (clip.rig) return clip;
  return misuse("holds the angles of a known hand; there is no figure to recognise", path);
}

Result<Inspected> read_file(const InspectArguments& options) {
  auto clip = TRY(read_figure(options.in, options.read));
  auto motion = TRY(motion::motion_of(clip));
  return Inspected{.clip = std::move(clip), .motion = std::move(motion)};
}

// A file's name has a dot, a slash or a capital, or the file is there.
bool is_stream(const std::string& in) {
  std::error_code ignored;
  return config::is_stream_name(in) && !std::filesystem::exists(in, ignored);
}

// Fails if the daemon has streams, but not this one, and none can come. Streams of bodies come and
// go.
Result<> look_for(const std::string& stream, std::span<const std::byte> bytes) {
  v1::Stats stats;
  if (!message::parse_bounded(stats, bytes) || stats.stream().empty() || !stats.source().empty()) {
    return {};
  }
  std::string names;
  for (const v1::StreamStats& one : stats.stream()) {
    if (one.stream() == stream) return {};
    add_word(names, one.stream());
  }
  return fail("there is no file and no stream " + in_quotes(stream) + "; the daemon has " +
              clean(names));
}

// Waits for the stream's skeleton and a pose of it.
Result<StreamFigure> await_figure(const InspectArguments& options) {
  const Interrupt interrupt;
  const auto begin = std::chrono::steady_clock::now();
  auto connection = TRY(Connection::open(options.client, ZMQ_SUB));
  SilenceWatch watch(connection, options.timeout_s);
  StreamFigure figure(options.in);
  for (const std::string& topic :
       {"skeleton/" + options.in, "pose/" + options.in, std::string("stats")}) {
    TRY(connection.subscribe(topic));
  }
  while (!figure.pose()) {
    if (Interrupt::came()) return fail("interrupted before a pose of " + options.in + " came");
    if (auto refused = connection.refusal()) return std::unexpected(*refused);
    if (auto given_up = watch.report()) return std::unexpected(*given_up);
    const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - begin;
    if (options.timeout_s > 0.0 && waited.count() >= options.timeout_s) {
      return fail(
          fmt::format("no pose of {} came in {} s (--timeout)", options.in, options.timeout_s));
    }
    net::Message topic, body;
    if (!connection.wait(kLookAround) || !connection.receive(topic, body)) continue;
    watch.beat();
    figure.handle(topic.text(), body.bytes());
    if (topic.text() == "stats") TRY(look_for(options.in, body.bytes()));
  }
  return figure;
}

// The recogniser is asked again, for how sure it is. Where it finds another bone or T frame, one
// who knows has said so.
std::shared_ptr<const rig::Rig> evidence_of(const Skeleton& skeleton) {
  rig::Rig rig = rig::recognise(skeleton);
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    const double off_rad = angle_between_rad(rig.T[j], joint.T_world_joint);
    if (joint.bone && (rig.bone[j] != joint.bone || off_rad > kDegree)) {
      rig.evidence[j] = {1.0, "the stream's driver or mapping says so"};
    }
    rig.bone[j] = joint.bone;
    rig.T[j] = joint.T_world_joint;
  }
  rig.up = UpAxis::kPlusY;
  rig.why_up = "as all streams of posed";
  rig.unit = "m";
  rig.why_unit.clear();
  rig.notes.clear();
  return std::make_shared<const rig::Rig>(std::move(rig));
}

Result<Inspected> take_stream(const InspectArguments& options) {
  const clip::ReadOptions& read = options.read;
  if (!read.profile.empty() || read.up || read.facing || read.metres_per_unit) {
    return misuse(
        options.in +
        " is a stream, whose source says what it is; for --profile, --up, --facing and --unit name"
        " a file");
  }
  const auto figure = TRY(await_figure(options));
  Inspected taken;
  taken.clip.path = options.in;
  taken.clip.skeleton = figure.skeleton();
  taken.clip.metres_per_unit = 1.0;
  taken.motion = {.skeleton = figure.skeleton(), .rate_hz = 1.0, .frames = {*figure.pose()}};
  taken.clip.rig = evidence_of(*figure.skeleton());
  return taken;
}

// The frame in which the figure stands in the T-pose, where the first one stands.
Frame t_pose(const motion::Motion& motion) {
  Frame frame = motion.frames[0];
  const Skeleton& skeleton = *motion.skeleton;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    frame.rotation_xyzw[j] = from_eigen(local_from_canonical(skeleton, j));
    frame.valid[j] = true;
  }
  return frame;
}

struct Drawing {
  picture::FigureShape shape;
  std::vector<picture::StripRow> rows;
  double heading_rad = 0.0;

  [[nodiscard]] picture::Camera camera(picture::View view, double heading) const {
    return {view, shape.facing(heading)};
  }
};

Drawing drawing_of(const motion::Motion& motion) {
  Drawing drawing{.shape = picture::FigureShape(motion.skeleton),
                  .rows = {},
                  .heading_rad = motion::walk_heading_rad(motion)};
  drawing.rows.push_back({.title = "", .poses = {}});
  drawing.rows[0].poses.push_back({drawing.shape.pose(t_pose(motion)), "T-pose"});
  drawing.rows[0].poses.push_back({drawing.shape.pose(motion.frames[0]), "first frame"});
  return drawing;
}

// Four views beside each other, for the terminal: T-pose and first frame, from the front and the
// side.
std::vector<std::string> terminal_drawing(const Drawing& drawing) {
  constexpr int kColumns = 19;
  constexpr int kRows = 14;
  std::vector<std::string> lines(
      kRows + 1, std::string(drawing.rows[0].poses[0].figure.sticks.empty() ? 0 : 1, ' '));
  lines[0] = fmt::format(" {:<{}}{:<{}}", "T-pose", 2 * kColumns, "first frame", 2 * kColumns);
  for (std::size_t p = 0; p < drawing.rows[0].poses.size(); ++p) {
    // In T-pose a figure looks along +Z, whatever the motion's heading.
    const double heading_rad = p == 0 ? 0.0 : drawing.heading_rad;
    for (const auto view : {picture::View::kFront, picture::View::kSide}) {
      const picture::Camera camera = drawing.camera(view, heading_rad);
      const auto room = picture::layout_of(drawing.rows, camera, kRow_px, true);
      const auto rows =
          picture::braille(drawing.rows[0].poses[p].figure, camera, room, kColumns, kRows);
      for (std::size_t r = 0; r < rows.size(); ++r) lines[r + 1] += rows[r];
    }
  }
  return lines;
}

bool is_of_the_body(Bone bone) { return bone < Bone::kLeftThumbMetacarpal; }

std::string missing_bones(const Skeleton& skeleton) {
  std::string names;
  for (int b = 0; b < kBones; ++b) {
    const auto bone = static_cast<Bone>(b);
    if (!is_of_the_body(bone) || skeleton.joint_of(bone) >= 0) continue;
    add_word(names, bone_name(bone));
  }
  return names;
}

std::string_view kind_words(const Skeleton& skeleton) {
  if (motion::is_person(skeleton)) return "a person";
  return skeleton.joint_of(Bone::kLeftHand) >= 0 || skeleton.joint_of(Bone::kRightHand) >= 0
             ? "a hand, or a part of a person"
             : "no person";
}

void add_bones(const clip::Clip& clip, Findings& findings) {
  std::vector<Findings> bones;
  int others = 0;
  for (std::size_t j = 0; j < clip.skeleton->joints.size(); ++j) {
    const Joint& joint = clip.skeleton->joints[j];
    if (!joint.bone) {
      ++others;
      continue;
    }
    const rig::Evidence& evidence = clip.rig->evidence[j];
    bones.push_back(
        Findings()
            .add("bone", bone_name(*joint.bone))
            .add("joint", joint.name)
            .add("sure", evidence.sure)
            .add("why", evidence.why)
            .say(fmt::format("  {:<24} {:<24} {:4.2f}{} {}", bone_name(*joint.bone),
                             clean_name(joint.name), evidence.sure,
                             evidence.sure < kUnsure ? " ?" : "  ", clean(evidence.why))));
  }
  findings.say(fmt::format("  {:<24} {:<24} sure", "bone", "joint"));
  findings.add("bones", bones);
  findings.add("other_joints", others);
  const std::string missing = missing_bones(*clip.skeleton);
  findings.add("missing", missing);
  if (!missing.empty()) findings.say("  it has no " + missing);
  if (others > 0) findings.say(fmt::format("  {} joints are no bones of a person", others));
}

// Of the file; Clip's own is that of a BVH which is written of it.
double unit_of(const clip::Clip& clip) {
  return clip.rig->metres_per_unit.value_or(clip.metres_per_unit);
}

std::string facing_words(const rig::Rig& rig) {
  if (rig.facing.empty()) return {};
  return fmt::format(", the zero pose faces {} ({})", rig.facing, rig.why_facing);
}

Findings findings_of(const InspectArguments& options, const clip::Clip& clip,
                     const Drawing& drawing) {
  Findings findings;
  const double unit_m = unit_of(clip);
  std::string unit = clip.rig->unit;
  if (unit.empty()) unit = fmt::format("{:g} m", unit_m);
  if (unit_m == 1.0) unit = "metres";
  if (unit_m == 0.01) unit = "centimetres";
  findings.add("in", options.in)
      .add("person", motion::is_person(*clip.skeleton))
      .add("up", up_text(clip.up))
      .add("metres_per_unit", unit_m)
      .add("facing", clip.rig->facing)
      .say(fmt::format("{}: {}; {} points up{}{}, lengths in {}{}", options.in,
                       kind_words(*clip.skeleton), up_text(clip.up),
                       clip.rig->why_up.empty() ? "" : " (" + clip.rig->why_up + ")",
                       facing_words(*clip.rig), unit,
                       clip.rig->why_unit.empty() ? "" : " (" + clip.rig->why_unit + ")"));
  for (const std::string& line : terminal_drawing(drawing)) findings.say(line);
  add_bones(clip, findings);
  findings.add("notes", clip.rig->notes);
  for (const std::string& note : clip.rig->notes) findings.say("  note: " + clean(note));
  return findings;
}

std::string quoted(const std::string& text) {
  std::ostringstream out;
  out << toml::value<std::string>(text);
  return out.str();
}

// The profile that says of this skeleton what was recognised; T as three angles [deg], x innermost.
std::string profile_text(const clip::Clip& clip) {
  std::string text = fmt::format(
      "# Written by `posed inspect {}`. Correct what is wrong, and give the file as the profile.\n"
      "name = {}\nmetres_per_unit = {:.9g}\nup = \"{}\"\n\n[bones] # bone = joint\n",
      clean(std::filesystem::path(clip.path).filename().string()), quoted(clip.skeleton->name),
      unit_of(clip), up_text(clip.up));
  std::string frames = "\n[T] # turn of each joint's axes in the T-pose [deg] about x, y, z\n";
  for (std::size_t j = 0; j < clip.skeleton->joints.size(); ++j) {
    const Joint& joint = clip.skeleton->joints[j];
    if (!joint.bone) continue;
    text += fmt::format("{} = {} # sure {:.2g}: {}\n", bone_name(*joint.bone), quoted(joint.name),
                        clip.rig->evidence[j].sure, clean(clip.rig->evidence[j].why));
    const Eigen::Vector3d zyx_rad = clip.rig->T[j].toRotationMatrix().eulerAngles(2, 1, 0);
    frames += fmt::format("{} = [{:.6f}, {:.6f}, {:.6f}]\n", quoted(joint.name),
                          zyx_rad[2] / kDegree, zyx_rad[1] / kDegree, zyx_rad[0] / kDegree);
  }
  return text + frames;
}

// A robot hand: what the stage of that name derives from its URDF.
Result<> inspect_robot(const InspectArguments& options) {
  if (!options.write.empty() || !options.out.empty()) {
    return misuse("a URDF has no profile and no picture; leave out --write and --out");
  }
  const auto text = TRY(robot::load_urdf(options.in));
  auto urdf = TRY(robot::parse_urdf(text, options.in));
  const auto hand = TRY(robot::robot_hand(
      std::move(urdf), {.tips = options.tips, .needs_speeds = false}, options.in));
  Findings findings;
  const auto lines = robot_table(hand);
  findings.add("in", options.in).add("table", lines);
  for (const std::string& line : lines) findings.say(line);
  findings.show(options.json);
  return {};
}

Result<> run_inspect(const InspectArguments& options) {
  if (options.in.ends_with(".urdf")) return inspect_robot(options);
  if (!options.tips.empty()) return misuse("only a robot hand (.urdf) has --tips");
  const bool live = is_stream(options.in);
  TRY(OutputFiles(options.overwrite)
          .reads(live ? std::string() : options.in)
          .writes(options.write, {".toml"})
          .writes(options.out, {".svg", ".png"})
          .check());
  const auto [clip, motion] = TRY(live ? take_stream(options) : read_file(options));
  const Drawing drawing = drawing_of(motion);
  if (!options.write.empty()) TRY(write_whole_file(options.write, profile_text(clip)));
  if (!options.out.empty()) {
    const auto camera = drawing.camera(picture::View::kThreeQuarter, 0.0);
    const auto layout = picture::layout_of(drawing.rows, camera, kRow_px, true);
    TRY(picture::write_picture(
        picture::strip_svg(drawing.rows, camera, layout,
                           {.title = std::filesystem::path(options.in).filename().string(),
                            .sentence = "What posed takes the figure for; " +
                                        std::string(drawing.shape.legend())}),
        options.out));
  }
  findings_of(options, clip, drawing).show(options.json);
  return {};
}

struct Difference {
  std::string joint;
  double value = 0.0;

  void see(const std::string& name, double other) {
    if (!(other > value)) return;
    value = other;
    joint = name;
  }
};

Result<int> run_compare(const std::string& a, const std::string& b, bool json) {
  constexpr double kSame_deg = 0.01;
  constexpr double kSameLength = 0.01;
  const auto first = TRY(read_figure(a, {}));
  const auto second = TRY(read_figure(b, {}));
  Difference turn_deg;
  Difference length;
  std::string missing;
  for (const Joint& joint : first.skeleton->joints) {
    const int other = joint.bone ? second.skeleton->joint_of(*joint.bone)
                                 : second.skeleton->joint_index(joint.name);
    if (other < 0) {
      add_word(missing, clean_name(joint.name));
      continue;
    }
    const Joint& there = second.skeleton->joints[other];
    turn_deg.see(joint.name, angle_between_rad(joint.T_world_joint, there.T_world_joint) / kDegree);
    const double longer = std::max(joint.offset_m.norm(), there.offset_m.norm());
    if (joint.parent < 0 || longer < 0.01) continue;
    length.see(joint.name, std::abs(joint.offset_m.norm() - there.offset_m.norm()) / longer);
  }
  const bool same_skeleton =
      missing.empty() && first.skeleton->joints.size() == second.skeleton->joints.size();
  const bool same_T = turn_deg.value <= kSame_deg;
  const bool same_size = length.value <= kSameLength;
  Findings findings;
  findings.add("same_skeleton", same_skeleton)
      .add("same_T", same_T)
      .add("same_size", same_size)
      .add("T_deg", turn_deg.value)
      .add("length_share", length.value)
      .add("missing", missing)
      .say(same_skeleton
               ? "same joints"
               : "other joints" + (missing.empty() ? "" : ": " + b + " has no " + missing))
      .say(same_T ? "same T-pose"
                  : fmt::format("other T-pose: {} is {:.2f} deg apart", clean_name(turn_deg.joint),
                                turn_deg.value))
      .say(same_size ? "same sizes"
                     : fmt::format("other sizes: {} differs by {:.0f} %", clean_name(length.joint),
                                   100.0 * length.value));
  findings.verdict(same_skeleton && same_T ? (same_size ? "one figure" : "one figure, two persons")
                                           : "two figures",
                   same_skeleton && same_T);
  return findings.show(json);
}

}  // namespace

void add_inspect(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("inspect", "Show what posed takes a figure for, bone by bone");
  const auto options = std::make_shared<InspectArguments>();
  command
      ->add_option("IN", options->in,
                   "A stream of a running daemon, a robot hand (.urdf), or a clip: " +
                       clip::listed(clip::Use::kRead))
      ->required();
  command
      ->add_option("--write", options->write,
                   "Write it as a profile to correct, which --profile, [stream.file] and a "
                   "source's skeleton take")
      ->type_name("MAP.toml");
  command->add_option("--out", options->out, "Draw T-pose and first frame")
      ->type_name("OUT.svg|png");
  command->add_option("--tips", options->tips,
                      "Of a robot of several hands: the last links of one, thumb first, as in "
                      "[stream.robot]");
  add_figure_options(*command, options->read);
  add_client_options(*command, options->client, kOwnPublish);
  add_timeout_option(*command, options->timeout_s);
  add_overwrite_option(*command, options->overwrite);
  command->add_flag("--json", options->json, "Print the findings as JSON on stdout");
  command->callback([options, &exit_code] { exit_code = report(run_inspect(*options)); });
}

void add_compare(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("compare", "Tell whether two clips show one figure, and one person");
  struct Arguments {
    std::string a, b;
    bool json = false;
  };
  const auto options = std::make_shared<Arguments>();
  command->add_option("A", options->a, "A clip")->required();
  command->add_option("B", options->b, "Another one")->required();
  command->add_flag("--json", options->json, "Print the findings as JSON on stdout");
  command->callback([options, &exit_code] {
    const auto done = run_compare(options->a, options->b, options->json);
    exit_code = done ? *done : report(done.error());
  });
}

}  // namespace posed::tools
