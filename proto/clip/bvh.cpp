#include "proto/clip/bvh.hpp"

#include "proto/clip/reader.hpp"
#include "proto/clip/text.hpp"
#include "proto/clip/units.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

double unit_of(const Skeleton& skeleton, const ReadOptions& options, const Profile* profile,
               std::vector<std::string>& warnings) {
  if (options.metres_per_unit) return *options.metres_per_unit;
  if (profile != nullptr && profile->metres_per_unit) {
    if (!profile->person || is_a_person(skeleton, *profile->metres_per_unit)) {
      return *profile->metres_per_unit;
    }
    warnings.push_back("has the joints of profile '" + profile->name +
                       "' but not its unit of length");
  }
  return guess_unit(skeleton, warnings);
}

}  // namespace

Result<Draft> draft_bvh(std::string_view text, const std::string& name,
                        const ReadOptions& options) {
  text = without_bom(text);
  auto header = parse_bvh_header(text, name);
  if (!header) return std::unexpected(header.error());
  const auto profile = find_profile(header->skeleton, options.profile);
  if (!profile) return std::unexpected(profile.error());
  Draft draft;
  draft.profile = *profile;
  draft.metres_per_unit = unit_of(header->skeleton, options, *profile, draft.warnings);
  draft.skeleton = std::move(header->skeleton);
  scale_lengths(draft.skeleton, draft.metres_per_unit);
  draft.skeleton.name = std::filesystem::path(name).stem().string();
  draft.parser = FrameParser::bvh(draft.skeleton, draft.metres_per_unit);
  draft.frame_rate_hz = header->frame_rate_hz;
  draft.header = text.substr(0, header->motion_offset);
  std::string_view motion = text.substr(header->motion_offset);
  for (int line = header->motion_line; !motion.empty(); ++line) {
    const std::string_view frame = trim(next_line(motion));
    if (!frame.empty()) draft.frames.push_back({.text = frame, .line = line});
  }
  const auto declared = parse_number(header->declared_frames);
  if (!declared || *declared != static_cast<double>(draft.frames.size())) {
    draft.warnings.push_back("'Frames:' says " + in_quotes(header->declared_frames) +
                             ", but there are " + std::to_string(draft.frames.size()) +
                             "; read all of them");
  }
  return draft;
}

Result<Clip> parse_bvh(std::string_view text, const std::string& name, const ReadOptions& options) {
  auto draft = draft_bvh(text, name, options);
  if (!draft) return std::unexpected(draft.error());
  return clip_of(std::move(*draft), name);
}

}  // namespace posed::clip
