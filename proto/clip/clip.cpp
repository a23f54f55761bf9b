#include "proto/clip/clip.hpp"

#include <cmath>

#include "proto/clip/draft.hpp"
#include "proto/clip/format.hpp"

namespace posed::clip {

Frame Clip::frame(int index) const {
  Frame frame;
  frame.header.sequence = static_cast<std::uint64_t>(index) + 1;
  frame.header.device_ns =
      nanoseconds(time_s.empty() ? index / frame_rate_hz : time_s[static_cast<std::size_t>(index)]);
  frame.source = Source::kFile;
  const auto row = channels.row(index);
  pose_from_channels(*skeleton, {row.data(), static_cast<std::size_t>(row.size())}, frame);
  return frame;
}

bool has_uneven_times(const std::vector<double>& time_s, double rate_hz) {
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const double even_s = time_s.front() + static_cast<double>(i) / rate_hz;
    if (std::abs(time_s[i] - even_s) * rate_hz > 0.1) return true;
  }
  return false;
}

Result<Clip> read_clip(const std::filesystem::path& path, const ReadOptions& options) {
  const auto loaded = load_clip(path, options);
  if (!loaded) return std::unexpected(loaded.error());
  auto draft = loaded->format->read(loaded->file, options);
  if (!draft) return std::unexpected(draft.error());
  return clip_of(std::move(*draft), loaded->file.name);
}

Result<Clip> parse_clip(const ClipFile& file, const ReadOptions& options) {
  const Format* format = format_of(file.name);
  if (format == nullptr || format->read == nullptr) {
    return fail("is no clip posed can read; a clip is " + listed(Use::kRead), file.name);
  }
  if (auto ok = check_options(*format, options, file.name); !ok) {
    return std::unexpected(ok.error());
  }
  auto draft = format->read(file, options);
  if (!draft) return std::unexpected(draft.error());
  return clip_of(std::move(*draft), file.name);
}

Result<> write_clip(const Clip& clip, const std::filesystem::path& path) {
  const Format* format = format_of(path);
  if (format == nullptr || format->write == nullptr) {
    return misuse("is no clip posed can write; a clip is " + listed(Use::kWrite), path.string());
  }
  return format->write(clip, path);
}

}  // namespace posed::clip
