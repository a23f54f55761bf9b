// Any bytes as a clip of every format of the table that posed reads: accepted or refused, never a
// crash or a hang, and no pose that is not finite but where the format holds gaps. What stands
// before a line "%%" is the file of the skeleton, for formats that have one.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "proto/clip/draft.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/frame_parser.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/clip/skeleton_json.hpp"
#include "tests/fuzz/demand.hpp"

namespace {

using namespace posed;  // NOLINT(google-build-using-namespace)
using fuzz::demand;

void check_times(const clip::Clip& clip) {
  demand(clip.frame_rate_hz > 0.0 && std::isfinite(clip.frame_rate_hz));
  demand(clip.time_s.empty() || std::ssize(clip.time_s) == clip.frames());
  for (std::size_t i = 0; i < clip.time_s.size(); ++i) {
    demand(std::isfinite(clip.time_s[i]) && (i == 0 || clip.time_s[i] > clip.time_s[i - 1]));
  }
}

void check_skeleton(const Skeleton& skeleton) {
  for (const Joint& joint : skeleton.joints) {
    demand(joint.offset_m.allFinite());
    demand(std::abs(joint.T_world_joint.norm() - 1.0) < 1e-6);
  }
}

void check_pose(const clip::Clip& clip) {
  demand(clip.channels.allFinite());
  const Frame frame = clip.frame(clip.frames() - 1);
  demand(frame.joint_count == clip.skeleton->joints.size());
  for (int j = 0; j < frame.joint_count; ++j) {
    float norm = 0.0F;
    for (const float value : frame.rotation_xyzw[static_cast<std::size_t>(j)])
      norm += value * value;
    demand(std::abs(norm - 1.0F) < 1e-4F);
  }
  for (const float value : frame.root_position_m) demand(std::isfinite(value));
  (void)clip::with_zyx_channels(clip);
}

void check_hand(const clip::Clip& clip) {
  demand((clip.channels.array() != std::numeric_limits<double>::infinity()).all());
  auto hand = clip::hand_of(clip);
  demand(hand.has_value());
  clip::fill_gaps(*hand);
  const auto whole = clip::clip_of_hand(*hand, "adult");
  demand(whole.has_value() && whole->channels.allFinite());
}

// What a live stream of the clip sends is read back as the same numbers on the same skeleton.
void check_numbers(const clip::Clip& clip) {
  const auto skeleton = clip::skeleton_from_json(clip::skeleton_json(*clip.skeleton), "fuzz");
  if (!skeleton) return;  // names that are not UTF-8 may become two of the same name
  const auto parser = clip::FrameParser::numbers(*skeleton, false, false);
  const auto row = clip.channels.row(0);
  const std::span<const double> sent(row.data(), static_cast<std::size_t>(row.size()));
  std::vector<double> received(sent.size());
  const std::string bytes = clip::frame_bytes(std::nullopt, std::nullopt, sent);
  demand(parser.parse(bytes, received).ok());
  demand(std::ranges::equal(sent, received,
                            [](double a, double b) { return a == b || (a != a && b != b); }));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t mark = text.find("%%");
  const bool has_skeleton = mark != std::string_view::npos;
  for (const clip::Format& format : clip::formats()) {
    if (format.read == nullptr) continue;
    if (format.sniff != nullptr) (void)format.sniff(text.substr(0, 4096));
    const bool apart = has_skeleton && !format.skeleton_extension.empty();
    const auto clip = clip::parse_clip(
        {.name = "fuzz" + std::string(format.extensions.front()),
         .bytes = std::string(apart ? text.substr(mark + 2) : text),
         .skeleton_name = "fuzz" + std::string(format.skeleton_extension),
         .skeleton = std::string(apart ? text.substr(0, mark) : std::string_view())});
    if (!clip) continue;
    demand(clip->frames() > 0);
    demand(static_cast<std::size_t>(clip->channels.cols()) == clip->skeleton->channels.size());
    check_times(*clip);
    check_skeleton(*clip->skeleton);
    check_numbers(*clip);
    if (format.is_hand) check_hand(*clip);
    if (!format.holds_gaps) check_pose(*clip);
  }
  return 0;
}
