#include "daemon/tools/export/frame_file.hpp"

#include <array>
#include <cstdint>

namespace posed::tools {

Result<FrameFile> FrameFile::create(const std::filesystem::path& path) {
  auto file = TRY(WholeFile::open(path));
  return FrameFile(std::move(file));
}

void FrameFile::add(const v1::Frame& frame) {
  frame.SerializeToString(&bytes_);
  const auto size = static_cast<std::uint32_t>(bytes_.size());
  std::array<char, 4> length{};
  for (std::size_t i = 0; i < length.size(); ++i) length[i] = static_cast<char>(size >> (8 * i));
  file_.out().write(length.data(), length.size());
  file_.out().write(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
}

}  // namespace posed::tools
