// `posed convert`: converts a clip to another format, a stream of a device log to a clip, or a
// whole log to MCAP.
#include <memory>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/tools/command/client.hpp"
#include "daemon/tools/command/clip_part.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/progress.hpp"
#include "daemon/tools/export/log_clip.hpp"
#include "daemon/tools/export/log_mcap.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/clip/mirror.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"

namespace posed::tools {
namespace {

// The line is like "2  walk  from 3.20 s, 10.05 s long". Of a take with gaps only what is left has
// a time, so that it may seem shorter than it was.
Findings findings_of(const LoggedTake& take) {
  const bool ended = take.row.last_item != log::kToTheEnd;
  std::string end = ended ? "" : ", to the end of the recording";
  if (take.has_gaps) end += "; the log lacks a part of it (`posed replay` says which)";
  Findings findings;
  findings.add("take", take.row.id)
      .add("name", take.row.name)
      .add("first_item", take.row.first_item)
      .add("ended", ended)
      .add("gaps", take.has_gaps);
  if (ended) findings.add("last_item", take.row.last_item);
  std::string time = "nothing came";
  if (take.begin_s) {
    const double length_s = *take.end_s - *take.begin_s;
    findings.add("begin_s", *take.begin_s).add("length_s", length_s);
    time = fmt::format("from {:.2f} s, {:.2f} s long", *take.begin_s, length_s);
  }
  findings.add("timecode", take.row.timecode);
  if (!take.row.timecode.empty()) time += ", timecode " + clean(take.row.timecode);
  return findings.say(fmt::format("{}  {}  {}{}", take.row.id, clean(take.row.name), time, end));
}

// Prints the takes of the log at `path`, a line each, or as JSON. Returns the exit code.
int list_takes(const std::string& path, bool json) {
  auto reader = log::Reader::open(path);
  if (!reader) return report(reader.error());
  const auto takes = logged_takes(*reader);
  if (!takes) return report(takes.error());
  std::vector<Findings> list;
  for (const LoggedTake& take : *takes) list.push_back(findings_of(take));
  Findings findings;
  findings.add({}, list);
  if (list.empty()) findings.remark(path + ": has no takes");
  return findings.show(json, -1);
}

// Writes a whole log as MCAP. Returns the exit code. Ctrl-C leaves no file.
int convert_to_mcap(const std::string& log, const std::string& out, bool json) {
  const auto summary = [&] {
    // A file is written with signals blocked, so the thread that shows the wait receives Ctrl-C.
    const Waiting waiting("writing " + out);
    const Interrupt interrupt;
    return write_mcap(log, out, Interrupt::came);
  }();
  if (!summary) return report(summary.error());
  Findings findings;
  for (const std::string& warning : summary->warnings) findings.remark(log + ": " + warning);
  return findings.add("in", log)
      .add("out", out)
      .add("messages", summary->messages)
      .add("topics", summary->topics)
      .add("warnings", summary->warnings)
      .remark(fmt::format("wrote {}: {} messages in {} topics", out, summary->messages,
                          summary->topics))
      .show(json, -1);
}

constexpr const char* kUneven = "frames are not evenly spaced, but a BVH's are: its clock differs";

struct Convert {
  std::string in;
  std::string out;
  clip::ReadOptions read;
  std::string hand;    // "left", "right" or not given
  std::string stream;  // of a log; empty: the only one
  std::string take;    // of a log, a number or a name; empty: all
  ClipPart part;
  bool takes = false;   // list those of a log
  bool mirror = false;  // left for right
  bool overwrite = false, json = false;
  bool shape_given = false;
};

bool is_mcap(const std::string& path) { return clip::extension_of(path) == ".mcap"; }
bool is_hand(const std::string& path) {
  const clip::Format* format = clip::format_of_file(path);
  return format != nullptr && format->is_hand;
}
bool holds_gaps(const std::string& path) { return clip::format_of(path)->holds_gaps; }

// Refuses options that would have no effect for this input or output. Those of a clip's format the
// table of formats refuses, when the clip is read.
Result<> check_options(const Convert& convert) {
  const auto useless = [&](bool given, bool means_something, const char* what) -> Result<> {
    if (!given || means_something) return {};
    return misuse(what, convert.in);
  };
  const bool part_given = !convert.stream.empty() || !convert.take.empty();
  for (const auto& checked :
       {check_log_options(convert.in, part_given, convert.read),
        useless(part_given || convert.part.given(), !is_mcap(convert.out),
                "is written as a whole log, so --stream, --take, --from and --to have no effect"),
        useless(is_mcap(convert.out), is_log(convert.in),
                "is not a device log (.plog), and only a log becomes a .mcap; name a .glb"),
        useless(!convert.hand.empty(), is_hand(convert.in) || is_hand(convert.out),
                "neither IN nor OUT is a hand CSV, so --hand has no effect"),
        useless(convert.mirror,
                !is_mcap(convert.out) && !is_hand(convert.in) && !is_hand(convert.out),
                "--mirror is for clips of bodies; of a hand CSV --hand says which hand it is"),
        useless(convert.shape_given, is_hand(convert.in) && !is_hand(convert.out),
                "--hand-shape is for a hand CSV that becomes a figure, and has no effect here")}) {
    if (!checked) return checked;
  }
  auto written = clip::extensions(clip::Use::kWrite);
  written.push_back(".mcap");
  return OutputFiles(convert.overwrite)
      .reads(convert.in)
      .reads(convert.read.skeleton)
      .writes(convert.out, std::move(written))
      .check();
}

void warn_of_clock(const Convert& convert, clip::Clip& clip) {
  if (clip::format_of(convert.out)->evenly_spaced &&
      clip::has_uneven_times(clip.time_s, clip.frame_rate_hz)) {
    clip.warnings.emplace_back(kUneven);
  }
}

Result<clip::Clip> read_log(const Convert& convert) {
  auto clip = clip_of_log(convert.in, convert.stream, convert.take);
  if (!clip) return clip;
  if (!holds_gaps(convert.out)) clip::hold_missing(*clip);
  if (clip::format_of(convert.out)->evenly_spaced) clip::hold_gaps(*clip);
  return clip;
}

// The clip as OUT can hold it. A hand that becomes a figure gets its gaps filled.
Result<clip::Clip> read(const Convert& convert) {
  if (is_log(convert.in)) return read_log(convert);
  clip::ReadOptions options = convert.read;
  if (!is_hand(convert.in)) options.hand.reset();  // of a body it says which hand is written
  auto clip = clip::read_clip(convert.in, options);
  if (!clip || !is_hand(convert.in) || is_hand(convert.out)) return clip;
  auto hand = TRY(clip::hand_of(*clip));
  clip::fill_gaps(hand);
  return clip::clip_of_hand(hand, convert.read.hand_shape);
}

Result<> write(const Convert& convert, const clip::Clip& clip) {
  if (!is_hand(convert.out)) return clip::write_clip(clip, convert.out);
  const auto hand = TRY(clip::hand_of(clip, convert.read));
  return clip::write_hand_csv(hand, convert.out);
}

int run(Convert& convert) {
  if (convert.takes) {
    if (is_log(convert.in)) return list_takes(convert.in, convert.json);
    return report(misuse("is not a device log (.plog), so it has no takes", convert.in).error());
  }
  if (auto there = expect_there(convert.in); !there) return report(there.error());
  if (convert.out.empty()) {
    return report(misuse("say what to write: --out OUT.bvh", convert.in).error());
  }
  if (auto ok = check_options(convert); !ok) return report(ok.error());
  if (is_mcap(convert.out)) return convert_to_mcap(convert.in, convert.out, convert.json);
  if (!convert.hand.empty()) {
    convert.read.hand = side_named(convert.hand);
  }
  auto clip = [&] {
    const Waiting waiting("reading " + convert.in);
    return read(convert);
  }();
  if (clip) clip = part_of(*std::move(clip), convert.part, convert.in);
  if (clip && convert.mirror) clip = clip::mirrored(*clip);
  if (!clip) return report(clip.error());
  warn_of_clock(convert, *clip);
  Findings findings;
  for (const std::string& warning : clip->warnings) findings.remark(convert.in + ": " + warning);
  if (auto ok = write(convert, *clip); !ok) return report(ok.error());
  return findings.add("in", convert.in)
      .add("out", convert.out)
      .add("frames", clip->frames())
      .add("rate_hz", clip->frame_rate_hz)
      .add("joints", clip->skeleton->joints.size())
      .add("metres_per_unit", clip->metres_per_unit)
      .add("timecode", clip->timecode.empty() ? "" : view_of(clip->timecode.front()))
      .add("warnings", clip->warnings)
      .remark(fmt::format("wrote {}: {} frame{} at {:g} Hz, {} joints", convert.out, clip->frames(),
                          clip->frames() == 1 ? "" : "s", clip->frame_rate_hz,
                          clip->skeleton->joints.size()))
      .show(convert.json, -1);
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("convert", "Write a clip, a log's stream or a log in another format");
  auto convert = std::make_shared<Convert>();
  command
      ->add_option("IN", convert->in,
                   "To read: " + clip::listed(clip::Use::kRead) + "; or a log (.plog)")
      ->required();
  auto* out = command->add_option(
      "--out", convert->out,
      "To write: " + clip::listed(clip::Use::kWrite) + "; of a whole log a .mcap");
  command->add_option("--skeleton", convert->read.skeleton,
                      "Skeleton of an AMC (default: beside it, such as NN.asf of NN_MM.amc)");
  command->add_option("--rate", convert->read.rate_hz,
                      "Frames per second of an AMC, which does not say (default: 120)");
  add_figure_options(*command, convert->read);
  auto* stream = command->add_option(
      "--stream", convert->stream,
      "Which of a log's streams (default: the only one); NAME#2: its second part, "
      "NAME-raw: its motion before its stages");
  auto* take =
      command->add_option("--take", convert->take,
                          "Only this take of a log: its number, or its name if that is unique");
  command->add_flag("--takes", convert->takes, "List the takes of a log instead")
      ->excludes(out)
      ->excludes(stream)
      ->excludes(take);
  add_part_options(*command, convert->part);
  command->add_flag("--mirror", convert->mirror, "Exchange left and right");
  command->add_option("--hand", convert->hand, "The hand of a hand CSV, or which hand to take")
      ->check(CLI::IsMember({"left", "right"}));
  auto* shape = command->add_option("--hand-shape", convert->read.hand_shape,
                                    "Bones of a hand CSV that becomes a figure");
  shape->capture_default_str();
  add_overwrite_option(*command, convert->overwrite);
  command->add_flag("--json", convert->json, "Print a summary as JSON on stdout");
  command->footer(
      "A BVH keeps its names, hierarchy, channel order and unit. An AMC becomes a BVH in\n"
      "centimetres with Z, Y, X rotations on every joint. A hand CSV\n"
      "holds 45 angles a frame; any BVH with the fifteen finger joints of a hand can become "
      "one.\n"
      "A log gives the frames that were published, styled as they were, or with --stream NAME-raw\n"
      "those that came in, whether or not they were published; its BVH is in centimetres.\n"
      "A .glb is glTF: the figure as an armature with a mannequin, for Blender and game engines. "
      "An\n"
      ".fbx is read only; its first animation with keys is the clip. A .vrma moves any\n"
      "VRM avatar and needs a person's bones. Both keep the clip's times. A .mcap has pose/,\n"
      "skeleton/ and sensor/ of all streams of a log, with the protobuf schema, in UTC.\n\n"
      "Examples:\n"
      "  posed convert 07_01.amc --out walk.bvh\n"
      "  posed convert take.amc --skeleton actor.asf --rate 60 --out take.bvh\n"
      "  posed convert glove.csv --hand left --out glove.bvh\n"
      "  posed convert take1.plog --stream walker --out walker.bvh\n"
      "  posed convert take1.plog --stream walker-raw --out unstyled.bvh\n"
      "  posed convert take1.plog --takes\n"
      "  posed convert take1.plog --take 2 --stream walker --out walker-2.bvh\n"
      "  posed convert take1.plog --from 10:20:30:05 --out walker.glb\n"
      "  posed convert walk.bvh --from 1.5 --to 4 --out step.bvh\n"
      "  posed convert walk.bvh --mirror --out other-side.bvh\n"
      "  posed convert mixamo.fbx --out walk.bvh\n"
      "  posed convert walk.bvh --out walk.vrma\n"
      "  posed convert take1.plog --out take1.mcap");
  command->callback([convert, shape, &exit_code] {
    convert->shape_given = shape->count() > 0;
    exit_code = run(*convert);
  });
}

}  // namespace posed::tools
