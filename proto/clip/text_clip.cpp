#include "proto/clip/text_clip.hpp"

#include <algorithm>
#include <array>
#include <map>

#include "proto/clip/files.hpp"
#include "proto/clip/text.hpp"

namespace posed::clip {
namespace {

// The first line of a description, "posed-clip bvh key=value ...", holds what the header's text
// does not state. Its names are part of the log format.
constexpr std::string_view kMagic = "posed-clip";

constexpr std::array<std::string_view, 3> kKinds{"bvh", "amc", "csv"};  // by ClipKind

std::string describe(const ClipFiles& files, const Draft& draft, const Clip& clip,
                     const ReadOptions& options) {
  const Skeleton& skeleton = *clip.skeleton;
  std::string out(kMagic);
  out += ' ';
  out += kKinds[static_cast<std::size_t>(files.kind)];
  out += " rate_hz=" + number_text(clip.frame_rate_hz);
  out += " metres_per_unit=" + number_text(clip.metres_per_unit);
  out += " root_joint=" + std::to_string(skeleton.root_joint);
  out += " asf_bytes=" + std::to_string(files.asf.size());
  if (files.kind == ClipKind::kHandCsv) {
    out += options.hand == Side::kLeft ? " hand=left" : " hand=right";
    out += " shape=" + options.hand_shape;
  } else if (!options.profile.empty()) {
    out += " profile=" + options.profile;
  }
  // Only the whole clip shows this; the other facts follow from the header.
  if (files.kind != ClipKind::kHandCsv && draft.profile == nullptr && !zero_pose_is_t(skeleton)) {
    out += " T=";
    for (const Joint& joint : skeleton.joints) out += axes_text(joint.T_world_joint);
  }
  out += '\n' + files.asf;
  out.append(draft.header).append(draft.frames.front().text);
  return out;
}

using Facts = std::map<std::string, std::string, std::less<>>;

// The value of `key` as a number, which must be whole for some keys; empty when missing or invalid.
std::optional<double> fact(const Facts& facts, std::string_view key) {
  const auto at = facts.find(key);
  return at == facts.end() ? std::nullopt : parse_number(at->second);
}

}  // namespace

Result<std::unique_ptr<const TextClip>> open_text_clip(const std::filesystem::path& path,
                                                       const ReadOptions& options) {
  auto files = load_files(path, options);
  if (!files) return std::unexpected(files.error());
  const auto draft = draft_of(*files, options);
  if (!draft) return std::unexpected(draft.error());
  auto clip = clip_of(*draft, files->name);
  if (!clip) return std::unexpected(clip.error());

  auto out = std::make_unique<TextClip>();
  out->format = {
      .skeleton = clip->skeleton, .frame_rate_hz = clip->frame_rate_hz, .parser = draft->parser};
  out->description = describe(*files, *draft, *clip, options);
  out->warnings = std::move(clip->warnings);
  out->time_s = std::move(clip->time_s);
  // The text has moved, so the views are rebased: same offsets, new address.
  const char* const before = files->text.data();
  out->text = std::move(files->text);
  for (const FrameSpan& frame : draft->frames) {
    out->frames.push_back({out->text.data() + (frame.text.data() - before), frame.text.size()});
  }
  return out;
}

Result<ClipFormat> parse_description(std::string_view description, const std::string& name) {
  std::string_view body = description;
  std::string_view line = next_line(body);
  const std::string_view magic = next_word(line);
  const std::string_view kind = next_word(line);
  const auto known = std::ranges::find(kKinds, kind);
  if (magic != kMagic || known == kKinds.end()) {
    return fail("is no description of a clip", name);
  }
  Facts facts;
  for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
    const std::size_t equals = std::min(word.find('='), word.size() - 1);
    facts.emplace(word.substr(0, equals), word.substr(equals + 1));
  }
  const auto rate_hz = fact(facts, "rate_hz");
  const auto metres = fact(facts, "metres_per_unit");
  const auto root = fact(facts, "root_joint");
  const auto asf_bytes = fact(facts, "asf_bytes");
  if (!rate_hz || !metres || !root || !asf_bytes || !(*asf_bytes >= 0.0) ||
      *asf_bytes > static_cast<double>(body.size()) || !(*root >= 0.0 && *root < kMaxJoints)) {
    return fail("the description of the clip is damaged", name, 1);
  }
  ClipFiles files;
  files.name = name;
  files.asf_name = name;
  files.kind = static_cast<ClipKind>(known - kKinds.begin());
  files.asf = body.substr(0, static_cast<std::size_t>(*asf_bytes));
  files.text = body.substr(files.asf.size());
  ReadOptions options;
  options.amc_rate_hz = *rate_hz;
  options.metres_per_unit = metres;
  if (const auto at = facts.find("profile"); at != facts.end()) options.profile = at->second;
  if (const auto at = facts.find("shape"); at != facts.end()) options.hand_shape = at->second;
  if (const auto at = facts.find("hand"); at != facts.end()) {
    options.hand = at->second == "left" ? Side::kLeft : Side::kRight;
  }
  auto draft = draft_of(files, options);
  if (!draft) return std::unexpected(draft.error());
  ClipFormat format;
  format.parser = draft->parser;
  format.frame_rate_hz = *rate_hz;
  Hints hints{.root_joint = static_cast<int>(*root), .T = {}};
  if (const auto at = facts.find("T"); at != facts.end()) {
    for (std::size_t i = 0; i + 6 <= at->second.size(); i += 6) {
      hints.T.push_back(axes_from_text(std::string_view(at->second).substr(i, 6)));
    }
  }
  auto clip = clip_of(std::move(*draft), name, hints);
  if (!clip) return std::unexpected(clip.error());
  format.skeleton = clip->skeleton;
  return format;
}

}  // namespace posed::clip
