#include "daemon/tools/export/frame_file.hpp"

#include <array>
#include <cstdint>

namespace posed::tools {

Result<FrameFile> FrameFile::create(const std::filesystem::path& path) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) return fail("cannot be written: " + errno_text(), path.string());
  return FrameFile(std::move(file), path);
}

void FrameFile::add(const v1::Frame& frame) {
  frame.SerializeToString(&bytes_);
  const auto size = static_cast<std::uint32_t>(bytes_.size());
  std::array<char, 4> length{};
  for (std::size_t i = 0; i < length.size(); ++i) length[i] = static_cast<char>(size >> (8 * i));
  file_.write(length.data(), length.size());
  file_.write(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
}

Result<> FrameFile::close() {
  file_.close();
  if (!file_) return fail("could not be written whole; is the disk full?", path_.string());
  return {};
}

}  // namespace posed::tools
