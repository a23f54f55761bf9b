#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include "proto/clip/bvh.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/figure.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/whole_file.hpp"

namespace posed::clip {
namespace {

constexpr double kDegreesPerRad = 1.0 / kDegree;

// Writes fixed notation, because some readers do not accept exponents. Nine digits keep an angle
// within 1e-6 deg over any number of round trips.
void append(std::string& out, double value) {
  std::array<char, 512> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                          std::chars_format::fixed, 9);
  std::string_view text(buffer.data(), static_cast<std::size_t>(end - buffer.data()));
  if (error != std::errc()) text = "0";
  while (text.ends_with('0')) text.remove_suffix(1);
  if (text.ends_with('.')) text.remove_suffix(1);
  out += text == "-0" || text.empty() ? "0" : text;
}

// Whoever knows no bone of the figure knows no T-pose of it.
bool rests_in_t(const Clip& clip) {
  const auto has_bone = [](const Joint& joint) { return joint.bone.has_value(); };
  return clip.up == UpAxis::kPlusY && std::ranges::any_of(clip.skeleton->joints, has_bone) &&
         std::ranges::all_of(clip.skeleton->joints, [](const Joint& joint) {
           return joint.T_world_joint.isApprox(Eigen::Quaterniond::Identity(), 1e-9);
         });
}

std::string motion_head(const Clip& clip) {
  std::string out = "MOTION\nFrames: " + std::to_string(clip.frames()) + "\nFrame Time: ";
  append(out, 1.0 / clip.frame_rate_hz);
  return out + bvh_mark({clip.metres_per_unit, clip.up, rests_in_t(clip)}) + "\n";
}

std::string motion_line(const Clip& clip, int index) {
  std::string line;
  const std::vector<Channel>& channels = clip.skeleton->channels;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const double value = clip.channels(index, static_cast<Eigen::Index>(c));
    if (c > 0) line += ' ';
    append(line, channels[c].translation ? value / clip.metres_per_unit : value * kDegreesPerRad);
  }
  return line + "\n";
}

// The clip in the axes of its file.
Clip in_file_axes(Clip clip) {
  auto skeleton = std::make_shared<Skeleton>(*clip.skeleton);
  const auto factors = turn_axes(up_turn(clip.up).transpose(), *skeleton);
  for (std::size_t c = 0; c < factors.size(); ++c) {
    clip.channels.col(static_cast<Eigen::Index>(c)) *= factors[c];
  }
  clip.skeleton = std::move(skeleton);
  return clip;
}

// Of the mark: the counts of blanks between tabulators.
constexpr std::array kMarkedUnits{1.0, 0.1, 0.01, 0.001, 0.0254, 0.3048, 0.0254 / 0.45, 2.4384};

class HierarchyWriter {
 public:
  HierarchyWriter(const Skeleton& skeleton, double metres_per_unit)
      : skeleton_(skeleton), metres_per_unit_(metres_per_unit) {}

  [[nodiscard]] std::string text() {
    out_ = "HIERARCHY\n";
    joint(0, 0);
    return std::move(out_);
  }

 private:
  void indent(int depth) { out_.append(static_cast<std::size_t>(depth), '\t'); }

  void offset(const Eigen::Vector3d& value_m, int depth) {
    indent(depth);
    out_ += "OFFSET";
    for (int i = 0; i < 3; ++i) {
      out_ += ' ';
      append(out_, value_m[i] / metres_per_unit_);
    }
    out_ += '\n';
  }

  void channels(int index, int depth) {
    std::string names;
    int count = 0;
    for (const Channel& channel : skeleton_.channels) {
      if (channel.joint != index) continue;
      names += ' ';
      names += "XYZ"[static_cast<std::size_t>(channel.axis)];
      names += channel.translation ? "position" : "rotation";
      ++count;
    }
    indent(depth);
    out_ += "CHANNELS " + std::to_string(count) + names + "\n";
  }

  void joint(int index, int depth) {
    const Joint& joint_here = skeleton_.joints[index];
    indent(depth);
    out_ += (index == 0 ? "ROOT " : "JOINT ") + joint_here.name + "\n";
    indent(depth);
    out_ += "{\n";
    offset(joint_here.offset_m, depth + 1);
    channels(index, depth + 1);
    for (int child = index + 1; child < std::ssize(skeleton_.joints); ++child) {
      if (skeleton_.joints[child].parent == index) joint(child, depth + 1);
    }
    if (joint_here.end_site_m) {
      indent(depth + 1);
      out_ += "End Site\n";
      indent(depth + 1);
      out_ += "{\n";
      offset(*joint_here.end_site_m, depth + 2);
      indent(depth + 1);
      out_ += "}\n";
    }
    indent(depth);
    out_ += "}\n";
  }

  const Skeleton& skeleton_;
  double metres_per_unit_;
  std::string out_;
};

}  // namespace

std::string bvh_mark(const BvhMark& mark) {
  const auto unit = std::ranges::find_if(kMarkedUnits, [&mark](double metres) {
    return std::abs(metres - mark.metres_per_unit) < 1e-9 * metres;
  });
  if (unit == kMarkedUnits.end()) return {};
  const auto up = std::ranges::find(kUpAxes, mark.up);
  std::string out = "\t";
  for (const auto count : {unit - kMarkedUnits.begin(), up - kUpAxes.begin(),
                           std::ptrdiff_t{mark.rests_in_t ? 1 : 0}}) {
    out.append(static_cast<std::size_t>(count) + 1, ' ').append("\t");
  }
  return out;
}

std::optional<BvhMark> find_bvh_mark(std::string_view header) {
  while (header.ends_with('\n') || header.ends_with('\r')) header.remove_suffix(1);
  header.remove_prefix(std::min(header.find_last_not_of(" \t") + 1, header.size()));
  std::vector<std::size_t> counts;
  while (header.starts_with('\t')) {
    header.remove_prefix(1);
    const std::size_t blanks = std::min(header.find('\t'), header.size());
    if (blanks == 0 || blanks == header.size()) break;
    counts.push_back(blanks - 1);
    header.remove_prefix(blanks);
  }
  const bool whole = counts.size() == 3 && header.empty();
  if (!whole || counts[0] >= kMarkedUnits.size() || counts[1] >= kUpAxes.size()) {
    return std::nullopt;
  }
  return BvhMark{kMarkedUnits[counts[0]], kUpAxes[counts[1]], counts[2] > 0};
}

std::string bvh_hierarchy(const Skeleton& skeleton, double metres_per_unit) {
  return HierarchyWriter(skeleton, metres_per_unit).text();
}

namespace {

// `clip` has the axes of the file, but `up` still says which of them is up.
Result<> write_turned(const Clip& clip, const std::filesystem::path& path) {
  return write_whole_file(path, [&clip](std::ostream& file) {
    file << bvh_hierarchy(*clip.skeleton, clip.metres_per_unit) << motion_head(clip);
    for (int i = 0; i < clip.frames() && file; ++i) file << motion_line(clip, i);
  });
}

}  // namespace

Result<> write_bvh(const Clip& clip, const std::filesystem::path& path) {
  if (is_acclaim(*clip.skeleton)) return write_bvh(with_zyx_channels(clip), path);
  if (clip.up != UpAxis::kPlusY) return write_turned(in_file_axes(clip), path);
  return write_turned(clip, path);
}

}  // namespace posed::clip
