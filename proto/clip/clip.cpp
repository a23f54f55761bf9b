#include "proto/clip/clip.hpp"

#include <cmath>

#include "proto/clip/bvh.hpp"
#include "proto/clip/text.hpp"

namespace posed::clip {

Frame Clip::frame(int index) const {
  Frame frame;
  frame.header.sequence = static_cast<std::uint64_t>(index) + 1;
  frame.header.device_ns = nanoseconds(index / frame_rate_hz);
  frame.source = Source::kFile;
  const auto row = channels.row(index);
  pose_from_channels(*skeleton, {row.data(), static_cast<std::size_t>(row.size())}, frame);
  return frame;
}

Result<Clip> read_clip(const std::filesystem::path& path, const ReadOptions& options) {
  const std::string extension = lower(path.extension().string());
  if (extension != ".bvh") {
    return fail("is no clip posed can read; a clip ends in .bvh or .amc", path.string());
  }
  auto text = load_text(path);
  if (!text) return std::unexpected(text.error());
  return parse_bvh(*text, path.string(), options);
}

}  // namespace posed::clip
