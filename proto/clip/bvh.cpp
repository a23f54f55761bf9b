#include "proto/clip/bvh.hpp"

#include <algorithm>
#include <cmath>

#include "proto/clip/frame_text.hpp"
#include "proto/clip/text.hpp"
#include "proto/clip/units.hpp"

namespace posed::clip {
namespace {

constexpr double kSameLength_m = 0.001;

struct Rows {
  std::vector<double> values;  // [frames x channels], rad and m
  int frames = 0;
};

Result<Rows> read_rows(std::string_view text, int line, const FrameParser& parser,
                       const std::string& name) {
  Rows rows;
  std::vector<double> row(parser.channels());
  for (; !text.empty(); ++line) {
    const std::string_view frame = trim(next_line(text));
    if (frame.empty()) continue;
    const FrameOutcome outcome = parser.parse(frame, row);
    if (!outcome.ok()) {
      return fail("frame " + std::to_string(rows.frames + 1) + ": " + outcome.sentence(), name,
                  line);
    }
    rows.values.insert(rows.values.end(), row.begin(), row.end());
    ++rows.frames;
  }
  if (rows.frames == 0) return fail("has no frames after 'Frame Time:'", name, line);
  return rows;
}

// The joint whose position is the figure's: the first, from the root on, that the clip moves.
int find_root_joint(const Clip& clip) {
  const Skeleton& skeleton = *clip.skeleton;
  for (std::size_t c = 0; c < skeleton.channels.size(); ++c) {
    if (!skeleton.channels[c].translation) continue;
    const auto column = clip.channels.col(static_cast<Eigen::Index>(c));
    if (column.maxCoeff() - column.minCoeff() > kSameLength_m) return skeleton.channels[c].joint;
  }
  return 0;
}

// Position channels of a joint below the root joint replace its OFFSET; a bone keeps its length, so
// they are constant and become the offset. One that moves is told.
void settle_offsets(Clip& clip, Skeleton& skeleton) {
  for (std::size_t c = 0; c < skeleton.channels.size(); ++c) {
    const Channel& channel = skeleton.channels[c];
    if (!channel.translation || channel.joint <= skeleton.root_joint) continue;
    Joint& joint = skeleton.joints[channel.joint];
    const auto column = clip.channels.col(static_cast<Eigen::Index>(c));
    double& offset_m = joint.offset_m[static_cast<int>(channel.axis)];
    if (std::abs(column[0] - offset_m) > 0.1 * kSameLength_m) offset_m = column[0];
    if (column.maxCoeff() - column.minCoeff() > kSameLength_m) {
      clip.warnings.push_back("joint '" + joint.name +
                              "' changes its distance from its parent; posed keeps that of the "
                              "first frame");
    }
  }
}

void check_declared(std::string_view declared, Clip& clip) {
  const auto count = parse_number(declared);
  if (count && *count == clip.frames()) return;
  clip.warnings.push_back("'Frames:' says " + in_quotes(declared) + ", but there are " +
                          std::to_string(clip.frames()) + "; read all of them");
}

}  // namespace

Result<Clip> parse_bvh(std::string_view text, const std::string& name, const ReadOptions& options) {
  text = without_bom(text);
  auto header = parse_bvh_header(text, name);
  if (!header) return std::unexpected(header.error());

  Clip clip;
  clip.path = name;
  clip.frame_rate_hz = header->frame_rate_hz;
  clip.metres_per_unit = options.metres_per_unit ? *options.metres_per_unit
                                                 : guess_unit(header->skeleton, clip.warnings);
  auto skeleton = std::make_shared<Skeleton>(std::move(header->skeleton));
  clip.skeleton = skeleton;
  scale_lengths(*skeleton, clip.metres_per_unit);

  const FrameParser parser = FrameParser::bvh(*skeleton, clip.metres_per_unit);
  auto rows = read_rows(text.substr(header->motion_offset), header->motion_line, parser, name);
  if (!rows) return std::unexpected(rows.error());
  clip.channels = Eigen::Map<const ChannelMatrix>(rows->values.data(), rows->frames,
                                                  static_cast<Eigen::Index>(parser.channels()));
  check_declared(header->declared_frames, clip);

  skeleton->name = std::filesystem::path(name).stem().string();
  skeleton->root_joint = find_root_joint(clip);
  settle_offsets(clip, *skeleton);
  if (auto ok = skeleton->finish(); !ok) return fail(ok.error().message, name);
  return clip;
}

}  // namespace posed::clip
