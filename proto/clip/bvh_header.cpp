#include <array>
#include <cmath>

#include "proto/clip/bvh.hpp"
#include "proto/clip/text.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

constexpr int kMaxDepth = 96;
constexpr double kMaxFrameTime_s = 10.0;
constexpr double kMaxRate_hz = 100'000.0;

struct ChannelName {
  std::string_view name;
  Axis axis;
  bool translation;
};
constexpr std::array<ChannelName, 6> kChannelNames{{{"xposition", Axis::kX, true},
                                                    {"yposition", Axis::kY, true},
                                                    {"zposition", Axis::kZ, true},
                                                    {"xrotation", Axis::kX, false},
                                                    {"yrotation", Axis::kY, false},
                                                    {"zrotation", Axis::kZ, false}}};

// Turns "Frame \t Time " into "frametime".
std::string lower_packed(std::string_view text) {
  std::string packed = lower(text);
  std::erase_if(packed, is_space);
  return packed;
}

class HeaderReader {
 public:
  HeaderReader(std::string_view text, const std::string& name) : cursor_(text), name_(name) {}

  Result<BvhHeader> read();

 private:
  struct Open {
    int joint = 0;
    bool has_offset = false;
    bool has_channels = false;
    bool has_child = false;  // has a child joint or an end site
  };

  [[nodiscard]] std::unexpected<Error> error(std::string message) const {
    return fail(std::move(message), name_, cursor_.line());
  }
  [[nodiscard]] std::vector<Joint>& joints() { return header_.skeleton.joints; }
  [[nodiscard]] std::string place() const {
    return "joint " + in_quotes(header_.skeleton.joints[open_.back().joint].name);
  }

  Result<> entry();  // reads one entry of the innermost open joint
  Result<> begin_joint();
  Result<> end_joint();
  Result<> end_site();
  Result<> offset(Eigen::Vector3d& value);
  Result<> channels();
  Result<> motion();

  Cursor cursor_;
  const std::string& name_;
  BvhHeader header_;
  std::vector<Open> open_;
};

Result<BvhHeader> HeaderReader::read() {
  if (lower(cursor_.word()) != "hierarchy") {
    return error("does not begin with HIERARCHY, so it is not a BVH");
  }
  if (lower(cursor_.word()) != "root") return error("ROOT should follow HIERARCHY");
  if (auto ok = begin_joint(); !ok) return std::unexpected(ok.error());
  while (!open_.empty()) {
    if (auto ok = entry(); !ok) return std::unexpected(ok.error());
  }
  const std::string word = lower(cursor_.word());
  if (word == "root") return error("has a second ROOT; posed reads one figure a file");
  if (word == "}") return error("has a closing brace too many");
  if (word != "motion")
    return error("has no MOTION after its hierarchy, so there is nothing to play");
  if (header_.skeleton.channels.empty()) return error("lists no CHANNELS, so nothing can move");
  if (auto ok = motion(); !ok) return std::unexpected(ok.error());
  return std::move(header_);
}

Result<> HeaderReader::begin_joint() {
  const std::string_view name = cursor_.name();
  if (name.empty()) return error("a joint has no name");
  if (name.size() > 200) return error("a joint's name is longer than 200 characters");
  if (open_.size() >= kMaxDepth) return error("joints are nested deeper than 96");
  if (joints().size() >= static_cast<std::size_t>(kMaxJoints)) {
    return error("has more than " + std::to_string(kMaxJoints) +
                 " joints; leave out joints that do not matter, for example finger tips");
  }
  if (header_.skeleton.joint_index(name) >= 0) {
    return error("a second joint is named " + in_quotes(name) + "; give each its own name");
  }
  Joint joint;
  joint.name = name;
  joint.parent = open_.empty() ? -1 : open_.back().joint;
  joints().push_back(std::move(joint));
  open_.push_back({.joint = static_cast<int>(joints().size()) - 1});
  if (cursor_.word() != "{") return error("'{' should follow the name of " + place());
  return {};
}

Result<> HeaderReader::entry() {
  const std::string word = lower(cursor_.word());
  Open& open = open_.back();
  if (word == "offset") {
    if (open.has_offset) return error("a second OFFSET in " + place());
    open.has_offset = true;
    return offset(joints()[open.joint].offset_m);
  }
  if (word == "channels") return channels();
  if (word == "joint") {
    if (!open.has_channels) return error(place() + " has a child before its CHANNELS");
    open.has_child = true;
    return begin_joint();
  }
  if (word == "end") {
    open.has_child = true;
    return end_site();
  }
  if (word == "}") return end_joint();
  if (word.empty() || word == "motion") {
    return error("the file ends, or its MOTION begins, inside " + place() +
                 ": a closing brace is missing");
  }
  return error(in_quotes(word) + " is not known in a BVH hierarchy (in " + place() + ")");
}

Result<> HeaderReader::end_joint() {
  const Open open = open_.back();
  if (!open.has_offset) return error(place() + " has no OFFSET");
  if (!open.has_channels)
    return error(place() + " has no CHANNELS; write CHANNELS 0 if it is fixed");
  open_.pop_back();
  return {};
}

Result<> HeaderReader::end_site() {
  if (lower(cursor_.word()) != "site") return error("'End' is not followed by 'Site'");
  (void)cursor_.name();  // some exporters give the end site a name
  if (cursor_.word() != "{") return error("'{' should follow End Site in " + place());
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();
  if (lower(cursor_.word()) != "offset") return error("End Site without OFFSET in " + place());
  if (auto ok = offset(tip); !ok) return ok;
  if (cursor_.word() != "}") return error("End Site is not closed in " + place());
  joints()[open_.back().joint].end_site_m = tip;
  return {};
}

Result<> HeaderReader::offset(Eigen::Vector3d& value) {
  for (int i = 0; i < 3; ++i) {
    const std::string_view word = cursor_.word();
    const auto number = parse_number(word);
    if (!number) return error("OFFSET of " + place() + ": " + in_quotes(word) + " is not a length");
    value[i] = *number;
  }
  return {};
}

Result<> HeaderReader::channels() {
  Open& open = open_.back();
  if (open.has_channels) return error("a second CHANNELS in " + place());
  if (open.has_child) return error("CHANNELS after a child in " + place());
  open.has_channels = true;
  const std::string_view word = cursor_.word();
  const auto count = parse_number(word);
  if (!count || *count < 0 || *count > 6 || *count != std::floor(*count)) {
    return error("CHANNELS of " + place() + " should be 0 to 6, not " + in_quotes(word));
  }
  unsigned seen = 0;
  for (int i = 0; i < static_cast<int>(*count); ++i) {
    const std::string_view name = cursor_.word();
    std::size_t which = 0;
    while (which < kChannelNames.size() && kChannelNames[which].name != lower(name)) ++which;
    if (which == kChannelNames.size()) {
      return error("unknown channel " + in_quotes(name) + " in " + place() +
                   "; a channel is X, Y or Z with position or rotation");
    }
    if ((seen & (1U << which)) != 0)
      return error("channel " + in_quotes(name) + " twice in " + place());
    seen |= 1U << which;
    Channel channel;
    channel.joint = static_cast<std::uint16_t>(open.joint);
    channel.axis = kChannelNames[which].axis;
    channel.translation = kChannelNames[which].translation;
    header_.skeleton.channels.push_back(channel);
  }
  for (const ChannelName& known : kChannelNames) {
    if (lower(cursor_.peek()) == known.name) {
      return error(place() + " lists more channels than its count " + std::string(word));
    }
  }
  return {};
}

// Reads "Frames: N" and "Frame Time: s", each on its own line; space may precede the colon.
Result<> HeaderReader::motion() {
  const auto labelled = [this](std::string_view label) -> std::optional<std::string_view> {
    (void)cursor_.peek();  // skips blank lines
    const std::string_view line = cursor_.rest();
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos || lower_packed(line.substr(0, colon)) != label) {
      return std::nullopt;
    }
    return trim(line.substr(colon + 1));
  };
  const auto frames = labelled("frames");
  if (!frames) return error("'Frames: <count>' should follow MOTION");
  header_.declared_frames = *frames;
  const auto time = labelled("frametime");
  if (!time) return error("'Frame Time: <seconds>' should follow Frames");
  const auto frame_time_s = parse_number(*time);
  if (!frame_time_s || !(*frame_time_s > 1.0 / kMaxRate_hz) || *frame_time_s > kMaxFrameTime_s) {
    return error("Frame Time " + in_quotes(*time) +
                 " is not a time between two frames; it should be more than 0 and at most 10 s");
  }
  // Files round the frame time ('.0083333'): a rate very near a whole number means that number.
  const double rate_hz = 1.0 / *frame_time_s;
  const double whole_hz = std::round(rate_hz);
  const bool is_whole = whole_hz > 0 && std::abs(rate_hz - whole_hz) < 1e-4 * whole_hz;
  header_.frame_rate_hz = is_whole ? whole_hz : rate_hz;
  header_.motion_offset = cursor_.offset();
  header_.motion_line = cursor_.line() + 1;
  return {};
}

}  // namespace

Result<BvhHeader> parse_bvh_header(std::string_view text, const std::string& name) {
  return HeaderReader(text, name).read();
}

}  // namespace posed::clip
