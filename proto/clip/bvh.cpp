#include "proto/clip/bvh.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "proto/clip/draft.hpp"
#include "proto/clip/figure.hpp"
#include "proto/clip/formats.hpp"
#include "proto/clip/joint_names.hpp"
#include "proto/clip/text.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/lower.hpp"

namespace posed::clip {
namespace {

constexpr double kCmuUnit_m = 0.0254 / 0.45;  // an Acclaim file's `length 0.45`: inch / 0.45
constexpr double kHeight_m = 1.7;

struct Unit {
  double metres;
  const char* name;
};
constexpr std::array<Unit, 4> kUnits{{{1.0, "metres"},
                                      {0.01, "centimetres"},
                                      {kCmuUnit_m, "inches / 0.45"},
                                      {0.001, "millimetres"}}};

// Joints that only move the figure through the world: the root, and an only child below it that has
// position channels. Their OFFSET is a location, not a bone length.
std::vector<char> carriers(const Skeleton& skeleton) {
  std::vector<char> carries(skeleton.joints.size(), 0);
  std::vector<int> children(skeleton.joints.size(), 0);
  for (const Joint& joint : skeleton.joints) {
    if (joint.parent >= 0) ++children[joint.parent];
  }
  carries[0] = 1;
  for (const Channel& channel : skeleton.channels) {
    const int parent = skeleton.joints[channel.joint].parent;
    if (channel.translation && parent >= 0 && carries[parent] != 0 && children[parent] == 1) {
      carries[channel.joint] = 1;
    }
  }
  return carries;
}

// The longest path through the figure from leaf to leaf: foot to head or hand to hand. Both are
// about a person's height, however the zero pose is folded.
double longest_way(const Skeleton& skeleton) {
  const std::vector<char> carries = carriers(skeleton);
  std::vector<double> reach(skeleton.joints.size(), 0.0);  // from the joint to its farthest leaf
  double longest = 0.0;
  for (int j = static_cast<int>(skeleton.joints.size()) - 1; j >= 0; --j) {
    const Joint& joint = skeleton.joints[j];
    const double tip = joint.end_site_m ? joint.end_site_m->norm() : 0.0;
    reach[j] = std::max(reach[j], tip);
    if (carries[j] != 0) continue;
    const double way = reach[j] + joint.offset_m.norm();
    longest = std::max(longest, reach[joint.parent] + way);
    reach[joint.parent] = std::max(reach[joint.parent], way);
  }
  return longest;
}

// Metres per unit that bring the figure's standing height nearest to 1.7 m; the choices are metre,
// centimetre, and inch / 0.45. Adds a warning that the unit is a guess. Offsets of `skeleton` are
// in file units. The height is the sum of bone lengths from the lowest to the highest leaf, so it
// does not depend on the pose in which the OFFSETs were written.
double guess_unit(const Skeleton& skeleton, std::vector<std::string>& warnings) {
  const double height = longest_way(skeleton);
  if (!(height > 0.0)) return kUnits[1].metres;
  const Unit* best = kUnits.data();
  const auto misfit = [height](const Unit& unit) {
    return std::abs(std::log(height * unit.metres / kHeight_m));
  };
  for (const Unit& unit : kUnits) {
    if (misfit(unit) < misfit(*best)) best = &unit;
  }
  warnings.push_back(std::string("names no unit of length; taken as ") + best->name +
                     " by the figure's height");
  return best->metres;
}

// True when the figure is between 0.8 and 2.6 m high in this unit.
bool is_a_person(const Skeleton& skeleton, double metres_per_unit) {
  const double height_m = longest_way(skeleton) * metres_per_unit;
  return height_m > 0.8 && height_m < 2.6;
}

// Multiplies offsets and end sites by `metres_per_unit`.
void scale_lengths(Skeleton& skeleton, double metres_per_unit) {
  for (Joint& joint : skeleton.joints) {
    joint.offset_m *= metres_per_unit;
    if (joint.end_site_m) *joint.end_site_m *= metres_per_unit;
  }
}

// A profile's unit, unless the figure would be no person in it.
std::optional<double> unit_of(const Profile& profile, const Skeleton& skeleton,
                              std::vector<std::string>& warnings) {
  if (!profile.metres_per_unit) return std::nullopt;
  if (!profile.person || is_a_person(skeleton, *profile.metres_per_unit)) {
    return profile.metres_per_unit;
  }
  warnings.push_back("has the joints of profile '" + profile.name + "' but not its unit of length");
  return std::nullopt;
}

// Frames for the recogniser, in rad and file units. Those that cannot be parsed are left out: the
// reader of all frames will refuse them with their line.
ChannelMatrix sample_of(const Skeleton& skeleton, std::span<const FrameSpan> frames) {
  constexpr double kTinyUnit_m = 1e-6;  // so that no position is beyond a pose's
  const auto parser = FrameParser::bvh(skeleton, kTinyUnit_m);
  const auto picked =
      sample_frames(static_cast<int>(frames.size()), static_cast<int>(skeleton.joints.size()));
  ChannelMatrix sample(std::ssize(picked), std::ssize(skeleton.channels));
  int count = 0;
  for (const int i : picked) {
    auto row = sample.row(count);
    const std::span<double> values(row.data(), static_cast<std::size_t>(row.size()));
    if (!parser.parse(frames[i].text, values).ok()) continue;
    for (std::size_t c = 0; c < values.size(); ++c) {
      if (skeleton.channels[c].translation) values[c] /= kTinyUnit_m;
    }
    ++count;
  }
  sample.conservativeResize(count, Eigen::NoChange);
  return sample;
}

// One line that says what was taken for granted.
std::string taken_as(const rig::Rig& rig) {
  std::string text = "names neither its unit nor its axes; taken as " + rig.unit + " (" +
                     rig.why_unit + ") and " + std::string(up_text(rig.up));
  if (!rig.why_up.empty()) text += " (" + rig.why_up + ")";
  return rig.facing.empty() ? text : text + ", facing " + rig.facing + " (" + rig.why_facing + ")";
}

// Finds bones, T frames, unit and upward axis, and brings the skeleton into metres and +Y up.
// Returns the factors of the file's channels (FrameParser::bvh).
Result<std::vector<double>> recognise_draft(const ReadOptions& options,
                                            std::span<const FrameSpan> frames, Draft& draft) {
  const auto mark = find_bvh_mark(draft.text->header);
  Skeleton& skeleton = draft.skeleton;
  rig::RigInput known;
  known.up = options.up;
  known.facing = options.facing;
  known.metres_per_unit = options.metres_per_unit;
  if (mark) {
    if (!known.up) known.up = mark->up;
    if (!known.metres_per_unit) known.metres_per_unit = mark->metres_per_unit;
    if (mark->rests_in_t && draft.profile == nullptr && known.up == mark->up) {
      known.T.assign(skeleton.joints.size(), Eigen::Quaterniond::Identity());
    }
  }
  if (draft.profile != nullptr) {
    TRY(add_profile(*draft.profile, skeleton, known));
    if (!known.metres_per_unit) {
      known.metres_per_unit = unit_of(*draft.profile, skeleton, draft.warnings);
    }
  }
  const bool unit_is_known = known.metres_per_unit.has_value();
  const bool up_is_known = known.up.has_value();
  rig::Rig rig = recognise(skeleton, sample_of(skeleton, frames), std::move(known));
  if (!rig.metres_per_unit) {
    draft.metres_per_unit = guess_unit(skeleton, draft.warnings);
  } else {
    draft.metres_per_unit = *rig.metres_per_unit;
    if (!unit_is_known) draft.warnings.push_back(taken_as(rig));
  }
  if (unit_is_known && rig.up != UpAxis::kPlusY && !up_is_known) {
    draft.warnings.push_back("does not name its upward axis; taken as " +
                             std::string(up_text(rig.up)) + ": " + rig.why_up);
  }
  draft.warnings.insert(draft.warnings.end(), rig.notes.begin(), rig.notes.end());
  draft.up = rig.up;
  apply(rig, skeleton);
  scale_lengths(skeleton, draft.metres_per_unit);
  const std::size_t joints = skeleton.joints.size();
  const std::vector<char> stays = leave_out_joints(skeleton, rig);
  draft.rig = std::make_shared<const rig::Rig>(rig);
  std::vector<double> factors = turn_axes(up_turn(rig.up), skeleton);
  if (stays.empty()) return factors;
  draft.warnings.push_back(left_out(joints, skeleton.joints.size()));
  std::vector<double> of_file;
  auto next = factors.begin();
  for (const char stay : stays) of_file.push_back(stay != 0 ? *next++ : 0.0);
  return of_file;
}

Result<Draft> read_bvh(const ClipFile& file, const ReadOptions& options) {
  const std::string_view text = without_bom(file.bytes);
  auto header = TRY(parse_bvh_header(text, file.name));
  Draft draft;
  draft.skeleton = std::move(header.skeleton);
  draft.skeleton.name = std::filesystem::path(file.name).stem().string();
  draft.frame_rate_hz = header.frame_rate_hz;
  TextFrames& frames = draft.text.emplace();
  frames.header = text.substr(0, header.motion_offset);
  std::string_view motion = text.substr(header.motion_offset);
  for (int line = header.motion_line; !motion.empty(); ++line) {
    const std::string_view frame = trim(next_line(motion));
    if (!frame.empty()) frames.frames.push_back({.text = frame, .line = line});
  }
  draft.profile = TRY(find_profile(draft.skeleton, options.profile));
  const auto factors = recognise_draft(options, frames.frames, draft);
  if (!factors) return fail(factors.error().message, file.name);
  frames.parser = FrameParser::bvh(draft.skeleton, draft.metres_per_unit, *factors);
  const auto declared = parse_number(header.declared_frames);
  const std::size_t found = frames.frames.size();
  if (!header.renamed.empty()) draft.warnings.push_back(header.renamed);
  if (!declared || *declared != static_cast<double>(found)) {
    draft.warnings.push_back("'Frames:' says " + in_quotes(header.declared_frames) +
                             ", but there are " + std::to_string(found) + "; read all of them");
  }
  TRY(read_frames(frames, file.name, draft.values, draft.time_s));
  return draft;
}

constexpr std::size_t kMaxFileJoints = 1000;  // of which posed carries kMaxJoints
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
  JointNames names_;
  BvhHeader header_;
  std::vector<Open> open_;
};

Result<BvhHeader> HeaderReader::read() {
  if (lower(cursor_.word()) != "hierarchy") {
    return error("does not begin with HIERARCHY, so it is not a BVH");
  }
  if (lower(cursor_.word()) != "root") return error("ROOT should follow HIERARCHY");
  TRY(begin_joint());
  while (!open_.empty()) {
    TRY(entry());
  }
  const std::string word = lower(cursor_.word());
  if (word == "root") return error("has a second ROOT; posed reads one figure a file");
  if (word == "}") return error("has a closing brace too many");
  if (word != "motion")
    return error("has no MOTION after its hierarchy, so there is nothing to play");
  if (header_.skeleton.channels.empty()) return error("lists no CHANNELS, so nothing can move");
  TRY(motion());
  header_.renamed = names_.warning();
  return std::move(header_);
}

Result<> HeaderReader::begin_joint() {
  std::string name(cursor_.name());
  if (name.empty()) return error("a joint has no name");
  constexpr std::size_t kMaxName = 200;  // bytes
  if (name.size() > kMaxName) {
    return error("a joint's name is longer than " + std::to_string(kMaxName) + " characters");
  }
  if (open_.size() >= kMaxDepth) return error("joints are nested deeper than 96");
  if (joints().size() >= kMaxFileJoints) {
    return error("has more than " + std::to_string(kMaxFileJoints) + " joints");
  }
  const int parent = open_.empty() ? -1 : open_.back().joint;
  Joint joint;
  joint.name = names_.add(std::move(name), parent < 0 ? "" : joints()[parent].name);
  joint.parent = parent;
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
  TRY(offset(tip));
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

Format bvh_format() {
  return {
      .name = "BVH",
      .extensions = {".bvh"},
      .evenly_spaced = true,
      .sends_text = true,
      .options = {ReadOption::kUnit, ReadOption::kUp, ReadOption::kFacing, ReadOption::kProfile},
      .sniff = [](std::string_view begin) { return has_line(begin, "HIERARCHY"); },
      .read = read_bvh,
      .write = write_bvh};
}

Result<BvhHeader> parse_bvh_header(std::string_view text, const std::string& name) {
  return HeaderReader(text, name).read();
}

}  // namespace posed::clip
