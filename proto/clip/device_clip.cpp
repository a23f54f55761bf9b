#include "proto/clip/device_clip.hpp"

#include <algorithm>
#include <cassert>
#include <map>
#include <optional>
#include <utility>

#include "proto/clip/draft.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/clip/skeleton_json.hpp"
#include "proto/clip/text.hpp"
#include "proto/frame/axes_text.hpp"
#include "proto/frame/profile.hpp"
#include "proto/rig/up.hpp"

namespace posed::clip {
namespace {

// The first line of a description, "posed-clip bvh key=value ...", holds what the rest does not
// state. Its names are part of the log format. The second word is the extension of a format that
// sends text, or this one.
constexpr std::string_view kMagic = "posed-clip";
constexpr std::string_view kNumbers = "numbers";

std::string text_key(const Format& format) {
  return std::string(format.extensions.front().substr(1));
}

const Format* text_format(std::string_view key) {
  const auto found = std::ranges::find_if(formats(), [key](const Format& format) {
    return format.sends_text && text_key(format) == key;
  });
  return found == formats().end() ? nullptr : &*found;
}

std::string first_line(std::string_view kind, const Clip& clip) {
  return std::string(kMagic) + ' ' + std::string(kind) +
         " rate_hz=" + number_text(clip.frame_rate_hz);
}

std::string describe_text(const LoadedClip& loaded, const TextFrames& text, const Clip& clip,
                          const ReadOptions& options) {
  const Skeleton& skeleton = *clip.skeleton;
  std::string out = first_line(text_key(*loaded.format), clip);
  out += " metres_per_unit=" + number_text(clip.metres_per_unit);
  out += " root_joint=" + std::to_string(skeleton.root_joint);
  out += " asf_bytes=" + std::to_string(loaded.file.skeleton.size());
  if (loaded.format->is_hand) {
    out += options.hand == Side::kLeft ? " hand=left" : " hand=right";
    out += " shape=" + options.hand_shape;
  }
  // What the whole clip shows. Logs of posed 0.1 have no skeleton here, but some have T=.
  const std::string known = loaded.format->is_hand ? std::string() : skeleton_json(skeleton);
  if (!known.empty()) {
    out += " up=" + std::string(up_text(clip.up));
    out += " skeleton_bytes=" + std::to_string(known.size());
  }
  out += '\n' + known + loaded.file.skeleton;
  out.append(text.header).append(text.frames.front().text);
  return out;
}

std::string describe_numbers(const Clip& clip) {
  return first_line(kNumbers, clip) + " timed=" + (clip.time_s.empty() ? "0" : "1") +
         (clip.timecode.empty() ? "" : " timecoded=1") + '\n' + skeleton_json(*clip.skeleton);
}

using Facts = std::map<std::string, std::string, std::less<>>;

Facts facts_of(std::string_view line) {
  Facts facts;
  for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
    const std::size_t equals = std::min(word.find('='), word.size() - 1);
    facts.emplace(word.substr(0, equals), word.substr(equals + 1));
  }
  return facts;
}

// The value of `key` as a number; empty when missing or invalid.
std::optional<double> fact(const Facts& facts, std::string_view key) {
  const auto at = facts.find(key);
  return at == facts.end() ? std::nullopt : parse_number(at->second);
}

std::string word_of(const Facts& facts, std::string_view key, std::string_view otherwise) {
  const auto at = facts.find(key);
  return at == facts.end() ? std::string(otherwise) : at->second;
}

std::unexpected<Error> damaged(const std::string& name) {
  return fail("the description of the clip is damaged", name, 1);
}

Result<FrameCoding> parse_text(const Format& format, const Facts& facts, double rate_hz,
                               std::string_view body, const std::string& name) {
  const auto metres = fact(facts, "metres_per_unit");
  const auto root = fact(facts, "root_joint");
  const auto asf_bytes = fact(facts, "asf_bytes");
  const double known_bytes = fact(facts, "skeleton_bytes").value_or(0.0);
  if (!(known_bytes >= 0.0) || known_bytes > static_cast<double>(body.size())) return damaged(name);
  const std::string_view known = body.substr(0, static_cast<std::size_t>(known_bytes));
  body.remove_prefix(known.size());
  if (!metres || !root || !asf_bytes || !(*asf_bytes >= 0.0) ||
      *asf_bytes > static_cast<double>(body.size()) || !(*root >= 0.0 && *root < kMaxJoints)) {
    return damaged(name);
  }
  const auto skeleton_bytes = static_cast<std::size_t>(*asf_bytes);
  const ClipFile file{.name = name,
                      .bytes = std::string(body.substr(skeleton_bytes)),
                      .skeleton_name = name,
                      .skeleton = std::string(body.substr(0, skeleton_bytes))};
  ReadOptions options;
  options.rate_hz = rate_hz;
  options.metres_per_unit = metres;
  // A log names no file: only a built-in profile.
  options.profile = word_of(facts, "profile", "");
  if (options.profile.ends_with(kProfileEnding)) return damaged(name);
  options.up = up_from_text(word_of(facts, "up", "+y"));
  options.hand_shape = word_of(facts, "shape", kDefaultHandShape);
  options.hand = word_of(facts, "hand", "right") == "left" ? Side::kLeft : Side::kRight;
  auto draft = TRY(format.read(file, options));
  assert(draft.text);
  FrameCoding coding{.skeleton = nullptr, .frame_rate_hz = rate_hz, .parser = draft.text->parser};
  Hints hints{.root_joint = static_cast<int>(*root), .T = {}};
  const std::string axes = word_of(facts, "T", "");
  for (std::size_t i = 0; i + 6 <= axes.size(); i += 6) {
    hints.T.push_back(axes_from_text(std::string_view(axes).substr(i, 6)));
  }
  if (!known.empty()) {
    auto skeleton = TRY(skeleton_from_json(known, name));
    const bool same =
        std::ranges::equal(skeleton.joints, draft.skeleton.joints, {}, &Joint::name, &Joint::name);
    if (!same || skeleton.channels.size() != draft.skeleton.channels.size()) return damaged(name);
    draft.skeleton = std::move(skeleton);
    draft.skeleton_is_known = true;
  }
  auto clip = TRY(clip_of(std::move(draft), name, hints));
  coding.skeleton = clip.skeleton;
  return coding;
}

Result<FrameCoding> parse_numbers(const Facts& facts, double rate_hz, std::string_view body,
                                  const std::string& name) {
  auto skeleton = TRY(skeleton_from_json(body, name));
  auto parser =
      FrameParser::numbers(skeleton, fact(facts, "timed") == 1.0, fact(facts, "timecoded") == 1.0);
  if (parser.frame_bytes() == 0) return damaged(name);
  return FrameCoding{.skeleton = std::make_shared<const Skeleton>(std::move(skeleton)),
                     .frame_rate_hz = rate_hz,
                     .parser = std::move(parser)};
}

void add_text(const LoadedClip& loaded, const TextFrames& text, const Clip& clip,
              const ReadOptions& options, DeviceClip& out) {
  out.coding.parser = text.parser;
  out.description = describe_text(loaded, text, clip, options);
  for (const FrameSpan& frame : text.frames) {
    out.frames.emplace_back(frame.text);
    if (!out.frames.back().ends_with('\n')) out.frames.back() += '\n';
  }
}

void add_numbers(const Clip& clip, DeviceClip& out) {
  out.coding.parser =
      FrameParser::numbers(*clip.skeleton, !clip.time_s.empty(), !clip.timecode.empty());
  out.description = describe_numbers(clip);
  for (int i = 0; i < clip.frames(); ++i) {
    const auto row = clip.channels.row(i);
    const auto time_s = clip.time_s.empty() ? std::nullopt : std::optional(clip.time_s[i]);
    const auto timecode = clip.timecode.empty() ? std::nullopt : std::optional(clip.timecode[i]);
    out.frames.push_back(
        frame_bytes(time_s, timecode, {row.data(), static_cast<std::size_t>(row.size())}));
  }
}

}  // namespace

Result<DeviceClip> open_device_clip(const std::filesystem::path& path, const ReadOptions& options) {
  const auto loaded = TRY(load_clip(path, options));
  auto draft = TRY(loaded.format->read(loaded.file, options));
  assert(draft.text.has_value() == loaded.format->sends_text);
  auto text = std::exchange(draft.text, std::nullopt);
  const bool settled = draft.rig != nullptr;
  auto clip = TRY(clip_of(std::move(draft), loaded.file.name));
  // The lines of a file that was put into other axes or another unit do not say so.
  if (!settled && clip.rig &&
      (clip.rig->up != UpAxis::kPlusY || clip.rig->metres_per_unit.value_or(1.0) != 1.0)) {
    text.reset();
  }
  DeviceClip out;
  out.coding.skeleton = clip.skeleton;
  out.coding.frame_rate_hz = clip.frame_rate_hz;
  if (text) {
    add_text(loaded, *text, clip, options, out);
  } else {
    add_numbers(clip, out);
  }
  out.begins_with_added_pose = begins_with_added_pose(clip);
  out.time_s = std::move(clip.time_s);
  out.warnings = std::move(clip.warnings);
  return out;
}

Result<FrameCoding> parse_description(std::string_view description, const std::string& name) {
  std::string_view body = description;
  std::string_view line = next_line(body);
  const std::string_view magic = next_word(line);
  const std::string_view kind = next_word(line);
  const Format* format = text_format(kind);
  if (magic != kMagic || (format == nullptr && kind != kNumbers)) {
    return fail("is no description of a clip", name);
  }
  const Facts facts = facts_of(line);
  const auto rate_hz = fact(facts, "rate_hz");
  if (!rate_hz || !(*rate_hz > 0.0)) return damaged(name);
  return format != nullptr ? parse_text(*format, facts, *rate_hz, body, name)
                           : parse_numbers(facts, *rate_hz, body, name);
}

}  // namespace posed::clip
