#include "proto/clip/bvh.hpp"

#include "proto/clip/draft.hpp"
#include "proto/clip/formats.hpp"
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

Result<Draft> read_bvh(const ClipFile& file, const ReadOptions& options) {
  const std::string_view text = without_bom(file.bytes);
  auto header = parse_bvh_header(text, file.name);
  if (!header) return std::unexpected(header.error());
  const auto profile = find_profile(header->skeleton, options.profile);
  if (!profile) return std::unexpected(profile.error());
  Draft draft;
  draft.profile = *profile;
  draft.metres_per_unit = unit_of(header->skeleton, options, *profile, draft.warnings);
  draft.skeleton = std::move(header->skeleton);
  scale_lengths(draft.skeleton, draft.metres_per_unit);
  draft.skeleton.name = std::filesystem::path(file.name).stem().string();
  draft.frame_rate_hz = header->frame_rate_hz;
  TextFrames& frames = draft.text.emplace();
  frames.parser = FrameParser::bvh(draft.skeleton, draft.metres_per_unit);
  frames.header = text.substr(0, header->motion_offset);
  std::string_view motion = text.substr(header->motion_offset);
  for (int line = header->motion_line; !motion.empty(); ++line) {
    const std::string_view frame = trim(next_line(motion));
    if (!frame.empty()) frames.frames.push_back({.text = frame, .line = line});
  }
  const auto declared = parse_number(header->declared_frames);
  const std::size_t found = frames.frames.size();
  if (!declared || *declared != static_cast<double>(found)) {
    draft.warnings.push_back("'Frames:' says " + in_quotes(header->declared_frames) +
                             ", but there are " + std::to_string(found) + "; read all of them");
  }
  if (auto ok = read_frames(frames, file.name, draft.values, draft.time_s); !ok) {
    return std::unexpected(ok.error());
  }
  return draft;
}

}  // namespace

Format bvh_format() {
  return {.name = "BVH",
          .extensions = {".bvh"},
          .evenly_spaced = true,
          .sends_text = true,
          .options = {ReadOption::kUnit, ReadOption::kProfile},
          .sniff = [](std::string_view begin) { return has_line(begin, "HIERARCHY"); },
          .read = read_bvh,
          .write = write_bvh};
}

}  // namespace posed::clip
