#include "drivers/mapping.hpp"

#include <utility>

#include "proto/text/clean.hpp"

namespace posed::drivers {
namespace {

// A live figure has +Y up, whatever its file would have, so T frames of other axes are not its own.
Result<std::shared_ptr<const Skeleton>> mapped(const Profile& profile, const Skeleton& skeleton) {
  const auto bones = TRY(named_bones(profile, skeleton));
  if (!profile.T.empty() && profile.up != UpAxis::kPlusY) {
    return fail("its T frames are those of a file in which " + std::string(up_text(profile.up)) +
                " points up; leave out [T] and up, or write it with `posed inspect STREAM`");
  }
  const auto T = known_t(profile, skeleton);
  auto figure = std::make_shared<Skeleton>(skeleton);
  for (std::size_t j = 0; j < figure->joints.size(); ++j) {
    figure->joints[j].bone = bones[j];
    if (T[j]) figure->joints[j].T_world_joint = *T[j];
  }
  TRY(figure->finish());
  return figure;
}

}  // namespace

Result<Mapping> parse_mapping(std::string text, std::string file) {
  auto profile = TRY(parse_profile(text, file));
  return Mapping{.file = std::move(file), .text = std::move(text), .profile = std::move(profile)};
}

Result<Mapping> load_mapping(const std::string& file) {
  auto text = TRY(load_profile_text(file));
  return parse_mapping(std::move(text), file);
}

std::string use_mapping(const Mapping& mapping, SourceLayout& layout) {
  std::string first;
  int others = -1;
  for (Body& body : layout.bodies) {
    if (!body.skeleton || body.skeleton->joints.size() < 2) continue;
    if (auto figure = mapped(mapping.profile, *body.skeleton)) {
      body.skeleton = std::move(*figure);
    } else if (++others == 0) {
      first = in_quotes(body.name) + " (" + figure.error().message + ")";
    }
  }
  if (others < 0) return {};
  return "the mapping " + mapping.file + " does not fit its body " + first +
         (others > 0 ? ", nor " + std::to_string(others) + " more" : "") +
         ", so that one stays as posed recognises it";
}

}  // namespace posed::drivers
